// Noise in space at the points that pixels show: rendering/space_noise.py, and tests/rendering/wet_reference.py for its formulas.

const { NOISE_FINEST, NOISE_OCTAVES, NOISE_DEVIATION, NOISE_PERSISTENCE, NOISE_PRIMES: [PRIMES] } = SHARED;

/**
 * @param {Float32Array} depths [height, width] camera z, 0 where nothing is painted
 * @param {PageCamera} camera of the picture
 * @param {{center: number[], scale: number, focus: number[], reach: number, seed: number}} anchor page coordinates
 * @returns {{flow: Float32Array, slow: Float32Array, distances: Float32Array}} two noises of mean 0 and deviation 1,
 *     and the distance to the focus over its reach; 0 where nothing is painted
 */
function spaceNoise(depths, camera, anchor) {
  const { width, height, fx, fy, cx, cy, viewmat: m } = camera, { center, scale, focus, reach, seed } = anchor;
  const planes = [0, 1, 2].map(() => new Float32Array(depths.length)), [flow, slow, distances] = planes;
  const eye = camera.eye(new Float64Array(3)).map((x, k) => (x - center[k]) / scale);
  const target = focus.map((x, k) => (x - center[k]) / scale), far = reach / scale;
  const size = (NOISE_FINEST * Math.hypot(width, height)) / (Math.sqrt(fx * fy) * scale);
  const point = new Float64Array(3), last = NOISE_OCTAVES;
  for (let y = 0, at = 0; y < height; y++) {
    for (let x = 0; x < width; x++, at++) {
      const depth = depths[at];
      if (!(depth > 0)) continue;
      const right = (depth * (x + 0.5 - cx)) / fx / scale, down = (depth * (y + 0.5 - cy)) / fy / scale;
      for (let k = 0; k < 3; k++) point[k] = m[k] * right + m[4 + k] * down + (m[8 + k] * depth) / scale + eye[k];
      distances[at] = Math.hypot(point[0] - target[0], point[1] - target[1], point[2] - target[2]) / far;
      const level = Math.log2(size * depth), whole = Math.floor(level), t = level - whole;
      let ofFlow = 0, ofSlow = 0;
      for (let k = 0; k <= last + 1; k++) {
        const stream = hash32(seed + Math.imul(GOLDEN_32, whole + k)), finer = 2 ** -(whole + k);
        if (k <= last) {
          const weight = NOISE_PERSISTENCE ** -k * (k === 0 ? 1 - t : k === last ? t : 1);
          flow[at] += weight * octave(point, finer, stream);
          ofFlow += weight * weight;
        }
        if (k >= last - 1) {
          const weight = Math.max(1 - Math.abs(k - t - (last - 0.5)) / 1.5, 0);
          slow[at] += weight * octave(point, finer, ~stream);
          ofSlow += weight * weight;
        }
      }
      flow[at] /= Math.sqrt(ofFlow);
      slow[at] /= Math.sqrt(ofSlow);
    }
  }
  return { flow, slow, distances };
}

/** Gradient noise of cells of size 1 / finer, of deviation 1: Perlin 2002. */
function octave(point, finer, stream) {
  const X = point[0] * finer, Y = point[1] * finer, Z = point[2] * finer;
  const i = Math.floor(X), j = Math.floor(Y), k = Math.floor(Z), x = X - i, y = Y - j, z = Z - k;
  const u = x * x * x * (x * (x * 6 - 15) + 10), v = y * y * y * (y * (y * 6 - 15) + 10);
  const w = z * z * z * (z * (z * 6 - 15) + 10);
  const [px, py, pz] = PRIMES;
  let total = 0;
  for (let c = 0; c < 8; c++) {
    const a = c & 1, b = (c >> 1) & 1, d = c >> 2;
    const bits = stream ^ Math.imul(i + a, px) ^ Math.imul(j + b, py) ^ Math.imul(k + d, pz);
    const share = (a ? u : 1 - u) * (b ? v : 1 - v) * (d ? w : 1 - w);
    total += share * slope(hash32(bits) & 15, x - a, y - b, z - d);
  }
  return total / NOISE_DEVIATION;
}

function slope(h, x, y, z) {
  const u = h < 8 ? x : y, v = h < 4 ? y : h === 12 || h === 14 ? x : z;
  return (h & 1 ? -u : u) + (h & 2 ? -v : v);
}
