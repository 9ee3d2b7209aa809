// Paints a whole picture: the coats of a painting, one on the other.

/**
 * A painting in one WebGL2 context.
 *
 * With `onSharper`, a function, the first picture comes sooner where there are many brushes: large strokes
 * are a little blurred in it. The function is called when another picture would be sharper.
 *
 * @throws {Error} where a shader does not compile
 */
class Painter {
  constructor(gl, contents, onSharper = null) {
    this.gl = gl;
    this._onSharper = onSharper;
    this._programs = new Programs(gl);
    this.replace(contents);
  }

  /** Paint something else from now on. */
  replace(contents) {
    const { gl } = this;
    const { header, arrays } = contents;
    const atlas = this._atlas?.serves(header, arrays) ? this._atlas : null;
    if (atlas) this._atlas = null; // or it would be disposed of
    this._free();
    this.contents = contents;
    this._atlas = atlas ?? new Atlas(gl, header, arrays, this._onSharper);
    this._noise = newNoise(gl);
    this._coats = header.coats.map((coat) => this._newCoat(coat));
    this._canvas = this._newCanvas(header);
    this._sources = []; // made when they are needed
    this._motion = new Motion(contents);
    this.move(this._seconds ?? 0);
    this._bareCanvas = this._highlighter = null; // made when they are needed
    this._drawing = {}; // options of a coat
  }

  /**
   * Paint a view.
   *
   * @param {PageCamera} camera of the eye: centers and covariances
   * @param {object} options
   *     head: PageCamera whose eye gives order, colors and directions; that of the camera where not given.
   *     order: "depth" as `render` has it, or "distance", which two eyes share and a head that turns does not
   *     change, for headsets. share: 0 to 1 of the strokes of each coat.
   *     brush: in place of those of all coats, an index into the brushes of the header; null for their own.
   *     ground: true, false for strokes alone, or [r, g, b]. target: framebuffer, null for the canvas.
   *     viewport: [x, y, width, height]; null for all of the canvas.
   *     isBare: on a smooth surface and without border: threads, grain and border belong to a picture, and
   *     would float before eyes that stand in the scene. Its ground is white where `ground` is true.
   *     underpaintStep: 0 for underpaint among the strokes, as `render` has it; else that of a coat is one layer
   *     below all strokes of the coat, with one pixel for so many along a side: most of the fragments are saved.
   *     numSlabs: so many layers, each below its share of the strokes; a backdrop has one.
   *     wetStep: pixels along one of the layers that washes are made of where `isWhole` is false.
   *     isWhole: whether effects of coats, such as spot blacks, are made as `render` does, which takes seconds;
   *     else coarsely, by shaders. made: what `makeEffect` made of the jobs of `jobs`; null to make it here.
   *     highlight: a `Part`, see highlight.js: a veil lies over what does not belong to it; null for none.
   */
  paint(camera, { head = camera, order = "depth", share = 1, brush = null, ground = true, target = null,
    viewport = null, isBare = false, highlight = null, underpaintStep = 0, numSlabs = 1, wetStep = 2,
    isWhole = !isBare, made = null } = {}) {
    const { gl, _drawing: drawing } = this;
    if (isBare) this._bareCanvas ??= this._newCanvas(bareHeader(this.contents.header));
    const canvas = isBare ? this._bareCanvas : this._canvas;
    const [x, y, width, height] = viewport ?? [0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight];
    const highlighter = highlight && (this._highlighter ??= new Highlighter(gl));
    highlighter?.begin(highlight, this._coats, width, height);
    canvas.begin({ camera: head, width, height, x, y, target, ground, isWhole });
    Object.assign(drawing, { order, share, brush, isBare });
    this._coats.forEach((coat, i) => {
      if (ground === false && coat.header.isBackdrop) return; // strokes alone, as --background transparent has
      Object.assign(drawing, canvas.bindCoat(i), { part: null });
      const isLayered = underpaintStep && !highlight && coat.hasUnderpaint && coat.header.blend !== "glaze";
      if (canvas.isMade(i)) {
        canvas.layEffect(i, made?.[i] ?? makeEffect(this._jobOf(i, canvas, camera, { head, share, brush })));
      } else if (!isBare && canvas.hasQuickWashes(i)) {
        canvas.layQuickWashes(i, this._sourceOf(i), wetStep, camera, head, drawing);
      } else if (isLayered) {
        this._drawLayers(i, canvas, camera, head, underpaintStep, coat.header.isBackdrop ? 1 : numSlabs);
      } else coat.draw(camera, head, drawing);
      highlighter?.add(i, coat, camera, head, drawing);
      canvas.lay(i);
    });
    canvas.finish();
    highlighter?.finish({ width, height, x, y, target });
  }

