// Shader programs.

/**
 * A program and the places of its uniforms.
 *
 * @param {string} vertex name of a shader in SHADERS
 * @param {string} fragment name of a shader in SHADERS
 * @param {string[]} defines "NAME" or "NAME value"
 * @param {string[]} outputs varyings for transform feedback, interleaved
 */
class Program {
  constructor(gl, vertex, fragment, defines = [], outputs = []) {
    this.gl = gl;
    this.handle = gl.createProgram();
    const shaders = [
      this._shader(gl.VERTEX_SHADER, vertex, defines),
      this._shader(gl.FRAGMENT_SHADER, fragment, defines),
    ];
    for (const shader of shaders) gl.attachShader(this.handle, shader);
    if (outputs.length) gl.transformFeedbackVaryings(this.handle, outputs, gl.INTERLEAVED_ATTRIBS);
    gl.linkProgram(this.handle);
    if (!gl.getProgramParameter(this.handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = shaders.map((shader) => gl.getShaderInfoLog(shader));
      logs.push(gl.getProgramInfoLog(this.handle));
      throw new Error(`${vertex} and ${fragment}: ${logs.filter(Boolean).join("\n")}`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
    this.at = {};
    const count = gl.getProgramParameter(this.handle, gl.ACTIVE_UNIFORMS) ?? 0;
    for (let i = 0; i < count; i++) {
      const name = gl.getActiveUniform(this.handle, i).name.replace("[0]", "");
      this.at[name] = gl.getUniformLocation(this.handle, name);
    }
  }

  dispose() {
    this.gl.deleteProgram(this.handle);
  }

  _shader(type, name, defines) {
    const { gl } = this;
    const shader = gl.createShader(type);
    const lines = defines.map((define) => `#define ${define}\n`).join("");
    gl.shaderSource(shader, SHADERS[name].replace("#version 300 es\n", `#version 300 es\n${lines}`));
    gl.compileShader(shader);
    return shader;
  }
}

/** Programs by what they are made of: coats and canvases that need the same one share it. */
class Programs {
  constructor(gl) {
    this._gl = gl;
    this._made = new Map();
  }

  /**
   * A program, compiled where there is none yet; arguments are those of `Program`.
   *
   * Users set all uniforms that it reads before they draw, but for its samplers.
   *
   * @param {string[]} samplers their names, by unit
   */
  get(vertex, fragment, defines, samplers, outputs) {
    const key = [vertex, fragment, ...defines].join();
    if (!this._made.has(key)) {
      const program = new Program(this._gl, vertex, fragment, defines, outputs);
      this._made.set(key, program);
      this._gl.useProgram(program.handle);
      samplers.forEach((name, unit) => this._gl.uniform1i(program.at[name] ?? null, unit));
    }
    return this._made.get(key);
  }

  dispose() {
    for (const program of this._made.values()) program.dispose();
    this._made.clear();
  }
}
