// Washes of watercolour in a picture at rest: rendering/wet_layer.py says why, tests/rendering/wet_reference.py has the formulas.
//
// They are made at half of the picture's pixels along a side. The grain of the paper, which is finer, is left to
// wash.frag, so what comes out is what light meets but for the grain.

const { WET_ROUNDS, WET_SPILL, WET_RIM, WET_LOSS, LEAST_COLOR, LUMINANCE: [LUMA] } = SHARED;
const [SHADOW_EDGE, SHADOW_WANDER] = SHARED.SHADOW_RANGE, [SHADOW_SOFTNESS, SHADOW_LEAST] = SHARED.SHADOW_FADE;

/**
 * The washes of a coat.
 *
 * @param {object} effect `washes`, its numbers by name, and `anchor`; of a wet layer also `key`, `smoothing`, `isRoom`, `losing`
 * @param {object} picture of `paintSoftly`
 * @param {PageCamera} camera of that picture
 * @param {number[]} sheet [2], sides of the picture of the page in pixels of that picture
 * @returns {[Float32Array, Float32Array]} [height, width, 4] each: densities, and cover by paper; then by how much
 *     the tone is lighter than the least wash, over its range, thickness by which grain shows, strength, and depth
 */
function makeWashes(effect, { width, height, colors, depths }, camera, sheet) {
  const count = width * height, diagonal = Math.hypot(...sheet);
  const alpha = filled(new Float32Array(count), (i) => colors[4 * i + 3]);
  const noise = spaceNoise(depths, camera, effect.anchor);
  const size = { width, height, count, diagonal, sheet };
  const laid = effect.key ? wetLayer(effect, { ...size, depths }, colors, alpha, noise, camera) : shadowWash(size, colors, alpha, noise);
  return mixed(effect, size, laid, noise, depths);
}

/** Strength of the washes of a picture, 0 outside of its ragged border. */
function raggedBorder({ width, height, count, diagonal, sheet: [across, down] }) {
  const inside = filled(new Float32Array(count), (i) => {
    const x = (i % width) + 0.5, y = Math.floor(i / width) + 0.5;
    return Math.min(x, across - x, y, down - y) / diagonal;
  });
  const flat = { width, height, fx: diagonal, fy: diagonal, cx: across / 2, cy: down / 2, near: 0 };
  const camera = new PageCamera({ ...flat, viewmat: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] });
  const sheet = { center: [0, 0, 0], scale: 1, focus: [0, 0, 0], reach: 1, seed: 0 };
  const nearBorder = filled(new Float32Array(count), (i) => (inside[i] < 0.08 ? 1 : 0)); // all else is whole
  const { flow } = spaceNoise(nearBorder, camera, sheet);
  return filled(inside.slice(), (i) => smoothed((inside[i] - 0.025 - 0.007 * flow[i]) / 0.004));
}