  /** Draw a coat in slabs from the farthest on, in each of them a layer of underpaint and the strokes above it. */
  _drawLayers(i, canvas, camera, head, step, numSlabs) {
    const { _coats: coats, _drawing: drawing } = this;
    for (let slab = 0; slab < numSlabs; slab++) {
      coats[i].draw(camera, head, { ...drawing, ...canvas.bindSoft(i, step), slab, numSlabs });
      canvas.laySoft(i);
      coats[i].draw(camera, head, { ...drawing, part: "strokes", slab, numSlabs });
    }
  }

  /** For each coat what `makeEffect` needs for a picture, or null; options are those of `paint`. */
  jobs(camera, { head = camera, share = 1, brush = null } = {}) {
    return this._coats.map((_, i) => this._jobOf(i, this._canvas, camera, { head, share, brush }));
  }

  _jobOf(i, canvas, camera, { head, share, brush }) {
    const boxesOf = (made) => this._sourceOf(i).boxes(made, head, brush);
    return canvas.jobOf(i, camera, boxesOf, this._coats[i].countOf(share));
  }

  /** Whether strokes are drawn a second time behind themselves. */
  get hasUnderpaint() {
    return this._coats.some((coat) => coat.hasUnderpaint);
  }

  /** Whether there are washes, which are made of fewer pixels in motion. */
  get hasWashes() {
    return this._coats.some((_, i) => this._canvas.hasQuickWashes(i));
  }

  /** The painter of the strokes that the effect of a coat is made of: washes map their colors afterwards. */
  _sourceOf(i) {
    const coat = this._coats[i], { header } = coat;
    if (!header.washes) return coat;
    const { shDegree } = header.washes, arrays = { ...header.arrays, sh: header.arrays.washSh };
    return (this._sources[i] ??= this._newCoat({ ...header, blend: "cover", shDegree, arrays }));
  }

  /** Whether there are effects that take time where they are made as a whole. */
  get hasEffects() {
    return this._canvas.hasEffects;
  }

  /** Seconds that the painting moves; 0 where nothing does. */
  get duration() {
    return this._motion.duration;
  }

  /** Bring the strokes to a time, in seconds from the start. */
  move(seconds) {
    this._seconds = seconds;
    this._motion.show(this._coats, seconds);
  }

  /** Columns of the strokes of each coat at the moment that is shown; their arrays change with it. */
  get columns() {
    return this._coats.map((coat) => coat.columns.now);
  }

  /** Sentences on what this browser cannot show of the painting. */
  get notes() {
    return this._canvas.notes;
  }

  /** The boxes of one coat, see `CoatPainter.boxes`. */
  boxes(coatIndex, camera, { head = camera, brush = null } = {}) {
    return this._coats[coatIndex].boxes(camera, head, brush);
  }

  /** How much there is to draw in all. */
  get counts() {
    const strokes = this._coats.reduce((sum, coat) => sum + coat.count, 0);
    const instances = this._coats.reduce((sum, coat) => sum + coat.count * (coat.hasUnderpaint ? 2 : 1), 0);
    const { numPasses, numBytes } = this._canvas;
    return {
      strokes,
      vertices: 4 * instances,
      atlasBytes: this._atlas.numBytes,
      passes: numPasses,
      targetBytes: numBytes,
    };
  }

  dispose() {
    this._free();
    this._programs.dispose();
  }

  _newCoat(header) {
    return new CoatPainter(this.gl, header, this.contents.arrays, this._atlas, this._noise, this._programs);
  }

  _newCanvas(header) {
    return new EffectCanvas(this.gl, header, this.contents.arrays, this._programs);
  }

  /** Let go of all but programs. */
  _free() {
    for (const coat of [...(this._coats ?? []), ...(this._sources ?? []).filter(Boolean)]) coat.dispose();
    this._canvas?.dispose();
    this._bareCanvas?.dispose();
    this._highlighter?.dispose();
    this._atlas?.dispose();
    if (this._noise) this.gl.deleteTexture(this._noise);
    this._coats = [];
    this._atlas = this._noise = this._canvas = this._bareCanvas = this._highlighter = null;
  }
}

/** The header of the same painting on a smooth white surface. */
function bareHeader(header) {
  return {
    ...header,
    surface: { kind: "flat", color: [1, 1, 1], strength: 0 },
    coats: header.coats.map((coat) => ({ ...coat, dry: 0 })),
  };
}
