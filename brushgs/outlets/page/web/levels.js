// A brush filtered in advance for small boxes, axis by axis: brushes/levels.py says what, why and with what
// error; names and numbers are the same. Filtering is split in two here, so that it takes little time: sums
// of a few source texels, then a tridiagonal solution, not the product of both matrices.

const { FIRST_FOOTPRINT, LEVELS_PER_OCTAVE, TEXELS_PER_PIXEL, MARGIN_PIXELS, SHORTEST_BOX } = SHARED;
const QUADRATURE = 4;
const FAINT_PAINT = 2;

/**
 * The levels of an axis of so many source texels, finest first.
 *
 * @returns {{numTexels: number, scale: number, footprint: number, largestBox: number}[]}
 */
function axisLevels(numSource) {
  const levels = [{ numTexels: numSource, scale: 1, footprint: 0, largestBox: Infinity }];
  let smallest = FIRST_FOOTPRINT;
  while (numSource > 1 && smallest <= (numSource - 1) / SHORTEST_BOX) {
    const footprint = smallest * 2 ** (0.5 / LEVELS_PER_OCTAVE);
    const steps = Math.min(numSource - 1, Math.ceil((TEXELS_PER_PIXEL * (numSource - 1)) / smallest));
    const margin = Math.ceil((MARGIN_PIXELS * footprint * steps) / (numSource - 1));
    levels.push({
      numTexels: steps + 1 + 2 * margin,
      scale: 1 + (2 * margin) / steps,
      footprint,
      largestBox: (numSource - 1) / (2 * smallest),
    });
    smallest *= 2 ** (1 / LEVELS_PER_OCTAVE);
  }
  return levels;
}

/** Filters the rows of images for one level of an axis that has as many source texels as they have rows. */
class AxisFilter {
  constructor(numSource, level) {
    const axis = axisLevels(numSource)[level];
    this.numTexels = axis.numTexels;
    this._setMoments(numSource, axis);
    this._setSolution();
  }

  /** Sparse rows: texel i of the level has the weights from start[i] to start[i + 1]. */
  _setMoments(numSource, { numTexels, scale, footprint }) {
    const spacing = ((numSource - 1) * scale) / (numTexels - 1);
    const starts = new Int32Array(numTexels + 1);
    const columns = [], weights = [];
    const row = new Float64Array(numSource);
    const reach = Math.ceil(footprint / 2) + 1;
    for (let i = 0; i < numTexels; i++) {
      const center = (i - (numTexels - 1) / 2) * spacing + (numSource - 1) / 2;
      let first = numSource, last = -1;
      for (let step = -QUADRATURE; step < QUADRATURE; step++) {
        const offset = (step + 0.5) / QUADRATURE;
        if (offset < 0 ? i === 0 : i === numTexels - 1) continue; // half a hat: nothing is drawn beyond
        const share = (1 - Math.abs(offset)) / QUADRATURE / footprint;
        const place = center + offset * spacing;
        const low = Math.min(Math.max(place - footprint / 2, 0), numSource - 1);
        const high = Math.min(Math.max(place + footprint / 2, 0), numSource - 1);
        const middle = Math.round(place);
        const end = Math.min(middle + reach, numSource - 1);
        for (let column = Math.max(middle - reach, 0); column <= end; column++) {
          row[column] += share * (hatIntegral(high - column) - hatIntegral(low - column));
          if (column < first) first = column;
          if (column > last) last = column;
        }
      }
      for (let column = first; column <= last; column++) {
        if (row[column] !== 0) {
          columns.push(column);
          weights.push(row[column]);
          row[column] = 0;
        }
      }
      starts[i + 1] = columns.length;
    }
    this._starts = starts;
    this._columns = Int32Array.from(columns);
    this._weights = Float64Array.from(weights);
  }

  /** The Gram matrix of hat functions, eliminated: 2/3, 1/3 at both ends, and 1/6 between neighbors. */
  _setSolution() {
    const n = this.numTexels;
    this._diagonal = new Float64Array(n).fill(2 / 3);
    this._diagonal[0] = this._diagonal[n - 1] = 1 / 3;
    this._factors = new Float64Array(n);
    for (let row = 1; row < n; row++) {
      this._factors[row] = 1 / 6 / this._diagonal[row - 1];
      this._diagonal[row] -= this._factors[row] / 6;
    }
  }

  /** Float32Array [numTexels, width] of a source [numSource, width]. */
  rows(source, width) {
    const n = this.numTexels;
    const result = new Float32Array(n * width);
    const { _starts: starts, _columns: columns, _weights: weights } = this;
    for (let i = 0; i < n; i++) {
      const to = i * width, end = starts[i + 1];
      let k = starts[i];
      for (; k + 4 <= end; k += 4) { // four at once take half the time: sums stay in registers
        const a = columns[k] * width, b = columns[k + 1] * width;
        const c = columns[k + 2] * width, d = columns[k + 3] * width;
        const p = weights[k], q = weights[k + 1], r = weights[k + 2], s = weights[k + 3];
        for (let x = 0; x < width; x++) {
          result[to + x] += p * source[a + x] + q * source[b + x] + r * source[c + x] + s * source[d + x];
        }
      }
      for (; k < end; k++) {
        const from = columns[k] * width, weight = weights[k];
        for (let x = 0; x < width; x++) result[to + x] += weight * source[from + x];
      }
    }
    for (let i = 1; i < n; i++) {
      const to = i * width, factor = this._factors[i];
      for (let x = 0; x < width; x++) result[to + x] -= factor * result[to - width + x];
    }
    for (let i = n - 1; i >= 0; i--) {
      const to = i * width, inverse = 1 / this._diagonal[i];
      const beside = i === n - 1 ? 0 : inverse / 6, next = i === n - 1 ? to : to + width;
      for (let x = 0; x < width; x++) result[to + x] = inverse * result[to + x] - beside * result[next + x];
    }
    return result;
  }
}

