// Rubbed tones of charcoal in a picture at rest: rendering/rub.py says what is done and why, and has the names.
//
// They are made at half of the picture's pixels along a side. The tooth of the paper, which is finer, is left to
// rub.frag.

const { RUB_RISE, RUB_GATHERED, RUB_SOLID, RUB_BLURS, RUB_REACH, RUB_STEP, RUB_FINEST, ROOM_SOLID } = SHARED;

/**
 * The rubbed tones of a coat.
 *
 * @param {object} rub `paper` and `black`, RGB; `values`, shares of black, ascending; `strength`; `wave`, world units;
 *     `waves` [6][4], directions in radians a unit of page coordinates, and phases; `isRoom`
 * @param {object} picture of `paintSoftly`
 * @param {PageCamera} camera of that picture
 * @param {number} step pixels of the page along one of that picture
 * @returns {[Float32Array]} [height, width, 4]: tone, cover, amount of rubbing 0 to 1, and depth
 */
function makeRub(rub, picture, camera, step) {
  const { width, height, colors, depths } = rub.isRoom ? closedRoom(picture) : picture;
  const noise = rubNoise(rub, depths, camera, step), count = width * height;
  const { solid, toned } = massesOf(rub, colors, count), scale = canvasScale(width, height);
  for (const plane of [solid, toned]) {
    const [sharp, soft] = RUB_BLURS.map((wide) =>
      gaussianBlur(plane, width, height, wide * scale, { deviations: RUB_REACH, beyond: nearestPlace }));
    for (let i = 0; i < count; i++) plane[i] = sharp[i] + noise[i] * (soft[i] - sharp[i]);
  }
  const made = new Float32Array(4 * count);
  for (let i = 0; i < count; i++) {
    const covered = Math.min(solid[i], colors[4 * i + 3]);
    made[4 * i] = solid[i] > 0 ? (toned[i] * covered) / solid[i] : 0;
    made[4 * i + 1] = covered;
    made[4 * i + 2] = noise[i];
    made[4 * i + 3] = depths[i] || depthBeside(depths, i, width);
  }
  return [made];
}

/** The picture of a room without holes, which lie as far away as anything in it: `_closed`. */
function closedRoom({ width, height, colors, depths }) {
  const count = width * height, size = { width, height, count, diagonal: Math.hypot(width, height) };
  const filled = withoutHoles(colors, ROOM_SOLID, size), placed = depths.slice();
  let farthest = 0;
  for (let i = 0; i < count; i++) if (colors[4 * i + 3] > SHARED.SOLID_BELOW) farthest = Math.max(farthest, depths[i]);
  for (let i = 0; i < count; i++) {
    const solid = Math.min(ROOM_SOLID, 1 / Math.max(filled[4 * i + 3], 1e-30));
    for (let c = 0; c < 4; c++) filled[4 * i + c] *= solid;
    if (colors[4 * i + 3] <= SHARED.SOLID_BELOW) placed[i] = Math.max(placed[i], farthest);
  }
  return { width, height, colors: filled, depths: placed };
}

/** Cover and tone before rubbing: shares of black, drawn together towards the values. */
function massesOf({ paper, black, values }, colors, count) {
  const tint = black.map((one, k) => one - paper[k]), length = Math.max(dot3(tint, tint), 1e-12);
  const solid = new Float32Array(count), toned = new Float32Array(count), [none, whole] = RUB_SOLID;
  for (let i = 0; i < count; i++) {
    const alpha = colors[4 * i + 3];
    solid[i] = smoothed((alpha - none) / (whole - none));
    if (!(solid[i] > 0)) continue;
    const along = colors[4 * i] * tint[0] + colors[4 * i + 1] * tint[1] + colors[4 * i + 2] * tint[2];
    const share = (along / alpha - dot3(paper, tint)) / length;
    let gathered = values[0];
    for (let k = 1; k < values.length; k++) {
      const rise = values[k] - values[k - 1], middle = 0.5 * (values[k] + values[k - 1]);
      if (rise > 0) gathered += rise * smoothed((share - middle) / (RUB_RISE * rise) + 0.5);
    }
    toned[i] = solid[i] * (RUB_GATHERED * gathered + (1 - RUB_GATHERED) * share);
  }
  return { solid, toned };
}

/** How much each pixel is rubbed, 0 to 1: waves in space, at one pixel of each square of the page's pixels. */
function rubNoise({ strength, wave, waves }, depths, camera, step) {
  const { width, height, fx, fy, cx, cy, viewmat: m } = camera, result = new Float32Array(width * height);
  const side = Math.max(1, Math.round(RUB_STEP / step)), half = Math.floor(side / 2);
  const eye = camera.eye(new Float64Array(3)), [finest, whole] = RUB_FINEST;
  const sampled = (place, size) => {
    const last = Math.floor((size - 1 - half) / side); // the last square that has a middle
    return last < 0 ? null : side * Math.min(Math.floor(place / side), last) + half;
  };
  for (let y = 0; y < height; y += side) {
    for (let x = 0; x < width; x += side) {
      const column = sampled(x, width), row = sampled(y, height);
      if (column === null || row === null) return result;
      const depth = depths[row * width + column];
      const right = (depth * (column + 0.5 - cx)) / fx, down = (depth * (row + 0.5 - cy)) / fy;
      const point = [0, 1, 2].map((k) => m[k] * right + m[4 + k] * down + m[8 + k] * depth + eye[k]);
      let total = 0;
      for (const direction of waves) total += Math.sin(dot3(direction, point) + direction[3]);
      const pixels = (wave * fx * step) / Math.max(depth, 1e-30);
      total *= Math.min(1, Math.max(0, (pixels - finest) / (whole - finest)));
      const amount = strength * Math.min(1, Math.max(0, 0.5 + total / Math.sqrt(waves.length)));
      for (let b = y; b < Math.min(y + side, height); b++) result.fill(amount, b * width + x, b * width + Math.min(x + side, width));
    }
  }
  return result;
}