function wetLayer(effect, size, colors, alpha, noise, camera) {
  const { key, washes, smoothing, isRoom, towards, losing } = effect, { viewmat } = camera;
  const { width, height, count, diagonal } = size, { flow, slow, distances } = noise;
  const keyed = keyColors(key, isRoom ? withoutHoles(colors, key.solid, size) : colors, count);
  const focus = filled(new Float32Array(count), (i) =>
    alpha[i] > 0 ? Math.min(1, 0.15 + 0.95 * Math.exp(-distances[i] * distances[i])) : 0);
  const smoothedBy = ([wide, edge, wet, loose]) => {
    const sigma = wide * diagonal;
    const hold = filled(new Float32Array(count), (i) => {
      const wetness = Math.min(1, Math.max(0, 0.5 * slow[i] + 0.45)) * (1 - 0.85 * focus[i]);
      return (1 - 0.92 * Math.min(wet * wetness, 1)) / ((1 + loose * (1 - focus[i])) * (edge / sigma));
    });
    return smoothPlanes(keyed.slice(), 3, size, sigma, keyed, hold);
  };
  const densities = new Float32Array(9 * count), tones = new Float32Array(count), done = new Float32Array(3 * count);
  smoothing.forEach((one, wash) => {
    const smooth = smoothedBy(one), step = washes.steps[wash - 1];
    for (let i = 0; i < count; i++) {
      let tone = 1e-4, factor = 1;
      for (let c = 0; c < 3; c++) {
        smooth[3 * i + c] = -Math.log(Math.min(1, Math.max(LEAST_COLOR, smooth[3 * i + c])));
        tone += LUMA[c] * smooth[3 * i + c];
      }
      if (wash > 0) {
        const place = tone / step + washes.wander * flow[i], whole = Math.floor(place);
        const level = whole + smoothed((place - whole - 0.5) * washes.hardness[wash - 1] + 0.5);
        const change = Math.min(1.5, Math.max(0.6, (level * step) / tone)) - 1;
        factor += washes.masses[wash - 1] * (1 - washes.at_focus * focus[i]) * change;
      }
      if (wash === 1) tones[i] = tone * factor;
      for (let c = 0; c < 3; c++) {
        const own = Math.max(washes.shares[wash] * smooth[3 * i + c] * factor - done[3 * i + c], 0);
        densities[9 * i + 3 * wash + c] = own;
        done[3 * i + c] += own;
      }
    }
  });
  const [first, range, noiseShare, focusShare, sideShare, toneShare] = washes.lost;
  const lamp = towards ? [0, 4].map((row) => dot3(viewmat.subarray(row), towards)) : SHARED.WET_FROM_ABOVE;
  const cover = alpha.map(underPaper), strength = raggedBorder(size);
  if (isRoom) return { densities, tones, focus, strength, cover };
  const [soft, side] = outlines(cover, size, lamp);
  if (effect.ground) awayFromGround(side, effect.ground, size, camera);
  for (let i = 0; i < count; i++) {
    const score = noiseShare * slow[i] - focusShare * focus[i] + sideShare * side[i] - toneShare * tones[i];
    const kept = 1 - smoothed((score - first) / range) * (1 - smoothed(1 - 2 * losing * (1 - soft[i])));
    strength[i] *= kept * smoothed(WET_SPILL * alpha[i]);
    cover[i] *= SHARED.WET_VEIL + (1 - SHARED.WET_VEIL) * kept;
  }
  return { densities, tones, focus, strength, cover };
}

/** How much of what lies below paper hides, by the coverage by strokes. */
function underPaper(alpha) {
  const [least, range] = SHARED.WET_PAPER;
  return smoothed((alpha - least) / range);
}

/** 0.5 at outlines to 1 where none is near, and how far their side is that of a lamp: `_outlines`. */
function outlines(solid, size, [right, down]) {
  const { width, height, count, diagonal } = size, { WET_OPENED: opened, WET_LIT: lit, WET_STEEP: steep } = SHARED;
  const [[least, range], [near, nearRange], [widths]] = [SHARED.WET_CORE, SHARED.WET_NEAR_CORE, SHARED.WET_WIDTHS];
  const fades = new Float32Array(count), sides = new Float32Array(count), weights = new Float32Array(count).fill(1e-6);
  for (const share of widths) {
    const wide = share * WET_LOSS * diagonal, soft = smoothPlanes(solid.slice(), 1, size, wide);
    const cores = share > widths.at(-1) && smoothPlanes(soft.map((one) => smoothed((one - least) / range)), 1, size, wide);
    for (let i = 0; i < count; i++) {
      const x = i % width, row = i - x, y = row / width;
      const across = soft[row + Math.min(x + 1, width - 1)] - soft[row + Math.max(x - 1, 0)];
      const along = soft[Math.min(y + 1, height - 1) * width + x] - soft[Math.max(y - 1, 0) * width + x];
      const slope = (wide * (right * across + down * along)) / (steep * Math.min(soft[i], 1 - soft[i]) + 1e-6);
      const side = -Math.min(1, Math.max(-1, slope));
      const mayBe = cores ? (cores[i] / Math.max(soft[i], 1e-6) - near) / nearRange : lit + side;
      const fade = smoothed(mayBe) * Math.min(opened * (1 - soft[i]), 0.5);
      sides[i] += fade * fade * side;
      weights[i] += fade * fade;
      fades[i] = Math.max(fades[i], fade);
    }
  }
  return [fades.map((fade) => 1 - fade), filled(sides, (i) => sides[i] / weights[i])];
}

/** Takes from sides of the lamp where a subject stands. */
function awayFromGround(side, ground, { width, depths }, camera) {
  const [less] = SHARED.WET_CONTACT, [across, down, ahead, eye] = heightsAbove(ground, camera);
  for (let i = 0; i < side.length; i++) {
    const ray = across * ((i % width) + 0.5) + down * (Math.floor(i / width) + 0.5) + ahead;
    side[i] -= less * (1 - smoothed(depths[i] * ray + eye));
  }
}