/** The integral of a hat function over -1 to 1, from the left up to x. */
function hatIntegral(x) {
  const inside = Math.min(Math.max(x, -1), 1);
  return 0.5 + inside - 0.5 * inside * Math.abs(inside);
}

/**
 * Makes the levels of one brush.
 *
 * `coverage` and `height` are Uint8Array [rows, columns]; where an image has no height, it is its coverage.
 * Without `height` levels are of the coverage alone. `tint`, Uint8Array [rows, columns, 3], gives them colors.
 */
class BrushLevels {
  constructor({ rows, columns, coverage, height = null, tint = null }) {
    Object.assign(this, { rows, columns });
    this._numTexels = height ? 2 : 1;
    this.u = axisLevels(columns);
    this.v = axisLevels(rows);
    this._filtersOfV = new Map();
    this._source = interleaved(height ? [coverage, height] : [coverage]);
    this._layers = [transposed(coverage, rows, columns)]; // [columns, rows]
    const weigh = (numbers) => {
      const raised = Float32Array.from(coverage, (paint, i) => (numbers(i) - 127.5) * paint);
      this._layers.push(transposed(raised, rows, columns));
    };
    if (height) weigh((i) => height[i]);
    if (tint) for (let c = 0; c < 3; c++) weigh((i) => tint[3 * i + c]);
    this._hasTint = tint !== null;
    this._sourceTints = tint;
  }

  /**
   * The texels of some levels along v of one along u.
   *
   * @param {number} levelU
   * @param {number[]} levelsV
   * @yields {{levelV: number, columns: number, rows: number, texels: Uint8Array, tints: Uint8Array|null}}
   *     [rows, columns, 2 or 1]: coverage and height; [rows, columns, 3]: what is added to a color
   */
  *alongV(levelU, levelsV) {
    const across = levelU === 0 ? null : new AxisFilter(this.columns, levelU);
    const columns = this.u[levelU].numTexels;
    const layers = this._layers.map((layer) =>
      transposed(across ? across.rows(layer, this.rows) : layer, columns, this.rows),
    );
    for (const levelV of levelsV) {
      const down = this._filterOfV(levelV);
      const isSource = levelU === 0 && levelV === 0;
      const filtered = layers.map((layer) => (down ? down.rows(layer, columns) : layer));
      const num = this._numTexels;
      const texels = isSource ? this._source : rounded(filtered.slice(0, num));
      const tints = isSource || !this._hasTint ? this._sourceTints : meansOf(filtered[0], filtered.slice(num));
      yield { levelV, columns, rows: this.v[levelV].numTexels, texels, tints };
    }
  }

  _filterOfV(level) {
    if (level === 0) return null;
    if (!this._filtersOfV.has(level)) this._filtersOfV.set(level, new AxisFilter(this.rows, level));
    return this._filtersOfV.get(level);
  }
}

/** [columns, rows] of an array [rows, columns]. */
function transposed(array, rows, columns) {
  const result = new Float32Array(array.length);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      result[column * rows + row] = array[row * columns + column];
    }
  }
  return result;
}

/** Arrays of one length as one: the first numbers of all, then the second ones, and so on. */
function interleaved(arrays) {
  const all = new Uint8Array(arrays.length * arrays[0].length);
  arrays.forEach((array, k) => {
    for (let i = 0; i < array.length; i++) all[arrays.length * i + k] = array[i];
  });
  return all;
}

/** Coverage, and the height as its mean over the paint, 1/2 where there is none; in 8 bits. */
function rounded([paint, raised = null]) {
  if (raised === null) return new Uint8Array(new Uint8ClampedArray(paint).buffer);
  const texels = new Uint8ClampedArray(2 * paint.length); // rounds to the nearest even number, as NumPy does
  for (let i = 0; i < paint.length; i++) {
    texels[2 * i] = paint[i];
    texels[2 * i + 1] = 127.5 + raised[i] / Math.max(paint[i], FAINT_PAINT);
  }
  return new Uint8Array(texels.buffer);
}

/** Planes as means over the paint, 1/2 where there is none, interleaved; in 8 bits. */
function meansOf(paint, planes) {
  const texels = new Uint8ClampedArray(planes.length * paint.length);
  planes.forEach((plane, k) => {
    for (let i = 0; i < paint.length; i++) {
      texels[planes.length * i + k] = 127.5 + plane[i] / Math.max(paint[i], FAINT_PAINT);
    }
  });
  return new Uint8Array(texels.buffer);
}
