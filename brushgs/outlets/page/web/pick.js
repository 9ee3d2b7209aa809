// Which point of the scene lies under the pointer.

const FLATTEST = 1e-3; // of the longest axis: flat strokes are taken to be that thick
const SOLID = 0.5; // share of the light that is stopped where a surface is taken to be

/**
 * The point where a ray has lost half of its light, each stroke taken as a soft ellipsoid.
 *
 * Work grows with the number of strokes: some milliseconds for 50,000, for a click and not for each frame.
 *
 * @param {{header: object, arrays: object}} contents
 * @param {number[]} eye page coordinates
 * @param {number[]} direction unit vector
 * @param {object[]} posed columns of the coats at the moment shown, see `Painter.columns`; else those of the
 *     contents
 * @returns {?number[]} page coordinates; null where the ray meets too little paint
 */
function pointOnRay(contents, eye, direction, posed = []) {
  const hits = [];
  for (const [row, coat] of contents.header.coats.entries()) {
    const { means, quats, scales, opacities } = posed[row] ?? storedColumns(contents, coat);
    for (let i = 0; i < coat.count; i++) {
      const hit = hitOf(i, means, quats, scales, eye, direction);
      if (hit === null) continue;
      const alpha = opacities[i] * Math.exp(-0.5 * hit.squared);
      if (alpha > 1 / 255) hits.push({ along: hit.along, alpha: Math.min(alpha, 0.99) });
    }
  }
  hits.sort((a, b) => a.along - b.along);
  let light = 1;
  for (const { along, alpha } of hits) {
    light *= 1 - alpha;
    if (light <= 1 - SOLID) return eye.map((value, k) => value + along * direction[k]);
  }
  return null;
}

function storedColumns({ arrays }, coat) {
  const column = (name) => arrays[coat.arrays[name]];
  const [means, quats, scales] = ["means", "quats", "scales"].map(column);
  return { means, quats, scales, opacities: floatsOfHalves(column("opacities")) };
}

/** Where a ray comes nearest to stroke i, in deviations of the stroke; null if that is behind or far off. */
function hitOf(i, means, quats, scales, eye, direction) {
  const offset = [0, 1, 2].map((k) => eye[k] - means[3 * i + k]);
  const longest = Math.max(scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]);
  const ahead = -dot3(offset, direction);
  const squaredMiss = dot3(offset, offset) - ahead * ahead;
  if (!(longest > 0) || ahead <= 0 || squaredMiss > 9 * longest * longest) return null;
  const R = rotationOfQuaternion(quats.subarray(4 * i, 4 * i + 4));
  let oo = 0, od = 0, dd = 0;
  for (let axis = 0; axis < 3; axis++) {
    const size = Math.max(scales[3 * i + axis], FLATTEST * longest);
    const o = (R[axis] * offset[0] + R[3 + axis] * offset[1] + R[6 + axis] * offset[2]) / size;
    const d = (R[axis] * direction[0] + R[3 + axis] * direction[1] + R[6 + axis] * direction[2]) / size;
    oo += o * o;
    od += o * d;
    dd += d * d;
  }
  const along = -od / dd;
  return along > 0 ? { along, squared: Math.max(0, oo - (od * od) / dd) } : null;
}
