// All brushes of a painting, at all their levels, in one texture; and a table that says where each is.

const ATLAS_WIDTH = 4096;
// Levels 1 and 2, for boxes drawn at 0.85 to 1.7 texels a pixel, have as many texels as the source: without
// them an atlas takes 58 % of the memory. The source in their place is a little sharper on strokes longer
// than half the image: 1500 strokes at 640 x 480 are painted with 55 to 67 dB instead of 69 to 74. Without 1
// and 3 it is 53 to 61 dB, without 1, 3 and 5 it is 45 to 52. Small images, such as a pen's, keep all: without
// them long lines end within a pixel (skull in hatching: 45 dB, with them 69).
const LEFT_OUT = [1, 2];
const SMALL = 64; // texels along an axis
// Of many brushes the first picture has levels from here on, for boxes up to 53 pixels long where an image
// has 256 texels: half of the time.
const COARSE = 6;
const FEW = 3; // brushes that are filtered at once
const SLICE_MS = 8; // of filtering between frames
const MOST_LEFT_OUT = 12; // what is left then has 15 texels across
const MOST_BYTES = 64 << 20; // of the texture: 15 brushes with relief take 25 MB

/**
 * The texture unit pair that strokes sample.
 *
 * `texture`: coverage and height of every brush and level, RG8; R8 where no coat has relief.
 * `table`: RGBA32F, a row for each brush: one texel (columns, rows, levels along u, levels along v), then two
 * for each level u and v: (x, y, columns, rows) of its texels, and (scale u, scale v, tint step, 0).
 * `tints`: of colored brushes, RGB8 in the places of `texture`; one texel where no brush is colored.
 * A brush is filtered when `need` asks for it first. Where so many are given that an atlas would be too
 * large, the finest levels are left out, and large strokes are blurred. With `onSharper`, fine levels of many
 * brushes are made after the first picture, a little at a time; it is called when they are there.
 */
