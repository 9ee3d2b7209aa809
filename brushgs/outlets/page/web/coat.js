// The strokes of one coat: their textures, their order, and the program that draws them.

const TEXTURE_WIDTH = 2048;
const BOX_NUMBERS = 12; // of boxes.vert, a stroke
const SH_C0 = 0.28209479177387814; // of the term of degree 0
const { FITTED_REACH, IMAGE_SIGMAS } = SHARED;
// By unit.
const TEXTURES = ["uStrokes", "uSh", "uTable", "uAtlas", "uNoise", "uBelow", "uBelowDetail", "uMembers", "uTints",
  "uPlaced"];

/**
 * Draws a coat.
 *
 * `header` is that of the coat, `arrays` those of the container, `atlas` holds the brushes, `noise` is the
 * texture of `newNoise`, `programs` are those of the painter.
 */
class CoatPainter {
  constructor(gl, header, arrays, atlas, noise, programs) {
    Object.assign(this, { gl, header, atlas, count: header.count });
    this.isImage = header.kernel === "image";
    this._noise = noise;
    this._programs = programs;
    this._rotation = new Float32Array(9);
    this._eye = new Float64Array(3);
    this._head = new Float64Array(3);
    this._axis = new Float64Array(3);
    this._sorted = { count: -1, order: "", numSlabs: 0, eye: new Float64Array(3), axis: new Float64Array(3) };
    this._brushes = { replaced: undefined, rows: new Float32Array(4 * Math.max(1, header.numSigmas.length)) };
    const column = (name) => (header.arrays[name] === undefined ? null : arrays[header.arrays[name]]);
    this._setColumns(column);
    this._setStrokes(column);
    this._setSh(column("sh"));
    this._setLines(column("lines"));
    this._setOrder(this.columns.now.means, column("scales"));
    this.upload();
  }

