// The canvas that coats are laid on: what rendering/coats.py `Canvas` does, in passes over the screen.
//
//     canvas.begin({ camera, width, height, x, y, target, ground });
//     coats.forEach((coat, i) => {
//       coat.draw(camera, head, Object.assign(options, canvas.bindCoat(i)));
//       canvas.lay(i);
//     });
//     canvas.finish();
//
// A coat is drawn into targets of its own only where it must be seen apart from the canvas: to be pressed
// through the tooth, to hide as paper does, to be tested against what is on the canvas, to tint it, or where
// heights lie below that it carries on. Others are drawn on the canvas, which gives the same. Where all are
// and no lamp shines, there is no canvas: coats are drawn into the target, over the ground.

const NO_FLOATS =
  "this browser cannot draw into float textures: the painting is shown without relief, lamp and threads";
// Samplers of a pass by unit.
const UNITS = {
  "soft.frag": ["uSoft", "uSoftDetail"],
  "wash.frag": ["uMade", "uMadeMore", "uPattern"],
  "rub.frag": ["uMade", "uMadeMore", "uPattern"],
  others: ["uCoat", "uCoatDetail", "uPattern", "uCanvas", "uDetail", "uTint", "uGroundImage", "uHeight"],
};
const [ZEROS, ONES] = [new Float32Array(4), new Float32Array(4).fill(1)];
// A pixel of each target; of those of null as many as the format of colors has.
const BYTES = { canvas: null, detail: 4, coat: null, coatDetail: 4, tint: null, blurredAlong: 2, blurred: 2 };
const HEIGHTS = 4; // pixels in a texel of blurred heights

/**
 * The canvas of a painting in one WebGL2 context.
 *
 * `notes` are sentences on what this browser cannot show of it. Targets are as large as the largest picture,
 * and made anew only for a larger or a far smaller one. A context that was lost needs a new Canvas.
 *
 * @throws {Error} where a shader does not compile, or a target cannot be made
 */
class Canvas {
  /**
   * @param {object} header of the contents: coats, surface, lamp, background, isTransparent
   * @param {object} arrays of the contents
   * @param {Programs} programs of the painter
   */
  constructor(gl, header, arrays, programs) {
    const { coats, surface } = header;
    const isFloat = gl.getExtension("EXT_color_buffer_float") !== null;
    const isHalf = isFloat || gl.getExtension("EXT_color_buffer_half_float") !== null;
    Object.assign(this, { gl, notes: isHalf ? [] : [NO_FLOATS], _header: header });
    this._canMake = isHalf;
    Object.assign(this, planOf(header, isHalf));
    this._targets = { width: 0, height: 0, textures: {}, framebuffers: {} };
    this._soft = { width: 0, height: 0 };
    this._chooseFormat(true);
    const format = isFloat ? gl.R32F : gl.R16F; // of the threads
    this._pattern = this._hasPattern ? new SurfacePattern(gl, surface.kind, surface.seed, format) : null;
    const image = surface?.image;
    this._image = image === undefined ? null : newImage(gl, header.arrays[image].shape, arrays[image]);
    this._picture = { width: 0, height: 0, x: 0, y: 0, target: null, ground: true, middle: 0 };
    this._place = { x: 0, y: 0, detail: false, below: null, belowDetail: null };
    this._lamp = header.lamp ?? {}; // who changes it there moves the lamp of the next picture
    this._taps = { width: 0, height: 0, reach: 0, weights: new Float32Array(MOST_REACH + HEIGHTS) };
    this._programs = programs;
    this._lays = coats.map((_, i) => this._layPrograms(this._plans[i]));
    this._blurs = !this._isLit ? [] : [
      { target: "blurredAlong", program: this._program("blur.frag", { DETAIL: this._hasDetail }) },
      { target: "blurred", program: this._program("blur.frag", { DOWN: true }) },
    ];
    const finishing = { LIT: this._isLit, GLAZED: this._hasGlaze, BARE: this._isStraight, PICTURE: this._image };
    this._finish = this._isStraight && this._isPlain ? null : this._program("finish.frag", finishing);
  }

