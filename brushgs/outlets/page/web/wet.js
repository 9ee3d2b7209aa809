// Washes of watercolour in a picture that moves: those of washes.js, made by the graphics processor in few pixels.
//
// Of the three smoothings the second stands for the first as well, in one round, and the third is left out: that costs
// 1 to 3 dB.

const BLUR_REACH = 3, RUN_REACH = 2.77; // deviations; beyond them weights are below 0.02
const WIDEST = Math.sqrt(3 * 4 ** (WET_ROUNDS - 1) / (4 ** WET_ROUNDS - 1)); // deviation of a first round, of all
const LOST_WIDTHS = SHARED.WET_WIDTHS[0].map((share) => share * SHARED.WET_LOSS); // over the diagonal
const WET_UNITS = {
  "wet_space.frag": ["uSoft", "uSoftDetail"],
  "wet_key.frag": ["uSoft", "uSpace", "uAround"],
  "wet_hold.frag": ["uKeyed", "uSpace"],
  "wet_run.frag": ["uRun", "uHold"],
  "wet_means.frag": ["uKeyed", "uSpace", "uWide", "uSoft"],
  "wet_blur.frag": ["uBlurred"],
  "wet_mix.frag": ["uKeyed", "uSpace", "uWide", "uRims", "uOutlines", "uCores", "uBorder", "uSoftDetail"],
};
// Layers by size: that of the washes, half of its pixels along a side, and half of those.
const WET_LAYERS = [
  ["soft", "softDetail", "keyed", "row", "column", "wide", "border", "paint", "more"],
  ["space", "means", "meansAcross", "rims"],
  ["across", "around", "outlines", "cores"],
];

/** Makes the washes of coats, one after the other. `numBytes` are those of its textures. */
class WetPicture {
  constructor(gl, programs) {
    Object.assign(this, { gl, numBytes: 0, _programs: programs, _textures: {}, _framebuffers: {}, _sheet: [0, 0] });
  }

  /**
   * @param {object} facts of `makeWashes`
   * @param {CoatPainter} source the strokes that washes are made of
   * @param {object} size `camera` of the layers; `sheet` [2], sides of the picture in their pixels
   * @param {PageCamera} head see `Painter.paint`
   * @param {object} drawing options of `CoatPainter.draw`
   * @returns {object} as `makeEffect`, but `textures`, to be used before the next call, in place of layers
   */
  make(facts, source, { camera, sheet }, head, drawing) {
    const { gl } = this, { width, height } = camera;
    this._resize(width, height, sheet);
    gl.disable(gl.BLEND);
    this._bind(["soft", "softDetail"]);
    for (const k of [0, 1]) gl.clearBufferfv(gl.COLOR, k, ZEROS);
    source.draw(camera, head, { ...drawing, x: 0, y: 0, detail: true, part: null, below: null, belowDetail: null });
    const kinds = [...(facts.key ? [] : ["SHADOW"]), ...(facts.isRoom ? ["HOLES"] : [])];
    const numbers = this._numbers(facts, camera);
    if (facts.isRoom) {
      this._pass("wet_means.frag", ["HOLES"], ["means"], [null, null, null, "soft"], numbers);
      this._blur("means", "across", "around", [], Array(4).fill(SHARED.WET_HOLE));
    }
    const uPlace = this._placeOf("soft", "space");
    this._pass("wet_space.frag", [], ["space"], ["soft", "softDetail"], { ...numbers, uPlace });
    this._pass("wet_key.frag", kinds, ["keyed"], ["soft", "space", "around"], numbers);
    if (facts.key) this._run(facts.smoothing[1]);
    const inputs = ["keyed", "space", facts.key ? "wide" : "keyed"];
    this._pass("wet_means.frag", kinds.filter((kind) => kind !== "HOLES"), ["means"], inputs, numbers);
    this._blur("means", "meansAcross", "rims", [], Array(4).fill(SHARED.WET_RIM));
    if (facts.key && !facts.isRoom) {
      const widths = [...LOST_WIDTHS, LOST_WIDTHS[2]];
      this._blur("means", "across", "outlines", ["COVER"], widths);
      this._blur("outlines", "across", "cores", ["CORES"], widths);
    }
    inputs.push("rims", "outlines", "cores", "border", "softDetail");
    this._pass("wet_mix.frag", kinds, ["paint", "more"], inputs, numbers);
    return { width, height, textures: [this._textures.paint, this._textures.more] };
  }

  /** Smooth keyed colors as far as a wash lets them run. */
  _run({ 0: width, 1: edge, 2: wet, 3: loose }) {
    const uSigma = width * this._diagonal, uFar = Math.ceil(RUN_REACH * uSigma), uLow = this._placeOf("space", "keyed");
    const numbers = { uLow, uSigma, uWash: [edge, wet, loose] };
    this._pass("wet_hold.frag", [], ["row", "column"], ["keyed", "space"], numbers);
    this._pass("wet_run.frag", [], ["paint"], ["row", "column"], { uAlong: [1, 0], uFar });
    this._pass("wet_run.frag", [], ["wide"], ["paint", "column"], { uAlong: [0, 1], uFar });
  }

  /** Blur four planes by deviations in diagonals, by way of a layer across; `kinds` decide what they are made of. */
  _blur(from, across, to, kinds, widths) {
    const sigmas = widths.map((width) => (width * this._diagonal) / this._stepOf(to));
    const uRates = sigmas.map((sigma) => Math.SQRT2 / (WIDEST * sigma)), uFar = Math.ceil(BLUR_REACH * Math.max(...sigmas));
    const along = (uAlong, one, other) => ({ uRates, uFar, uAlong, uPlace: this._placeOf(one, other) });
    this._pass("wet_blur.frag", kinds, [across], [from], along([1, 0], from, across));
    this._pass("wet_blur.frag", [], [to], [across], along([0, 1], across, to));
  }

