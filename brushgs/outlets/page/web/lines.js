// Lines of hatching, shortened as a whole: rendering/nested.py `_shortened` says why, and has the names. A vertex
// shader sees one piece of a line, so that boxes are read back, placed here, and uploaded.

const { SHORT, LONG, THINNEST } = SHARED;
const PLACED_NUMBERS = 8; // a stroke: center, half extents; share of its opacity, 0, 0, 0

class Lines {
  /**
   * @param {Uint32Array} lines [n, 3] by stroke: its line, its place among all pieces, and how many its line has
   */
  constructor(lines) {
    this._lines = lines;
    this._order = Uint32Array.from({ length: lines.length / 3 }, (_, row) => row);
    this._order.sort((a, b) => lines[3 * a + 1] - lines[3 * b + 1]);
    this._pieces = [];
  }

  /**
   * Where a view shows what is left of each stroke.
   *
   * @param {Float32Array} boxes [n, 12] see boxes.vert, with SHARES
   * @param {Float32Array} placed [n, 8] is overwritten
   */
  place(boxes, width, height, placed) {
    const { _lines: lines, _order: order, _pieces: pieces } = this;
    const scale = Math.sqrt((width * height) / SHARED.NESTED_PIXELS);
    placed.fill(0);
    for (let at = 0; at < order.length; ) {
      const line = lines[3 * order[at]];
      pieces.length = 0;
      for (; at < order.length && lines[3 * order[at]] === line; at++) {
        if (boxes[BOX_NUMBERS * order[at] + 7] === 1) pieces.push(order[at]);
      }
      if (pieces.length) shorten(boxes, pieces, lines[3 * pieces[0] + 2], scale, placed);
    }
  }
}

/** Place the seen pieces of one line, which has `numPieces`. */
function shorten(boxes, pieces, numPieces, scale, placed) {
  let total = 0, left = 0, widest = 0;
  for (const row of pieces) {
    const at = BOX_NUMBERS * row, length = 2 * boxes[at + 2];
    total += length;
    left += length * boxes[at + 8];
    widest = Math.max(widest, boxes[at + 9]);
  }
  const paper = ((left / scale) * numPieces) / pieces.length;
  const opaque = Math.min(widest / THINNEST, 1) * smoothed((paper - SHORT) / (LONG - SHORT));
  const cut = 0.5 * (total - left);
  let start = 0;
  pieces.forEach((row, i) => {
    const at = BOX_NUMBERS * row, half = boxes[at + 2], axis = [boxes[at + 4], boxes[at + 11]];
    const begin = Math.max(start, cut), end = Math.min(start + 2 * half, total - cut);
    if (end > begin) {
      const before = BOX_NUMBERS * pieces[Math.max(i - 1, 0)];
      const after = BOX_NUMBERS * pieces[Math.min(i + 1, pieces.length - 1)];
      const way = (boxes[after] - boxes[before]) * axis[0] + (boxes[after + 1] - boxes[before + 1]) * axis[1];
      const shift = (way < 0 ? -1 : 1) * (0.5 * (begin + end) - start - half);
      const center = [boxes[at] + shift * axis[0], boxes[at + 1] + shift * axis[1]];
      placed.set([...center, 0.5 * (end - begin), Math.max(boxes[at + 9], THINNEST), opaque], PLACED_NUMBERS * row);
    }
    start += 2 * half;
  });
}