  /**
   * Begin a picture.
   *
   * @param {object} picture `camera`, a PageCamera, or null where the lamp stands with the canvas; `width` and
   *     `height`, pixels; `x` and `y`, its lower left corner in the
   *     framebuffer `target`, null for that of the page; `ground`: true for that of the painting, false for
   *     none, or [r, g, b]; `isWhole`, whether effects are made as a whole, or coarsely, and
   *     colors of opaque strokes kept in 8 bits
   */
  begin({ camera = null, width, height, x = 0, y = 0, target = null, ground = true, isWhole = true }) {
    const { gl, _picture: picture } = this;
    const middle = camera ? camera.viewmat[11] : 0;
    Object.assign(picture, { width, height, x, y, target, ground, middle, isWhole });
    this._chooseFormat(isWhole);
    if (this._isLit && camera) this._turnLamp(camera.viewmat);
    gl.disable(gl.BLEND);
    this._pattern?.resize(width, height);
    if (this._isStraight) {
      this._drawGround();
      return;
    }
    this._resize(width, height);
    this._clear("canvasAlone", ZEROS);
    if (this._hasDetail) this._clear("detail", ZEROS);
    if (this._hasGlaze) this._clear("tintAlone", ONES);
  }

  /**
   * Bind what a coat is drawn into, and clear it where it is its own.
   *
   * @returns {object} options for `CoatPainter.draw`, one object for all coats: `x` and `y` of the picture,
   *     `detail`, and the textures `below` and `belowDetail` that the coat is tested against, or null
   */
  bindCoat(i) {
    const { gl, _place: place, _picture: picture } = this;
    const { textures } = this._targets;
    const { isDirect, isGlaze, isTested, hasDetail } = this._plans[i];
    Object.assign(place, { x: 0, y: 0, detail: hasDetail, below: null, belowDetail: null });
    if (this._isStraight) [place.x, place.y] = [picture.x, picture.y];
    if (!isDirect) this._clear("coatAlone", isGlaze ? ONES : ZEROS);
    this._bindCoatTarget(i);
    if (!isDirect && hasDetail) gl.clearBufferfv(gl.COLOR, 1, ZEROS);
    if (isTested) [place.below, place.belowDetail] = [textures.canvas, textures.detail];
    return place;
  }

  /**
   * Bind the layer that takes the underpaint of a coat whose target is bound, and clear it.
   *
   * @param {number} step pixels of the picture along one of the layer
   * @returns {object} more options for `CoatPainter.draw`
   */
  bindSoft(i, step) {
    const { gl, _picture: picture } = this;
    const { hasDetail } = this._plans[i];
    const [width, height] = [Math.ceil(picture.width / step), Math.ceil(picture.height / step)];
    if (this._soft.width !== width || this._soft.height !== height) this._makeSoft(width, height);
    const soft = this._soft;
    soft.span = [width * step, height * step];
    gl.bindFramebuffer(gl.FRAMEBUFFER, hasDetail ? soft.both : soft.alone);
    gl.viewport(0, 0, width, height);
    gl.clearBufferfv(gl.COLOR, 0, ZEROS);
    if (hasDetail) gl.clearBufferfv(gl.COLOR, 1, ZEROS);
    return { x: 0, y: 0, part: "underpaint", step, span: soft.span };
  }

  /** Lay the underpaint that was drawn, and bind the target of the coat for its strokes. */
  laySoft(i) {
    const { gl, _picture: picture, _soft: { color, detail, span } } = this;
    this._bindCoatTarget(i);
    const { handle, at } = this._program("soft.frag", { DETAIL: this._plans[i].hasDetail });
    gl.useProgram(handle);
    this._bindTexture(0, color);
    this._bindTexture(1, detail);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform2f(at.uOrigin, ...(this._isStraight ? [picture.x, picture.y] : [0, 0]));
    gl.uniform2fv(at.uSpan, span);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
  }

  /** Lay a coat that was drawn. */
  lay(i) {
    const { gl } = this;
    const { isDirect, isGlaze, hasHeight, hasDepth } = this._plans[i];
    if (isDirect) return;
    gl.enable(gl.BLEND);
    this._bindTarget(isGlaze ? "tint" : "canvasAlone");
    if (isGlaze) gl.blendFuncSeparate(gl.ZERO, gl.SRC_COLOR, gl.ZERO, gl.ONE);
    else gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const lays = this._laysOf(i);
    this._layPass(lays.color, i, false);
    if (hasHeight || hasDepth) this._bindTarget("detail");
    for (const isHeight of [true, false]) {
      if (!(isHeight ? hasHeight : hasDepth)) continue;
      gl.colorMask(isHeight, !isHeight, false, false); // of the canvas below, they go on by different shares
      this._layPass(lays.detail, i, isHeight);
    }
    gl.colorMask(true, true, true, true);
    gl.disable(gl.BLEND);
  }