class Atlas {
  constructor(gl, header, arrays, onSharper = null) {
    this.gl = gl;
    this._isLater = onSharper !== null && header.brushes.length > FEW;
    this._onSharper = onSharper;
    this._fillings = []; // generators that go on filling
    this._timer = 0;
    this._sources = sourcesOf(header, arrays);
    this.meanCoverages = this._sources.map(({ coverage }) => mean(coverage) / 255);
    this._filled = this._sources.map(() => null); // by brush, keys of the levels that are there
    this._hasHeight = hasHeight(header);
    this._width = Math.min(ATLAS_WIDTH, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    this.hasTints = this._sources.some(({ tint }) => tint !== null);
    this._numBytesOfRow = ((this._hasHeight ? 2 : 1) + (this.hasTints ? 3 : 0)) * this._width;
    const highest = Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), MOST_BYTES / this._numBytesOfRow);
    this._finest = 0;
    for (this._place(); this.height > highest && this._finest < MOST_LEFT_OUT; this._place()) {
      this._finest = this._finest === 0 ? LEFT_OUT.length + 1 : this._finest + 1;
    }
    this.texture = newTexture(gl, gl.LINEAR);
    gl.texStorage2D(gl.TEXTURE_2D, 1, this._hasHeight ? gl.RG8 : gl.R8, this._width, this.height);
    this.tints = newTexture(gl, gl.LINEAR);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGB8, ...(this.hasTints ? this.size : [1, 1]));
    this._newTable();
  }

  /** Bytes of the texture. */
  get numBytes() {
    return this._numBytesOfRow * this.height;
  }

  get size() {
    return [this._width, this.height];
  }

  /** Whether it is also that of other contents: filtering takes longer than to compare. */
  serves(header, arrays) {
    const others = sourcesOf(header, arrays);
    return (
      hasHeight(header) === this._hasHeight &&
      others.length === this._sources.length &&
      this._sources.every((source, i) => isSameSource(source, others[i]))
    );
  }

  /** Make sure that a brush can be drawn with. */
  need(brush) {
    if (this._filled[brush] !== null) return;
    this._filled[brush] = new Set();
    const { height, ...flat } = this._sources[brush];
    const levels = new BrushLevels(this._hasHeight ? { height, ...flat } : flat);
    const coarse = Math.max(this._finest, COARSE);
    const filling = this._filling(brush, levels, this._isLater ? coarse : this._finest);
    while (!filling.next().done);
    if (!this._isLater || coarse === this._finest) return;
    this._fillings.push(this._filling(brush, levels, this._finest));
    this._timer ||= setTimeout(() => this._goOn(), 0);
  }

  /** Make the levels of a brush from the finest on that are not there, in steps of a few milliseconds. */
  *_filling(brush, levels, finest) {
    const [keptU, keptV] = [levels.u, levels.v].map((axis) => keptLevels(axis, finest));
    for (const levelU of keptU) {
      const missing = keptV.filter((levelV) => !this._filled[brush].has(`${levelU} ${levelV}`));
      if (missing.length === 0) continue;
      for (const level of levels.alongV(levelU, missing)) this._upload(brush, levelU, level);
      yield;
    }
    this._uploadRow(brush, levels, finest);
  }

  _upload(brush, levelU, { levelV, columns, rows, texels, tints }) {
    const { gl } = this;
    const key = `${levelU} ${levelV}`;
    const { x, y } = this._places[brush].get(key);
    const format = this._hasHeight ? gl.RG : gl.RED;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, columns, rows, format, gl.UNSIGNED_BYTE, texels);
    if (tints !== null) {
      gl.bindTexture(gl.TEXTURE_2D, this.tints);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, columns, rows, gl.RGB, gl.UNSIGNED_BYTE, tints);
    }
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    this._filled[brush].add(key);
  }

  _goOn() {
    this._timer = 0;
    if (!this.gl.isTexture(this.texture)) return; // the context was lost
    const end = performance.now() + SLICE_MS;
    while (this._fillings.length > 0 && performance.now() < end) {
      if (this._fillings[0].next().done) this._fillings.shift();
    }
    if (this._fillings.length > 0) this._timer = setTimeout(() => this._goOn(), 0);
    else this._onSharper();
  }

  dispose() {
    clearTimeout(this._timer);
    this.gl.deleteTexture(this.texture);
    this.gl.deleteTexture(this.tints);
    this.gl.deleteTexture(this.table);
  }

  /** Lay all rectangles in shelves, the highest first. */
  _place() {
    const rectangles = [];
    this._places = this._sources.map(() => new Map());
    this._sources.forEach(({ rows, columns }, brush) => {
      const [u, v] = [axisLevels(columns), axisLevels(rows)];
      for (const levelU of keptLevels(u, this._finest)) {
        for (const levelV of keptLevels(v, this._finest)) {
          const rectangle = { columns: u[levelU].numTexels, rows: v[levelV].numTexels, x: 0, y: 0 };
          rectangles.push(rectangle);
          this._places[brush].set(`${levelU} ${levelV}`, rectangle);
        }
      }
    });
    rectangles.sort((a, b) => b.rows - a.rows);
    let x = 0, y = 0, shelf = 0;
    for (const rectangle of rectangles) {
      if (x + rectangle.columns > this._width) {
        y += shelf;
        x = shelf = 0;
      }
      Object.assign(rectangle, { x, y });
      x += rectangle.columns;
      shelf = Math.max(shelf, rectangle.rows);
    }
    this.height = Math.max(1, y + shelf);
  }

  _newTable() {
    const { gl } = this;
    const numLevels = (numTexels) => axisLevels(numTexels).length;
    const sizes = this._sources.map(({ rows, columns }) => numLevels(columns) * numLevels(rows));
    const width = 1 + 2 * Math.max(0, ...sizes);
    this.table = newTexture(gl, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, Math.max(1, sizes.length));
  }

  /** Tell where the levels of a brush are, from the finest on that is there. */
  _uploadRow(brush, { u, v }, finest) {
    const { gl } = this;
    const row = [u[0].numTexels, v[0].numTexels, u.length, v.length];
    for (let levelU = 0; levelU < u.length; levelU++) {
      for (let levelV = 0; levelV < v.length; levelV++) {
        const [keptU, keptV] = [standIn(levelU, u, finest), standIn(levelV, v, finest)];
        const { x, y, columns, rows } = this._places[brush].get(`${keptU} ${keptV}`);
        row.push(x, y, columns, rows, u[keptU].scale, v[keptV].scale, this._sources[brush].tintStep, 0);
      }
    }
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    const texels = Float32Array.from(row);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, brush, row.length / 4, 1, gl.RGBA, gl.FLOAT, texels);
  }
}

/** The level of an axis that is drawn where this one is called for, and the finest is not level 0. */
function standIn(level, levels, finest) {
  const coarser = Math.min(Math.max(level, finest), levels.length - 1);
  return levels[0].numTexels > SMALL && LEFT_OUT.includes(coarser) ? 0 : coarser;
}

function keptLevels(levels, finest) {
  return levels.map((_, level) => level).filter((level) => standIn(level, levels, finest) === level);
}

function mean(array) {
  let sum = 0;
  for (let i = 0; i < array.length; i++) sum += array[i];
  return sum / array.length;
}

/** A bound 2D texture without levels, clamped at its edges. */
function newTexture(gl, filter) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}

function sourcesOf(header, arrays) {
  return header.brushes.map((brush) => ({
    rows: brush.rows,
    columns: brush.columns,
    coverage: arrays[brush.coverage],
    height: arrays[brush.height === null ? brush.coverage : brush.height],
    tint: brush.tint === null ? null : arrays[brush.tint],
    tintStep: brush.tintStep,
  }));
}

function hasHeight(header) {
  return header.coats.some((coat) => coat.relief !== null);
}

function isSameSource(one, other) {
  const isSame = (a, b) => a === b || (a?.length === b?.length && a.every((texel, i) => texel === b[i]));
  return (
    one.rows === other.rows && one.columns === other.columns &&
    isSame(one.coverage, other.coverage) && isSame(one.height, other.height) &&
    one.tintStep === other.tintStep && isSame(one.tint, other.tint)
  );
}
