// Filters of planes of numbers, for effects: those of scipy.ndimage that the exact renderer uses.
//
// A plane is a Float32Array of `width * height` numbers; beyond its border it goes on as at the border, or mirrored
// where a function says so.

/** The numbers of a function of the places of a plane, or of a mask: `from` is many times as slow. */
function filled(plane, numberAt) {
  for (let i = 0; i < plane.length; i++) plane[i] = numberAt(i);
  return plane;
}

/** The mean over a square window of an odd side. */
function boxMean(plane, width, height, side, result = new Float32Array(plane.length)) {
  const reach = (side - 1) / 2, rows = new Float32Array(plane.length);
  for (let y = 0; y < height; y++) {
    const at = y * width, last = at + width - 1;
    let sum = 0;
    for (let k = -reach; k <= reach; k++) sum += plane[at + Math.min(Math.max(k, 0), width - 1)];
    for (let x = 0; x < width; x++) {
      rows[at + x] = sum / side;
      sum += plane[Math.min(at + x + reach + 1, last)] - plane[Math.max(at + x - reach, at)];
    }
  }
  const sums = new Float64Array(width);
  for (let k = -reach; k <= reach; k++) {
    const from = Math.min(Math.max(k, 0), height - 1) * width;
    for (let x = 0; x < width; x++) sums[x] += rows[from + x];
  }
  for (let y = 0; y < height; y++) {
    const at = y * width, next = Math.min(y + reach + 1, height - 1) * width, first = Math.max(y - reach, 0) * width;
    for (let x = 0; x < width; x++) {
      result[at + x] = sums[x] / side;
      sums[x] += rows[next + x] - rows[first + x];
    }
  }
  return result;
}

/** The largest number in a square window of an odd side. */
function largestNear(plane, width, height, side) {
  const reach = (side - 1) / 2, along = new Float32Array(plane.length), result = new Float32Array(plane.length);
  for (let y = 0; y < height; y++) {
    for (let x = 0, at = y * width; x < width; x++, at++) {
      const first = at - Math.min(reach, x), last = at + Math.min(reach, width - 1 - x);
      let largest = plane[first];
      for (let k = first + 1; k <= last; k++) if (plane[k] > largest) largest = plane[k];
      along[at] = largest;
    }
  }
  for (let y = 0; y < height; y++) {
    const at = y * width, first = Math.max(y - reach, 0), last = Math.min(y + reach, height - 1);
    result.set(along.subarray(first * width, (first + 1) * width), at);
    for (let row = first + 1; row <= last; row++) {
      const from = row * width;
      for (let x = 0; x < width; x++) if (along[from + x] > result[at + x]) result[at + x] = along[from + x];
    }
  }
  return result;
}

/** A Gaussian blur that ends after some deviations; `beyond` is the place that stands for one beyond the border. */
function gaussianBlur(plane, width, height, deviation, { deviations = 3, beyond = mirrored } = {}) {
  const reach = Math.floor(deviations * deviation + 0.5), weights = new Float64Array(2 * reach + 1);
  for (let k = -reach; k <= reach; k++) weights[k + reach] = Math.exp(-0.5 * (k / deviation) ** 2);
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  for (let k = 0; k < weights.length; k++) weights[k] /= total;
  const along = new Float32Array(plane.length), result = new Float32Array(plane.length);
  const sums = new Float64Array(width);
  for (let y = 0; y < height; y++) addShifted(plane, y * width, width, weights, beyond, along);
  for (let y = 0; y < height; y++) {
    sums.fill(0);
    for (let k = -reach; k <= reach; k++) {
      const from = beyond(y + k, height) * width, weight = weights[k + reach];
      for (let x = 0; x < width; x++) sums[x] += weight * along[from + x];
    }
    result.set(sums, y * width);
  }
  return result;
}

function addShifted(plane, at, width, weights, beyond, result) {
  const reach = (weights.length - 1) / 2;
  for (let x = 0; x < width; x++) {
    let sum = 0;
    if (x >= reach && x + reach < width) {
      for (let k = -reach; k <= reach; k++) sum += weights[k + reach] * plane[at + x + k];
    } else {
      for (let k = -reach; k <= reach; k++) sum += weights[k + reach] * plane[at + beyond(x + k, width)];
    }
    result[at + x] = sum;
  }
}

/** The place of a row beyond the border: the border goes on. */
const nearestPlace = (place, size) => Math.min(Math.max(place, 0), size - 1);

/** The place of a row beyond the border: the border is mirrored between its pixel and the next one. */
function mirrored(place, size) {
  const period = 2 * size, within = ((place % period) + period) % period;
  return within < size ? within : period - 1 - within;
}

/**
 * The regions of a mask: pixels that are joined along their sides.
 *
 * @param {Uint8Array} mask 1 or 0
 * @returns {{labels: Int32Array, areas: Float64Array}} labels from 1, 0 outside; pixels of each label
 */
function regionsOf(mask, width, height) {
  const labels = new Int32Array(mask.length), parents = [0];
  const root = (label) => {
    while (parents[label] !== label) label = parents[label] = parents[parents[label]];
    return label;
  };
  for (let y = 0, at = 0; y < height; y++) {
    for (let x = 0; x < width; x++, at++) {
      if (!mask[at]) continue;
      const left = x > 0 ? labels[at - 1] : 0, above = y > 0 ? labels[at - width] : 0;
      if (!left && !above) parents.push(labels[at] = parents.length);
      else if (!left || !above) labels[at] = left || above;
      else {
        const one = root(left), other = root(above);
        labels[at] = Math.min(one, other);
        parents[Math.max(one, other)] = labels[at];
      }
    }
  }
  const areas = new Float64Array(parents.length);
  for (let at = 0; at < labels.length; at++) if (labels[at]) areas[labels[at] = root(labels[at])]++;
  return { labels, areas };
}