  /** Compose ground, glazes, paint and light in the target. */
  finish() {
    if (this._isStraight) return;
    const { gl, _picture: picture } = this;
    for (const { target, program } of this._blurs) {
      this._bindTarget(target, HEIGHTS);
      const at = this._use(program, target === "blurred" ? "blurredAlong" : null);
      this._setTaps(at);
      gl.uniform2i(at.uSize, picture.width, picture.height);
      gl.uniform1f(at.uSurfaceHeight, this._surfaceHeight());
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    this._bindPicture();
    this._finishPass();
  }

  /** Passes over the whole picture besides the strokes: those of ground, coats, blur, and the last one. */
  get numPasses() {
    if (this._isStraight) return this._isPlain ? 0 : 1;
    const lays = this._plans.filter(({ isDirect }) => !isDirect);
    const heights = lays.filter(({ hasHeight }) => hasHeight).length;
    const depths = lays.filter(({ hasDepth }) => hasDepth).length;
    return lays.length + heights + depths + (this._isLit ? 3 : 1);
  }

  /** Bytes of all targets, with the texture of the surface. */
  get numBytes() {
    const { width, height, textures } = this._targets;
    const ofColor = this._format === this.gl.RGBA8 ? 4 : 8;
    const perPixel = Object.keys(textures).reduce((sum, name) => sum + (BYTES[name] ?? ofColor), 0);
    const ofSoft = (ofColor + BYTES.coatDetail) * this._soft.width * this._soft.height;
    return perPixel * width * height + ofSoft + (this._pattern?.numBytes ?? 0);
  }

  dispose() {
    this._free();
    this._freeSoft();
    this._pattern?.dispose();
    if (this._image) this.gl.deleteTexture(this._image.texture);
  }

  /** The programs that lay a coat that was drawn. */
  _laysOf(i) {
    return this._lays[i];
  }

  _layPrograms({ isDirect, isGlaze, isPressed, isHiding, hasBlacks, hasDetail }) {
    const paper = { PRESSED: isPressed, HIDES: isHiding, BLACKS: hasBlacks };
    const program = (kind) => this._program("lay.frag", { [kind]: true, ...paper });
    if (isDirect) return null;
    return { color: program(isGlaze ? "GLAZE" : "COLOR"), detail: hasDetail ? program("DETAIL") : null };
  }

  _program(fragment, has) {
    const defines = Object.keys(has).filter((name) => has[name]);
    if (this._hasPattern) defines.push("PATTERN");
    return this._programs.get("screen.vert", fragment, defines, UNITS[fragment] ?? UNITS.others);
  }

  /** Use a program of a pass, with all textures bound; those that it does not read may be drawn into. */
  _use(program, height = "blurred") {
    const { gl } = this;
    const { coat, coatDetail, canvas, detail, tint, [height]: blurred } = this._targets.textures;
    gl.useProgram(program.handle);
    this._bindTexture(0, coat);
    this._bindTexture(1, coatDetail);
    this._bindTexture(2, this._pattern?.texture);
    this._bindTexture(3, canvas);
    this._bindTexture(4, detail);
    this._bindTexture(5, tint);
    this._bindTexture(6, this._image?.texture);
    this._bindTexture(7, blurred);
    gl.activeTexture(gl.TEXTURE0);
    return program.at;
  }

  _bindTexture(unit, texture) {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, texture ?? null);
  }