  /** Upload `columns.now`, which others may have changed. */
  upload() {
    const { gl, count, _texels: texels, columns: { now } } = this;
    const stride = 4 * this._stride;
    for (let i = 0; i < count; i++) {
      const at = stride * i;
      for (let k = 0; k < 3; k++) {
        texels[at + k] = now.means[3 * i + k];
        texels[at + 8 + k] = now.scales[3 * i + k];
      }
      for (let k = 0; k < 4; k++) texels[at + 4 + k] = now.quats[4 * i + k];
      texels[at + 3] = now.opacities[i];
      if (now.normals) texels.set(now.normals.subarray(3 * i, 3 * i + 3), at + stride - 4);
    }
    const rows = texels.length / (4 * TEXTURE_WIDTH);
    gl.bindTexture(gl.TEXTURE_2D, this._strokes);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXTURE_WIDTH, rows, gl.RGBA, gl.FLOAT, texels);
    if (this.header.motion) this._uploadColors();
    this._sorted.count = -1;
  }

  /** Whether every stroke is drawn a second time behind itself. */
  get hasUnderpaint() {
    return this.header.underpaint !== null && this.isImage;
  }

  /** How many strokes the share of them is. */
  countOf(share) {
    return Math.min(this.count, Math.ceil(share * this.count));
  }

  /**
   * Draw strokes that are not behind the camera into the bound framebuffer, over what is in it.
   *
   * Color 0 gets premultiplied color and alpha; of a glaze, it is multiplied by its tint and 1 - alpha.
   * Color 1, with `detail`, gets (height alpha, depth alpha, 0, alpha). The viewport is set by the caller.
   *
   * @param {PageCamera} camera centers and covariances; the picture has its size
   * @param {PageCamera} head its eye gives order, colors and directions
   * @param {object} options `order` "distance" or "depth"; `share` of the strokes; `brush` in place of those
   *     of the coat, an index into the brushes of the header, or null; `isBare`, without the border of the
   *     coat; `part` "strokes" or "underpaint" of slab `slab` of `numSlabs`, null for all in one order; `step`,
   *     pixels of the picture along one of the framebuffer, and `span` along its sides, for underpaint; `x` and
   *     `y` of the picture in the framebuffer; `detail`; `below` and `belowDetail`, the
   *     textures of the canvas below, for coats with a tolerance, or null; `members`, a texture of 0 to 1 by
   *     stroke: then alphas of what is a member and of what is not take the place of colors, see highlight.js
   */
  draw(camera, head, options) {
    const { order, share, brush, isBare = false, x = 0, y = 0 } = options;
    const { detail = false, below = null, belowDetail = null, members = null } = options;
    const { part = null, slab = 0, numSlabs = 0, step = 1, span = [camera.width, camera.height] } = options;
    const count = this.countOf(share);
    if (count === 0) return;
    const { gl } = this;
    this._sort(count, head, order, numSlabs);
    this._place(camera, head, brush);
    const isTested = this.header.tolerance !== null && below !== null;
    const program = this._program("stroke.vert", "stroke.frag", [
      ...(isTested ? ["TESTED"] : []),
      ...(detail ? ["DETAIL"] : []),
      ...(members ? ["MASK"] : []),
      ...(part === null ? [] : [part === "strokes" ? "APART" : "UNDERPAINT"]),
    ]);
    const { at } = program;
    gl.useProgram(program.handle);
    this._setView(at, camera, head, brush, isBare);
    gl.uniform2f(at.uOrigin, x, y);
    gl.uniform2fv(at.uSpan, span);
    gl.uniform1f(at.uStep, step);
    const { _strokes: strokes, _sh: sh, _noise: noise, atlas } = this;
    const { table, texture, tints } = atlas;
    this._bind([strokes, sh, table, texture, noise, below, belowDetail, members, tints, this._placed]);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    if (this.header.blend === "glaze" && !members) gl.blendFuncSeparate(gl.ZERO, gl.SRC_COLOR, gl.ZERO, gl.SRC_ALPHA);
    else gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this._vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, this._instances);
    const { numSeen, starts } = this._order, k = 2 * slab + (part === "strokes" ? 1 : 0);
    const [first, end] = part === null ? [0, numSeen] : [starts[k], starts[k + 1]];
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 4 * first);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, end - first);
    gl.bindVertexArray(null);
    gl.disable(gl.BLEND);
  }

  /**
   * The boxes of all strokes: rows of center x and y, half extents along and across, angle, depth, opacity,
   * 1 where it is seen, red, green, blue, 0. Pixels and radians.
   *
   * @returns {Float32Array} [count, 12]
   */
  boxes(camera, head, brush = null) {
    this._place(camera, head, brush);
    const result = this._numbers(camera, head, brush, []);
    for (let row = 0; row < result.length; row += BOX_NUMBERS) {
      result[row + 4] = Math.atan2(result[row + 11], result[row + 4]);
      result[row + 11] = 0;
    }
    return result;
  }

  /** Place lines in a view, see lines.js. */
  _place(camera, head, brush) {
    if (!this._lines) return;
    const { gl, _spots: spots } = this;
    this._lines.place(this._numbers(camera, head, brush, ["SHARES"]), camera.width, camera.height, spots);
    gl.bindTexture(gl.TEXTURE_2D, this._placed);
    const rows = spots.length / (4 * TEXTURE_WIDTH);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXTURE_WIDTH, rows, gl.RGBA, gl.FLOAT, spots);
  }

  /** What boxes.vert makes of all strokes. */
  _numbers(camera, head, brush, more) {
    const { gl, count } = this;
    const result = new Float32Array(BOX_NUMBERS * count);
    const program = this._program("boxes.vert", "empty.frag", more, ["oPlace", "oState", "oColor"]);
    const buffer = gl.createBuffer();
    gl.useProgram(program.handle);
    this._setView(program.at, camera, head, brush, false);
    this._bind([this._strokes, this._sh, null, null, null, null, null, null, null, this._placed]);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, result.byteLength, gl.STREAM_READ);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, count);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, result);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.deleteBuffer(buffer);
    return result;
  }

  dispose() {
    const { gl } = this;
    for (const texture of [this._strokes, this._sh, this._placed]) gl.deleteTexture(texture);
    gl.deleteBuffer(this._instances);
    gl.deleteVertexArray(this._vertices);
  }

  /** What moves, as it was made (`base`) and as it is (`now`): the same arrays where nothing moves. */
  _setColumns(column) {
    const halves = (name) => column(name) && floatsOfHalves(column(name));
    const base = {
      means: column("means"), quats: column("quats"), scales: column("scales"), opacities: halves("opacities"),
      normals: halves("normals"), colors: null,
    };
    this.columns = { base, now: base };
    if (!this.header.motion) return;
    this._terms = (this.header.shDegree + 1) ** 2;
    this._shNow = floatsOfHalves(column("sh"));
    base.colors = new Float32Array(3 * this.count); // added to the colors of the strokes
    this._dc = base.colors.map((_, at) => this._shNow[3 * this._terms * Math.floor(at / 3) + (at % 3)]);
    const copies = Object.entries(base).map(([name, values]) => [name, values && values.slice()]);
    this.columns.now = Object.fromEntries(copies);
  }

  _uploadColors() {
    const { gl, count, _shNow: sh, _terms: terms, _dc: dc, columns: { now } } = this;
    for (let i = 0; i < count; i++) {
      for (let k = 0; k < 3; k++) sh[3 * terms * i + k] = dc[3 * i + k] + now.colors[3 * i + k] / SH_C0;
    }
    const texels = count * terms, rows = Math.max(1, Math.ceil(texels / TEXTURE_WIDTH));
    this._shTexels ??= new Float32Array(3 * TEXTURE_WIDTH * rows);
    this._shTexels.set(sh);
    gl.bindTexture(gl.TEXTURE_2D, this._sh);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXTURE_WIDTH, rows, gl.RGB, gl.FLOAT, this._shTexels);
  }

  /** RGBA32F: see project.glsl. */
  _setStrokes(column) {
    const { gl, count, header } = this;
    const [brushes, starts] = ["brush", "streakStart"].map(column);
    const [relief, chance] = ["relief", "chance"].map((name) => column(name) && floatsOfHalves(column(name)));
    const { normals } = this.columns.base;
    const [gaps, marks] = [column("gaps"), column("marks") && floatsOfHalves(column("marks"))];
    const fields = column("fields") && quaternionsOfCodes(column("fields"));
    this._hasNormals = normals !== null;
    this._fieldAt = 3 + (relief || chance ? 1 : 0);
    this._stride = this._fieldAt + (fields ? 1 : 0) + (normals ? 1 : 0) + (gaps ? 2 : 0);
    const stride = 4 * this._stride;
    const rows = Math.max(1, Math.ceil((count * this._stride) / TEXTURE_WIDTH));
    const texels = new Float32Array(4 * TEXTURE_WIDTH * rows);
    for (let i = 0; i < count; i++) {
      const at = stride * i;
      texels[at + 11] = (brushes ? brushes[i] : 0) + 256 * (starts ? starts[i] : 0);
      if (relief) texels.set(relief.subarray(2 * i, 2 * i + 2), at + 12);
      if (chance) texels[at + 14] = chance[i];
      if (fields) texels.set(fields.subarray(4 * i, 4 * i + 4), at + 4 * this._fieldAt);
      if (gaps) {
        texels.set(gaps.subarray(3 * i, 3 * i + 3), at + stride - 8);
        texels[at + stride - 5] = marks[2 * i];
        texels[at + stride - 1] = marks[2 * i + 1]; // beside the normal, if there is one
      }
    }
    this._texels = texels;
    this._strokes = newTexture(gl, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXTURE_WIDTH, rows, 0, gl.RGBA, gl.FLOAT, null);
    this._numBrushes = Math.max(1, header.numSigmas.length);
  }

  _setLines(lines) {
    const { gl, count } = this;
    this._lines = lines && new Lines(lines);
    this._placed = lines && newTexture(gl, gl.NEAREST);
    if (!lines) return;
    const rows = Math.max(1, Math.ceil((2 * count) / TEXTURE_WIDTH));
    this._spots = new Float32Array(4 * TEXTURE_WIDTH * rows);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXTURE_WIDTH, rows, 0, gl.RGBA, gl.FLOAT, null);
  }

  _setSh(sh) {
    const { gl, count } = this;
    const texels = count * (this.header.shDegree + 1) ** 2;
    const rows = Math.max(1, Math.ceil(texels / TEXTURE_WIDTH));
    const padded = new sh.constructor(3 * TEXTURE_WIDTH * rows);
    padded.set(sh);
    this._sh = newTexture(gl, gl.NEAREST);
    const [format, type] = sh instanceof Float32Array ? [gl.RGB32F, gl.FLOAT] : [gl.RGB16F, gl.HALF_FLOAT];
    gl.texImage2D(gl.TEXTURE_2D, 0, format, TEXTURE_WIDTH, rows, 0, gl.RGB, type, padded);
  }

  _setOrder(means, scales) {
    const { gl, count } = this;
    let setbacks = null;
    if (this.hasUnderpaint) {
      setbacks = new Float32Array(count);
      for (let i = 0; i < count; i++) {
        const a = scales[3 * i], b = scales[3 * i + 1], c = scales[3 * i + 2];
        const middle = Math.max(Math.min(a, b), Math.min(Math.max(a, b), c));
        setbacks[i] = Math.sqrt(Math.max(a, b, c)) * Math.sqrt(middle);
      }
    }
    this._order = new StrokeOrder(means, setbacks);
    this._vertices = gl.createVertexArray();
    this._instances = gl.createBuffer();
    gl.bindVertexArray(this._vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, this._instances);
    gl.bufferData(gl.ARRAY_BUFFER, this._order.ids.byteLength, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
  }

  /** Sort and upload, unless nothing changed that decides the order. */
  _sort(count, head, order, numSlabs) {
    const { gl, _sorted: last, _axis: axis } = this;
    const eye = head.eye(this._eye);
    const isByDepth = order === "depth";
    for (let k = 0; k < 3; k++) axis[k] = isByDepth ? head.viewmat[8 + k] : 0;
    const isSame = last.count === count && last.order === order && last.numSlabs === numSlabs;
    if (isSame && isSame3(last.eye, eye) && isSame3(last.axis, axis)) return;
    Object.assign(last, { count, order, numSlabs });
    last.eye.set(eye);
    last.axis.set(axis);
    const sorted = this._order.sort(count, eye, isByDepth ? axis : null);
    const ids = numSlabs ? this._order.part(numSlabs) : sorted;
    gl.bindBuffer(gl.ARRAY_BUFFER, this._instances);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, ids, 0, count * this._order.layers);
  }

  _program(vertex, fragment, more, outputs) {
    const { header } = this;
    const isImage = this.isImage && !more.includes("UNDERPAINT");
    const has = {
      ANCHORED: header.lock !== "off",
      FADES: header.fade,
      ANTIALIASED: header.antialiased,
      BORDER: header.border > 0,
      FACING: this._hasNormals,
      ONE_SIDED: header.isOneSided,
      FLAT: header.isFlat,
      NESTED: header.nested !== null,
      DOTS: header.nested === "dots",
      PLACED: header.nested === "lines" && !more.includes("SHARES"),
      PLAIN: header.plainBrush !== undefined,
      IMAGE: isImage,
      GAUSSIAN: header.kernel === "gaussian" || more.includes("UNDERPAINT"),
      STREAKS: header.streaks > 0 && isImage,
      RELIEF: header.relief !== null,
      GLAZE: header.blend === "glaze",
      TINTS: isImage && this.atlas.hasTints && header.blend !== "glaze",
    };
    const defines = [
      `SH_DEGREE ${header.shDegree}`,
      `NUM_BRUSHES ${this._numBrushes}`,
      `STRIDE ${this._stride}`,
      ...(header.lock === "canonical" ? [`FIELD ${this._fieldAt}`] : []),
      ...Object.keys(has).filter((name) => has[name]),
      ...more,
    ];
    return this._programs.get(vertex, fragment, defines, TEXTURES, outputs);
  }

  /** The uniforms of a view. */
  _setView(at, camera, head, brush, isBare) {
    const { gl, header } = this;
    const m = camera.viewmat;
    for (let row = 0; row < 3; row++) {
      for (let column = 0; column < 3; column++) this._rotation[3 * row + column] = m[4 * row + column];
    }
    gl.uniformMatrix3fv(at.uRotation, true, this._rotation);
    gl.uniform3fv(at.uEye, camera.eye(this._eye));
    gl.uniform3fv(at.uHead, head.eye(this._head));
    gl.uniform4f(at.uLens, camera.fx, camera.fy, camera.cx, camera.cy);
    gl.uniform2f(at.uSize, camera.width, camera.height);
    gl.uniform1f(at.uNear, camera.near);
    gl.uniform1f(at.uLowPass, header.lowPass / camera.step ** 2);
    gl.uniform1f(at.uBorder, isBare ? 0 : header.border);
    gl.uniform4fv(at.uBrushes, this._brushRows(brush));
    gl.uniform1i(at.uHasUnderpaint, this.hasUnderpaint ? 1 : 0);
    gl.uniform1f(at.uUnderpaintOpacity, this.hasUnderpaint ? header.underpaint.opacity : 0);
    gl.uniform1f(at.uCanvasScale, Math.sqrt((camera.width * camera.height) / 750000));
    gl.uniform1f(at.uMiddle, m[11]);
    gl.uniform1f(at.uTolerance, header.tolerance ?? 0);
    gl.uniform1f(at.uStreaks, header.streaks);
    gl.uniform2fv(at.uAtlasSize, this.atlas.size);
  }

  /** By brush of the coat: deviations in half a box, reach of the underpaint, row of the atlas, whether plain. */
  _brushRows(replaced) {
    const { header, atlas } = this;
    const rows = this._brushes.rows;
    if (this._brushes.replaced === replaced) return rows;
    this._brushes.replaced = replaced;
    header.numSigmas.forEach((sigmas, i) => {
      const own = this.isImage ? header.brushes[i] : 0;
      const isPlain = i === header.plainBrush;
      const drawn = this.isImage && replaced !== null && !isPlain ? replaced : own;
      const [long, usual] = [drawn, own].map((row) => fittedSigmas(atlas.meanCoverages[row]));
      const longer = drawn === own ? 1 : long / usual;
      const reach = this.hasUnderpaint ? header.underpaint.reach[i] / longer : 0;
      rows.set([sigmas * longer, reach, drawn, isPlain ? 1 : 0], 4 * i);
      if (this.isImage) atlas.need(drawn);
    });
    return rows;
  }

  _bind(textures) {
    const { gl } = this;
    for (let unit = 0; unit < textures.length; unit++) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, textures[unit]);
    }
    gl.activeTexture(gl.TEXTURE0);
  }
}

const isSame3 = (a, b) => a[0] === b[0] && a[1] === b[1] && a[2] === b[2];

/** Half length of a box, in standard deviations, for about as much paint as the Gaussian has; of the mean coverage. */
function fittedSigmas(mean) {
  return mean === 0 ? IMAGE_SIGMAS : Math.min(IMAGE_SIGMAS, FITTED_REACH * Math.sqrt(Math.PI / (2 * mean)));
}

/** The noise of bristles, repeated: see rendering/streaks.py `noise`. */
function newNoise(gl) {
  const noise = Uint8Array.from(SHARED.STREAK_NOISE.flat());
  const texture = newTexture(gl, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.REPEAT);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG8, SHARED.STREAK_PERIOD, 1, 0, gl.RG, gl.UNSIGNED_BYTE, noise);
  return texture;
}