/**
 * Heights in a view above the ground that a subject stands on, in reaches of its contact: depth times the product of
 * (x, y, 1), in pixels from the upper left corner, with the first three numbers; plus the fourth.
 *
 * @param {number[]} ground [4] as that of `WetLayer`
 */
function heightsAbove(ground, camera) {
  const { fx, fy, cx, cy, viewmat } = camera, [, reach] = SHARED.WET_CONTACT;
  const [right, down, ahead] = [0, 4, 8].map((row) => dot3(viewmat.subarray(row), ground));
  const eye = dot3(camera.eye(new Float64Array(3)), ground) + ground[3];
  return [right / fx, down / fy, ahead - (right * cx) / fx - (down * cy) / fy, eye].map((one) => one / reach);
}

/** One wash in the color of its strokes, over the area that they cover. */
function shadowWash(size, colors, alpha, { flow }) {
  const { count } = size, densities = new Float32Array(9 * count), nothing = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    const inside = smoothed((alpha[i] - SHADOW_EDGE + SHADOW_WANDER * flow[i]) / SHADOW_SOFTNESS);
    const thick = inside * (SHADOW_LEAST + (1 - SHADOW_LEAST) * alpha[i]);
    for (let c = 0; c < 3; c++) {
      const color = alpha[i] > 0 ? colors[4 * i + c] / alpha[i] : 1;
      densities[9 * i + c] = -Math.log(Math.min(1, Math.max(LEAST_COLOR, color))) * thick;
    }
  }
  const tones = nothing.slice().fill(1);
  return { densities, tones, focus: nothing, strength: raggedBorder(size), cover: nothing };
}

/** The picture of a room, its holes in the colors of the paint around them: `without_holes`. */
function withoutHoles(colors, solid, size) {
  const { WET_HOLE: hole, WET_HOLE_CLOSED: [open, closed] } = SHARED, result = colors.slice(), around = colors.slice();
  for (let i = 0; i < size.count; i++) {
    const alpha = colors[4 * i + 3], laid = Math.min(solid * alpha, 1);
    for (let c = 0; c < 3; c++) around[4 * i + c] = alpha > 0 ? (colors[4 * i + c] / alpha) * laid : 0;
    around[4 * i + 3] = laid;
  }
  smoothPlanes(around, 4, size, hole * size.diagonal);
  for (let i = 0; i < size.count; i++) {
    const near = around[4 * i + 3];
    const lift = Math.max(1 / solid - colors[4 * i + 3], 0) * smoothed((near - open) / (closed - open));
    for (let c = 0; c < 3; c++) if (lift > 0) result[4 * i + c] += (lift * around[4 * i + c]) / near;
    result[4 * i + 3] += lift;
  }
  return result;
}

/** Colors mapped by a tone curve, on white: `key_colors`. */
function keyColors({ low, high, darkest, gamma, chroma, solid }, colors, count) {
  const keyed = new Float32Array(3 * count), dense = [0, 0, 0];
  for (let i = 0; i < count; i++) {
    const alpha = colors[4 * i + 3];
    let luma = 0, mean = 0, found = 0;
    for (let c = 0; c < 3; c++) {
      const color = alpha > 0 ? Math.min(1, Math.max(LEAST_COLOR, colors[4 * i + c] / alpha)) : 1;
      luma += LUMA[c] * color;
      dense[c] = -Math.log(color);
    }
    const level = Math.min(1, Math.max(1e-4, (luma - low) / (high - low)));
    const wanted = -Math.log(darkest + (1 - darkest) * level ** gamma);
    const factor = wanted / Math.max(-Math.log(luma), 1e-3);
    for (let c = 0; c < 3; c++) mean += (factor * dense[c]) / 3;
    for (let c = 0; c < 3; c++) {
      dense[c] = Math.max(mean + chroma * (factor * dense[c] - mean), 0);
      found += LUMA[c] * Math.exp(-dense[c]);
    }
    const again = Math.min(wanted / Math.max(-Math.log(found), 1e-3), 2), share = smoothed(solid * alpha);
    for (let c = 0; c < 3; c++) keyed[3 * i + c] = 1 - share * (1 - Math.exp(-again * dense[c]));
  }
  return keyed;
}