  _layPass(program, i, isHeight) {
    const { gl } = this;
    const at = this._use(program);
    gl.uniform1f(at.uDry, this._header.coats[i].dry);
    gl.uniform1i(at.uIsHeight, isHeight ? 1 : 0);
    const { blacks } = this._header.coats[i];
    if (blacks) {
      gl.uniform1f(at.uThreshold, blacks.threshold);
      gl.uniform1f(at.uMiddle, this._picture.middle);
      gl.uniform2i(at.uSize, this._picture.width, this._picture.height);
      gl.uniform1f(at.uUnit, Math.sqrt((this._picture.width * this._picture.height) / SHARED.NESTED_PIXELS));
      gl.uniform3fv(at.uInk, blacks.ink);
      gl.uniform3fv(at.uPaper, blacks.paper);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  _finishPass() {
    const { gl, _picture: picture, _image: image } = this;
    const { lamp, surface } = this._header;
    const at = this._use(this._finish);
    const [ground, background] = this._colors();
    gl.uniform2i(at.uOrigin, picture.x, picture.y);
    gl.uniform2i(at.uSize, picture.width, picture.height);
    gl.uniform1i(at.uHasGround, ground !== null ? 1 : 0);
    gl.uniform3fv(at.uGround, ground?.length === 3 ? ground : ZEROS.subarray(0, 3));
    gl.uniform1i(at.uIsImage, ground === image ? 1 : 0);
    if (image) {
      const cover = Math.max(picture.width / image.width, picture.height / image.height);
      gl.uniform2f(at.uShown, picture.width / (cover * image.width), picture.height / (cover * image.height));
    }
    gl.uniform1f(at.uTone, surface === null ? 0 : surface.strength * DEVIATIONS[surface.kind].tone);
    if (background) gl.uniform4f(at.uBackground, background[0], background[1], background[2], 1);
    else gl.uniform4fv(at.uBackground, ZEROS);
    if (this._isLit) {
      gl.uniform3fv(at.uLamp, this._lamp.direction);
      gl.uniform3fv(at.uHalfWay, this._lamp.halfWay);
      gl.uniform1f(at.uStrength, lamp.strength);
      gl.uniform1f(at.uGloss, lamp.gloss);
      gl.uniform1f(at.uExponent, lamp.exponent);
      gl.uniform1f(at.uLevelShine, this._lamp.halfWay[2] ** lamp.exponent);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** A lamp that stands in the scene, as it shines on the canvas of a view: rendering/light.py. */
  _turnLamp(viewmat) {
    const { towards, leastRise } = this._header.lamp;
    if (!towards) return;
    const [right, down, ahead] = [0, 4, 8].map((row) => dot3(viewmat.subarray(row), towards));
    const direction = normalized3([right, down, Math.max(-ahead, leastRise)]);
    const [x, y, z] = direction;
    Object.assign(this._lamp, { direction, halfWay: normalized3([x, y, z + 1]) });
  }

  /** Color or image of the surface, and color of the background; null for those that are not seen. */
  _colors() {
    const { surface, background, isTransparent } = this._header;
    const { ground } = this._picture;
    if (ground === false) return [null, null];
    if (ground !== true) return surface === null ? [null, ground] : [ground, null];
    return surface === null || isTransparent ? [null, background] : [this._image ?? surface.color, null];
  }

  /** Whether the ground is one color or none. */
  get _isPlain() {
    const { surface, isTransparent } = this._header;
    return surface === null || isTransparent || (!this._hasPattern && surface.image === undefined);
  }

  _drawGround() {
    const { gl, _picture: picture } = this;
    this._bindPicture();
    if (!this._isPlain) {
      this._finishPass();
      return;
    }
    const [ground, background] = this._colors();
    const color = ground ?? background;
    gl.enable(gl.SCISSOR_TEST); // other eyes may be beside this one
    gl.scissor(picture.x, picture.y, picture.width, picture.height);
    if (color) gl.clearColor(color[0], color[1], color[2], 1);
    else gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.SCISSOR_TEST);
  }

  _bindPicture() {
    const { gl } = this;
    const { target, x, y, width, height } = this._picture;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(x, y, width, height);
  }

  _bindTarget(name, across = 1) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this._targets.framebuffers[name]);
    gl.viewport(0, 0, Math.ceil(this._picture.width / across), this._picture.height);
  }

  _bindCoatTarget(i) {
    const { isDirect, hasDetail } = this._plans[i];
    if (this._isStraight) this._bindPicture();
    else this._bindTarget((isDirect ? "canvas" : "coat") + (hasDetail ? "" : "Alone"));
  }

  _clear(name, values) {
    this._bindTarget(name);
    this.gl.clearBufferfv(this.gl.COLOR, 0, values);
  }

  /** Pixels: standard deviation of the height of the surface. */
  _surfaceHeight() {
    const { surface } = this._header;
    const { width, height } = this._picture;
    if (surface === null) return 0;
    return surface.strength * DEVIATIONS[surface.kind].height * canvasScale(width, height);
  }

  _setTaps(at) {
    const { gl, _taps: taps } = this;
    const { width, height } = this._picture;
    if (taps.width !== width || taps.height !== height) {
      Object.assign(taps, { width, height });
      taps.reach = blurTaps(taps.weights, this._header.lamp.blur * canvasScale(width, height));
    }
    gl.uniform1fv(at.uTaps, taps.weights);
    gl.uniform1i(at.uReach, taps.reach);
  }

  /** Opaque strokes hide the rounding of those below: in motion 8 bits do, which are blended in less time. */
  _chooseFormat(isWhole) {
    const format = this._canMake && (isWhole || this._isFine) ? this.gl.RGBA16F : this.gl.RGBA8;
    if (format === this._format) return;
    this._free();
    this._freeSoft();
    this._format = format;
  }

  _resize(width, height) {
    const { _targets: made } = this;
    const [most, highest] = [Math.max(width, made.width), Math.max(height, made.height)];
    const isFar = most * highest > 4 * width * height;
    if (!isFar && most === made.width && highest === made.height) return;
    this._free();
    this._makeTargets(isFar ? width : most, isFar ? height : highest);
  }

  _makeTargets(width, height) {
    const { gl } = this;
    const ownCoats = this._plans.filter(({ isDirect }) => !isDirect);
    const formats = {
      canvas: this._format,
      detail: this._hasDetail && gl.RG16F,
      coat: ownCoats.length > 0 && this._format,
      coatDetail: ownCoats.some(({ hasDetail }) => hasDetail) && gl.RG16F,
      tint: this._hasGlaze && this._format,
      blurredAlong: this._isLit && gl.RGBA16F,
      blurred: this._isLit && gl.RGBA16F,
    };
    const textures = {};
    for (const name of Object.keys(formats).filter((name) => formats[name])) {
      textures[name] = newTexture(gl, gl.NEAREST);
      const across = name.startsWith("blurred") ? Math.ceil(width / HEIGHTS) : width;
      gl.texStorage2D(gl.TEXTURE_2D, 1, formats[name], across, height);
    }
    const { canvas, detail, coat, coatDetail, tint, blurredAlong, blurred } = textures;
    const attached = {
      canvas: [canvas, detail],
      canvasAlone: [canvas],
      detail: [detail],
      coat: [coat, coatDetail],
      coatAlone: [coat],
      tint: [canvas, tint],
      tintAlone: [tint],
      blurredAlong: [blurredAlong],
      blurred: [blurred],
    };
    const framebuffers = {};
    for (const name of Object.keys(attached)) {
      if (attached[name].every(Boolean)) framebuffers[name] = newFramebuffer(gl, attached[name]);
    }
    this._targets = { width, height, textures, framebuffers };
  }

  _makeSoft(width, height) {
    const { gl } = this;
    this._freeSoft();
    const [color, detail] = [this._format, gl.RG16F].map((format) => {
      const texture = newTexture(gl, gl.LINEAR);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
      return texture;
    });
    const [both, alone] = [this._hasDetail ? newFramebuffer(gl, [color, detail]) : null, newFramebuffer(gl, [color])];
    this._soft = { width, height, color, detail, both, alone, span: [width, height] };
  }

  _freeSoft() {
    const { gl, _soft: { color = null, detail = null, both = null, alone = null } } = this;
    for (const texture of [color, detail]) gl.deleteTexture(texture);
    for (const framebuffer of [both, alone]) gl.deleteFramebuffer(framebuffer);
    this._soft = { width: 0, height: 0 };
  }

  _free() {
    const { gl } = this;
    const { textures, framebuffers } = this._targets;
    for (const texture of Object.values(textures)) gl.deleteTexture(texture);
    for (const framebuffer of Object.values(framebuffers)) gl.deleteFramebuffer(framebuffer);
    this._targets = { width: 0, height: 0, textures: {}, framebuffers: {} };
  }
}

function newFramebuffer(gl, textures) {
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  textures.forEach((texture, i) => {
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
  });
  gl.drawBuffers(textures.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
  if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) {
    throw new Error("the graphics card cannot draw into the textures of a painting; update its driver");
  }
  return framebuffer;
}

/** The picture of a ground: uint8 [height, width, 3]. */
function newImage(gl, [height, width], array) {
  const texture = newTexture(gl, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, width, height, 0, gl.RGB, gl.UNSIGNED_BYTE, array);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  gl.generateMipmap(gl.TEXTURE_2D);
  return { texture, width, height };
}
