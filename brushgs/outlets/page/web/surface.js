// What is painted on: the threads of linen and the bumps of paper, as rendering/surface.py has them.

const { THREAD_PERIOD, THREADS_BEFORE, THREAD_SPACING, NARROW_THREAD, SLUBS, WAVE_LENGTH, GOLDEN_32 } = SHARED;
const STREAMS = ["columns", "rows", "one", "other", "coarse", "fine"];
const DEVIATIONS = { // of surfaces of strength 1: height in pixels of a picture of 1000 x 750, and color
  flat: { height: 0, tone: 0 },
  linen: { height: SHARED.LINEN_HEIGHT, tone: SHARED.LINEN_TONE },
  paper: { height: SHARED.PAPER_HEIGHT, tone: SHARED.PAPER_TONE },
};

/** Pixels of a picture in one of a picture of 1000 x 750. */
function canvasScale(width, height) {
  return Math.sqrt((width * height) / SHARED.CANVAS_PIXELS);
}

/**
 * The height of linen or paper in standard deviations, as a texture of the size of a picture.
 *
 * Rows go up, as in framebuffers. `texture` is made anew by `resize`, and only where the size changed.
 */
class SurfacePattern {
  /**
   * @param {string} kind "linen" or "paper"
   * @param {number} seed of its numbers
   * @param {number} format gl.R32F or gl.R16F, whichever can be drawn to
   */
  constructor(gl, kind, seed, format) {
    Object.assign(this, { gl, kind, seed, texture: null, width: 0, height: 0 });
    this._format = format;
    this._program = new Program(gl, "screen.vert", "pattern.frag", kind === "linen" ? ["LINEN"] : []);
    this._framebuffer = gl.createFramebuffer();
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return;
    Object.assign(this, { width, height });
    const { gl } = this;
    gl.deleteTexture(this.texture);
    this.texture = newTexture(gl, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, this._format, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this._framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    gl.viewport(0, 0, width, height);
    const { at } = this._program;
    gl.useProgram(this._program.handle);
    gl.uniform2i(at.uSize, width, height);
    const scale = canvasScale(width, height);
    const threads = this.kind === "linen" ? this._setThreads(at, scale) : this._setBumps(at, scale);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.deleteTexture(threads);
  }

  /** Bytes of the texture. */
  get numBytes() {
    return (this._format === this.gl.R32F ? 4 : 2) * this.width * this.height;
  }

  dispose() {
    const { gl } = this;
    gl.deleteTexture(this.texture);
    gl.deleteFramebuffer(this._framebuffer);
    this._program.dispose();
  }

  _setBumps(at, scale) {
    const spacings = SHARED.PAPER_SPACINGS.map((spacing) => spacing * scale);
    this._setNoise(
      at,
      ["coarse", "fine"],
      spacings.map((spacing) => Math.max(spacing, 1)),
      spacings.map((spacing, i) => SHARED.PAPER_SHARES[i] * Math.min(1, spacing)),
    );
    return null;
  }

  /** @returns {WebGLTexture} of where pixels lie among threads, to be deleted when the pattern is drawn */
  _setThreads(at, scale) {
    const { gl, width, height } = this;
    this._setNoise(at, ["one", "other"], [WAVE_LENGTH * scale, WAVE_LENGTH * scale], [1, 1]);
    const [wide, none] = NARROW_THREAD;
    const shown = Math.min(1, Math.max(0, (THREAD_PERIOD * scale - none) / (wide - none)));
    gl.uniform1f(at.uShare, shown * shown * (3 - 2 * shown));
    const length = Math.max(width, height);
    const places = new Float32Array(4 * length);
    places.set(threadsOf(streamOf(this.seed, "columns"), width, THREAD_PERIOD * scale));
    places.set(threadsOf(streamOf(this.seed, "rows"), height, THREAD_PERIOD * scale), 2 * length);
    const texture = newTexture(gl, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG32F, length, 2, 0, gl.RG, gl.FLOAT, places);
    return texture;
  }

  _setNoise(at, names, spacings, deviations) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(at.uThreads ?? null, 0);
    gl.uniform1uiv(at.uStreams, names.map((name) => streamOf(this.seed, name)));
    gl.uniform1fv(at.uSpacings, spacings);
    gl.uniform1fv(at.uDeviations, deviations);
  }
}

/** Where each pixel lies among threads, whole where two meet, and how thick its own is, about 1, in turns. */
function threadsOf(stream, size, period) {
  const count = Math.ceil((1.3 * size) / period) + 16;
  const ends = new Float64Array(count);
  let end = 0;
  for (let i = 0; i < count; i++) {
    end += 1 + THREAD_SPACING * spreadAt(stream, 0, i);
    ends[i] = (end - THREADS_BEFORE) * period;
  }
  const places = new Float32Array(2 * size);
  for (let pixel = 0, i = 0; pixel < size; pixel++) {
    while (ends[i + 1] <= pixel + 0.5) i++;
    const place = (pixel + 0.5 - ends[i]) / (ends[i + 1] - ends[i]) + i;
    places[2 * pixel] = place;
    places[2 * pixel + 1] = 1 + SLUBS * spreadAt(stream, 1, Math.floor(place));
  }
  return places;
}

/** An even number of deviation 1 that belongs to a place of a lattice. */
function spreadAt(stream, row, column) {
  const bits = hash32(hash32(stream + Math.imul(column, GOLDEN_32)) + Math.imul(row, GOLDEN_32));
  return Math.sqrt(3) * ((bits >>> 8) / 2 ** 23 - 1);
}

/** The stream of numbers of one of the fields and axes of a surface. */
function streamOf(seed, name) {
  return hash32(seed + Math.imul(GOLDEN_32, STREAMS.indexOf(name)));
}

/** A 32-bit state mixed to another one: brushgs/values/hashing.py `hash_32`. */
function hash32(bits) {
  bits = Math.imul(bits ^ (bits >>> 16), 0x7feb352d);
  bits = Math.imul(bits ^ (bits >>> 15), 0x846ca68b);
  return (bits ^ (bits >>> 16)) >>> 0;
}