/** Smooth planes in place, forth and back along rows and columns; steps of a guide [.., 3] hold it back. */
function smoothPlanes(planes, channels, { width, count }, sigma, guide = null, hold = null) {
  const own = (sigma * Math.sqrt(3) * 2 ** (WET_ROUNDS - 1)) / Math.sqrt(4 ** WET_ROUNDS - 1);
  const lines = [1, width].map((step) => ({ step, weights: weightsAlong(step, width, count, own, guide, hold) }));
  for (let round = 0; round < WET_ROUNDS; round++) {
    for (const { step, weights } of lines) {
      for (let i = step; i < count; i++) {
        for (let c = 0, at = channels * i, before = at - channels * step; c < channels; c++, at++, before++) {
          planes[at] += weights[i] * (planes[before] - planes[at]);
        }
      }
      for (let i = count - 1; i >= step; i--) {
        for (let c = 0, after = channels * i, at = after - channels * step; c < channels; c++, at++, after++) {
          planes[at] += weights[i] * (planes[after] - planes[at]);
        }
        weights[i] *= weights[i]; // the next round is half as wide
      }
    }
  }
  return planes;
}

/** The weight of each pixel for the one before it in its row or column. */
function weightsAlong(step, width, count, sigma, guide, hold) {
  const weights = new Float32Array(count), rate = -Math.SQRT2 / sigma;
  for (let i = step; i < count; i++) {
    if (step === 1 && i % width === 0) continue; // of another row
    let distance = 1;
    if (guide) {
      const a = 3 * i, b = 3 * (i - step);
      const apart = Math.abs(guide[a] - guide[b]) + Math.abs(guide[a + 1] - guide[b + 1]);
      distance += hold[i] * (apart + Math.abs(guide[a + 2] - guide[b + 2]));
    }
    weights[i] = Math.exp(rate * distance);
  }
  return weights;
}

/** What light meets, but for the grain: `mix_washes`. */
function mixed({ washes }, size, { densities, tones, focus, strength, cover }, { flow, slow }, depths) {
  const { count, diagonal } = size, paint = new Float32Array(4 * count), more = new Float32Array(4 * count);
  const means = filled(new Float32Array(3 * count), (k) =>
    (densities[3 * k] + densities[3 * k + 1] + densities[3 * k + 2]) / 3);
  const blurred = smoothPlanes(means.slice(), 3, size, WET_RIM * diagonal);
  const [dips, crests] = [washes.dips, washes.crests], factors = [0, 0, 0];
  for (let i = 0; i < count; i++) {
    for (let wash = 0; wash < 3; wash++) {
      const mean = means[3 * i + wash], gathered = (mean - blurred[3 * i + wash]) / (mean + 0.15);
      factors[wash] = 1 + washes.rims[wash] * Math.min(0.5, Math.max(0, gathered));
    }
    const dip = (slow[i] - dips[1]) / dips[2], crest = (slow[i] - crests[1]) / crests[2];
    const backruns = 1 - dips[0] * Math.exp(-dip * dip) + crests[0] * Math.exp(-crest * crest) * (1 - focus[i]);
    factors[0] *= (1 + washes.flows[0] * flow[i]) * backruns;
    factors[1] *= 1 + washes.flows[1] * flow[i];
    for (let c = 0; c < 3; c++) {
      for (let wash = 0; wash < 3; wash++) paint[4 * i + c] += densities[9 * i + 3 * wash + c] * factors[wash];
    }
    paint[4 * i + 3] = cover[i];
    more[4 * i] = (washes.light[0] + washes.light_noise[1] * flow[i] - tones[i]) / washes.light[1];
    more[4 * i + 1] = Math.min(1, Math.max(0.12, 1.3 * (means[3 * i] + means[3 * i + 1]))) * (1 - washes.at_focus * focus[i]);
    more[4 * i + 2] = strength[i];
    more[4 * i + 3] = depths[i] || depthBeside(depths, i, size.width);
  }
  return [paint, more];
}

/** The depth of what lies beside a bare pixel, as layers are read between pixels; 0 for nothing. */
function depthBeside(depths, i, width) {
  for (const step of [1, width, width + 1, width - 1]) {
    const depth = depths[i - step] || depths[i + step];
    if (depth) return depth;
  }
  return 0;
}