  /** Pixels of the washes along one of a layer. */
  _stepOf(name) {
    return 2 ** WET_LAYERS.findIndex((names) => names.includes(name));
  }

  _sizeOf(name) {
    return this._size.map((side) => Math.ceil(side / this._stepOf(name)));
  }

  /** How much of a layer, of 1, a pixel of another one spans along each side. */
  _placeOf(layer, other) {
    return this._sizeOf(layer).map((side) => this._stepOf(other) / this._stepOf(layer) / side);
  }

  /** `heightsAbove` a ground, by pixels from the lower left corner. */
  _aboveGround(ground, camera) {
    if (!ground) return [0, 0, 0, 1];
    const [across, down, ahead, eye] = heightsAbove(ground, camera);
    return [across, -down, ahead + down * this._size[1], eye];
  }

  /** The uniforms of all passes that map colors. */
  _numbers({ key, washes, anchor, towards, ground, losing = 1 }, camera) {
    const { fx, fy, cx, cy, viewmat: m } = camera;
    const { center, scale, focus, reach, seed } = anchor, placed = (point) => point.map((x, k) => (x - center[k]) / scale);
    const lamp = towards ? [0, 4].map((row) => dot3(m.subarray(row), towards)) : SHARED.WET_FROM_ABOVE;
    const { low = 0, high = 1, darkest = 0, gamma = 1, chroma = 1, solid = 1 } = key ?? {};
    return {
      uSize: this._size, uLens: [fx, fy, cx, cy],
      uLow: this._placeOf("space", "soft"), uTiny: this._placeOf("cores", "soft"),
      uRays: [0, 1, 2, 4, 5, 6, 8, 9, 10].map((at) => m[at] / scale), uEye: placed([...camera.eye()]),
      uFocus: placed(focus), uReach: reach / scale, uMiddle: m[11], uSeed: seed,
      uCell: (NOISE_FINEST * this._diagonal) / (Math.sqrt(fx * fy) * scale),
      uKey: [low, high, darkest, gamma], uKeyMore: [chroma, solid], uSolid: solid, uLuminance: LUMA,
      uShares: washes.shares, uSteps: washes.steps, uHardness: washes.hardness, uMasses: washes.masses,
      uWander: washes.wander, uAtFocus: washes.at_focus, uRimShares: washes.rims, uFlows: washes.flows,
      uDips: washes.dips, uCrests: washes.crests, uLight: washes.light, uLightFlow: washes.light_noise[1],
      uLost: [...washes.lost, losing], uLamp: lamp, uGround: this._aboveGround(ground, camera),
      uWidths: LOST_WIDTHS.map((one) => (one * this._diagonal) / this._stepOf("cores")),
    };
  }

  _pass(fragment, kinds, targets, textures, numbers) {
    const { gl } = this, { handle, at } = this._programs.get("screen.vert", fragment, kinds, WET_UNITS[fragment]);
    this._bind(targets);
    gl.useProgram(handle);
    textures.forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, name && this._textures[name]);
    });
    gl.activeTexture(gl.TEXTURE0);
    for (const [name, value] of Object.entries(numbers)) {
      if (!at[name]) continue;
      if (name === "uSeed") gl.uniform1ui(at[name], value);
      else if (name === "uRays") gl.uniformMatrix3fv(at[name], false, value);
      else gl[`uniform${name === "uLost" ? 1 : value.length ?? 1}fv`](at[name], [value].flat());
    }
    gl.uniform3uiv(at.uPrimes ?? null, PRIMES);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  _bind(targets) {
    const { gl, _textures: textures, _framebuffers: framebuffers } = this, key = targets.join();
    framebuffers[key] ??= newFramebuffer(gl, targets.map((name) => textures[name]));
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffers[key]);
    gl.viewport(0, 0, ...this._sizeOf(targets[0]));
  }

  _resize(width, height, sheet) {
    if (this._sheet[0] === sheet[0] && this._sheet[1] === sheet[1]) return;
    this.dispose();
    const { gl } = this;
    Object.assign(this, { _size: [width, height], _sheet: sheet, _diagonal: Math.hypot(...sheet) });
    for (const name of WET_LAYERS.flat()) {
      const [across, down] = this._sizeOf(name), [format, bytes] = name === "softDetail" ? [gl.RG16F, 4] : [gl.RGBA16F, 8];
      this._textures[name] = newTexture(gl, gl.LINEAR);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, across, down);
      this.numBytes += bytes * across * down;
    }
    const lens = [this._diagonal, this._diagonal, sheet[0] / 2, sheet[1] / 2];
    const border = { uSize: this._size, uSheet: sheet, uLens: lens, uSeed: 0, uCell: NOISE_FINEST };
    this._pass("wet_space.frag", ["BORDER"], ["border"], [], border);
  }

  dispose() {
    const { gl } = this;
    for (const texture of Object.values(this._textures)) gl.deleteTexture(texture);
    for (const framebuffer of Object.values(this._framebuffers)) gl.deleteFramebuffer(framebuffer);
    Object.assign(this, { _textures: {}, _framebuffers: {}, _sheet: [0, 0], numBytes: 0 });
  }
}
