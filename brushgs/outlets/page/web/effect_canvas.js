// A canvas whose coats may have effects, which are made as a whole where a picture rests: made.js computes them.

const MOST_MADE = 500000; // pixels of washes and rubbed tones that are made, in some tenths of a second
const MOST_QUICK = 2 << 20; // pixels of washes in motion, each with some 80 bytes of textures

/** A `Canvas` that lays effects that were made. */
class EffectCanvas extends Canvas {
  /** Whether a coat has an effect that can be made as a whole. */
  get hasEffects() {
    return this._plans.some((_, i) => this._kindOf(i) !== null);
  }

  /** Whether a coat has an effect that is made as a whole in this picture. */
  isMade(i) {
    return this._picture.isWhole && this._kindOf(i) !== null;
  }

  /**
   * What the effect of a coat is made of: see `makeEffect`.
   *
   * @param {PageCamera} camera of the picture
   * @param {function} boxesOf a camera, see `CoatPainter.boxes`: effects of layers are made of fewer pixels
   * @param {number} count of the boxes that are painted
   * @returns {?object} numbers and arrays; null where the coat has no effect
   */
  jobOf(i, camera, boxesOf, count) {
    const kind = this._kindOf(i);
    if (kind === null) return null;
    const step = kind === "blacks" ? 1 : Math.max(1, Math.sqrt((camera.width * camera.height) / MOST_MADE));
    const made = smallerCamera(camera, step);
    const facts = this._header.coats[i][kind], middle = camera.viewmat[11];
    return { kind, facts, boxes: boxesOf(made), count, camera: { ...made }, sheet: sheetOf(camera, step), step, middle };
  }

  /** Whether the washes of a coat can be made by the graphics processor, while the picture moves. */
  hasQuickWashes(i) {
    return this._kindOf(i) === "washes";
  }

  /**
   * Lay the washes of a coat, made by the graphics processor.
   *
   * @param {CoatPainter} source the strokes that they are made of
   * @param {number} step pixels of the picture along one of the layers, more where it is large; see `WetPicture`
   */
  layQuickWashes(i, source, step, camera, head, drawing) {
    this._wet ??= new WetPicture(this.gl, this._programs);
    step = Math.max(step, Math.sqrt((camera.width * camera.height) / MOST_QUICK));
    const size = { camera: smallerCamera(camera, step), sheet: sheetOf(camera, step) };
    const made = this._wet.make(this._header.coats[i].washes, source, size, head, drawing);
    this._bindCoatTarget(i);
    this._layWashes(i, { ...made, step });
  }

  get numBytes() {
    return super.numBytes + (this._wet?.numBytes ?? 0);
  }

  dispose() {
    super.dispose();
    this._wet?.dispose();
  }

  /** Lay what `makeEffect` made of a coat in the target of the coat, which is bound. */
  layEffect(i, made) {
    const lays = { blacks: this._layBlacks, washes: this._layWashes, rub: this._layRub };
    lays[this._kindOf(i)].call(this, i, made);
  }

  _kindOf(i) {
    const { hasBlacks, hasLayers } = this._plans[i];
    if (!this._canMake || !(hasBlacks || hasLayers)) return null;
    return !hasLayers ? "blacks" : this._header.coats[i].rub ? "rub" : "washes";
  }

  /** An effect that was made needs none of the programs that stand in for it. */
  _laysOf(i) {
    if (!this.isMade(i)) return super._laysOf(i);
    return this._layPrograms({ ...this._plans[i], isHiding: false, hasBlacks: false });
  }

  _layBlacks(i, { width, height, layers }) {
    const { gl } = this, { coat, coatDetail } = this._targets.textures;
    for (const [texture, format, numbers] of [[coat, gl.RGBA, layers[0]], [coatDetail, gl.RG, layers[1]]]) {
      this._bindTexture(0, texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, format, gl.FLOAT, numbers);
    }
  }

  _layWashes(i, made) {
    const { gl } = this, { surface, coats } = this._header, { washes } = coats[i].washes;
    this._layLayers(i, "wash.frag", made, (at) => {
      gl.uniform1f(at.uGrain, washes.grain);
      gl.uniform2f(at.uLightNoise, washes.light_noise[0] / washes.light[1], washes.most);
      gl.uniform3fv(at.uGround, surface?.color ?? [1, 1, 1]);
      gl.uniform1f(at.uTone, surface === null ? 0 : surface.strength * DEVIATIONS[surface.kind].tone);
    });
  }

  _layRub(i, made) {
    const { gl } = this, { surface, coats } = this._header, { paper, black } = coats[i].rub;
    this._layLayers(i, "rub.frag", made, (at) => {
      gl.uniform3fv(at.uPaper, paper);
      gl.uniform3fv(at.uInk, black);
      gl.uniform1f(at.uTooth, surface === null ? 0 : SHARED.RUB_TOOTH);
    });
  }

  /** Lay layers [height, width, 4] of fewer pixels than the picture, or textures of them. */
  _layLayers(i, fragment, { width, height, step, layers = null, textures = null }, setUniforms) {
    const { gl, _picture: picture } = this, { isGlaze, hasDetail } = this._plans[i];
    const { handle, at } = this._program(fragment, { GLAZE: isGlaze, DEPTH: hasDetail });
    const used = textures ?? layers.map((numbers) => {
      const texture = newTexture(gl, gl.LINEAR);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.FLOAT, numbers);
      return texture;
    });
    gl.useProgram(handle);
    this._bindTexture(2, this._pattern?.texture);
    used.forEach((texture, k) => this._bindTexture(k, texture));
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform2f(at.uShare, 1 / (step * width), 1 / (step * height));
    gl.uniform1f(at.uLift, step * height - picture.height);
    gl.uniform1f(at.uMiddle, picture.middle);
    setUniforms(at);
    gl.disable(gl.BLEND);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (layers) for (const texture of used) gl.deleteTexture(texture);
  }
}

/** The same view with one pixel for so many along a side; its lower and right pixels may lie beyond the picture. */
function smallerCamera(camera, step) {
  const { width, height, fx, fy, cx, cy } = camera;
  const lens = { fx: fx / step, fy: fy / step, cx: cx / step, cy: cy / step };
  const [across, down] = [width, height].map((side) => Math.ceil(side / step));
  return new PageCamera({ ...camera, ...lens, width: across, height: down, step });
}

/** Sides of a picture in pixels of one with a pixel for so many along a side. */
const sheetOf = ({ width, height }, step) => [width / step, height / step];
