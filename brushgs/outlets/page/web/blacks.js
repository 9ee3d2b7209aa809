// Spot blacks of a picture at rest, whole: rendering/tonal.py says what is done and why, and has the names. In a
// picture that moves, `inkAt` of lay.frag makes rougher ones.

const { FINE, BROAD, HALO, JUMP, HIDES_BOUNDS, NESTED_PIXELS } = SHARED;
const { OUTLINE_BLUR, OUTLINE_LEVEL, OUTLINE_SHARP, INK_LAID, INK_SKIRT, INK_FADED } = SHARED;

/** The side of the square window of a radius. */
const sideOf = (radius) => 2 * Math.max(1, Math.round(radius)) + 1;

/**
 * Make paper and ink of a picture of gray strokes, in place.
 *
 * @param {{threshold: number, leastArea: number, ink: number[], paper: number[]}} blacks
 * @param {object} picture of `paintSoftly`
 */
function makeBlacks(blacks, { width, height, colors, depths: means }) {
  const depths = filled(new Float32Array(width * height), (i) => (colors[4 * i + 3] > 0.5 ? means[i] : Infinity));
  const scale = Math.sqrt((width * height) / NESTED_PIXELS);
  const shares = inkShares(blacks, { width, height, scale }, colors, depths);
  const [clear, solid] = HIDES_BOUNDS, { ink, paper } = blacks;
  for (let i = 0; i < shares.length; i++) {
    const share = shares[i], alpha = Math.max(smoothed((colors[4 * i + 3] - clear) / (solid - clear)), share);
    for (let k = 0; k < 3; k++) colors[4 * i + k] = alpha * (paper[k] + share * (ink[k] - paper[k]));
    colors[4 * i + 3] = alpha;
  }
}

/** 0 (paper) to 1 (ink): `Blacks.shares`, without softness. */
function inkShares({ threshold, leastArea }, size, colors, depths) {
  const { width, height, scale } = size, count = width * height, least = leastArea * count;
  const plane = (numberAt) => filled(new Float32Array(count), numberAt);
  const mask = (isIn) => filled(new Uint8Array(count), isIn);
  const fine = withinEdges(plane((i) => colors[4 * i + 1] + 1 - colors[4 * i + 3]), size, FINE);
  const broad = withinEdges(fine, size, BROAD), isBehind = jumpsOf(size, depths);
  const isDark = (i) => 0.5 * (fine[i] + broad[i]) < threshold && depths[i] < Infinity && !isBehind[i];
  const dark = gaussianBlur(plane((i) => (isDark(i) ? 1 : 0)), width, height, OUTLINE_BLUR * scale);
  const isBlack = mask((i) => dark[i] > OUTLINE_LEVEL && !isBehind[i]);
  const shares = byArea(isBlack, size, least), holes = byArea(mask((i) => !isBlack[i]), size, 0.5 * least);
  for (let i = 0; i < count; i++) {
    if (!isBlack[i]) shares[i] += (1 - shares[i]) * (1 - holes[i]);
    shares[i] = shares[i] > 0.5 ? 1 : 0;
  }
  const near = gaussianBlur(shares, width, height, OUTLINE_SHARP * scale);
  const smooth = plane((i) => Math.min(1, Math.max(0, (near[i] - 0.2) / 0.6)));
  const { labels, areas } = regionsOf(mask((i) => smooth[i] > INK_LAID), width, height);
  const whole = plane((i) => (labels[i] && areas[labels[i]] >= least ? 1 : 0));
  const nearWhole = largestNear(whole, width, height, sideOf(INK_SKIRT * scale));
  return plane((i) => nearWhole[i] * smooth[i]);
}

/** Tones, averaged over windows but not over edges: a guided filter. */
function withinEdges(values, { width, height, scale }, [radius, contrast]) {
  const side = sideOf(radius * scale), mean = (plane) => boxMean(plane, width, height, side);
  const plane = (numberAt) => filled(new Float32Array(values.length), numberAt);
  const means = mean(values), squares = mean(plane((i) => values[i] * values[i]));
  const shares = plane((i) => {
    const spread = Math.max(squares[i] - means[i] * means[i], 0);
    return spread / (spread + contrast * contrast);
  });
  const kept = mean(shares), rest = mean(plane((i) => means[i] * (1 - shares[i])));
  return plane((i) => kept[i] * values[i] + rest[i]);
}

/** Where something nearer lies beside a surface, for which paper is left. */
function jumpsOf({ width, height, scale }, depths) {
  const count = width * height, nearness = filled(new Float32Array(count), (i) => -depths[i]);
  const nearest = largestNear(nearness, width, height, sideOf(HALO * scale));
  return filled(new Uint8Array(count), (i) => depths[i] < Infinity && depths[i] + nearest[i] > -JUMP * nearest[i]);
}

/** The weight of each region by its area over the least one, so that none pops up. */
function byArea(mask, { width, height }, least) {
  const { labels, areas } = regionsOf(mask, width, height), [none, whole] = INK_FADED;
  const weights = areas.map((area) => smoothed((area / Math.max(least, 1) - none) / (whole - none)));
  weights[0] = 0;
  return filled(new Float32Array(mask.length), (i) => weights[labels[i]]);
}
