// Small linear algebra in float64: matrices are arrays of rows, quaternions w, x, y, z.

/** The product of two 3x3 matrices of rows. */
function multiply3(a, b) {
  const product = new Float64Array(9);
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) {
      let sum = 0;
      for (let k = 0; k < 3; k++) sum += a[3 * row + k] * b[3 * k + column];
      product[3 * row + column] = sum;
    }
  }
  return product;
}

/** The product of two 4x4 matrices of rows. */
function multiply4(a, b) {
  const product = new Float64Array(16);
  for (let row = 0; row < 4; row++) {
    for (let column = 0; column < 4; column++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * row + k] * b[4 * k + column];
      product[4 * row + column] = sum;
    }
  }
  return product;
}

/** The 3x3 rotation of a unit quaternion. */
function rotationOfQuaternion([w, x, y, z]) {
  return new Float64Array([
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ]);
}

/** [4 n] unit quaternions of codes [3 n], or 0, 0, 0, 0 where there is none: see outlets/page/fields.py. */
function quaternionsOfCodes(codes) {
  const levels = SHARED.FIELD_LEVELS, quaternions = new Float32Array((4 * codes.length) / 3);
  for (let from = 0, to = 0; from < codes.length; from += 3, to += 4) {
    if (!codes[from] && !codes[from + 1] && !codes[from + 2]) continue;
    const omitted = Math.floor(codes[from] / (levels + 1));
    let left = 1;
    for (let k = 0; k < 3; k++) {
      const component = (((codes[from + k] & levels) / levels) * 2 - 1) * Math.SQRT1_2;
      quaternions[to + k + (k >= omitted ? 1 : 0)] = component;
      left -= component * component;
    }
    quaternions[to + omitted] = Math.sqrt(Math.max(left, 0));
  }
  return quaternions;
}

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross3 = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const subtract3 = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const length3 = (a) => Math.hypot(a[0], a[1], a[2]);

/** A vector of length 1 in the direction of `a`, which is not 0. */
function normalized3(a) {
  const length = length3(a);
  return [a[0] / length, a[1] / length, a[2] / length];
}
