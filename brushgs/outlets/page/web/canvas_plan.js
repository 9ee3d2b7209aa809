// Where a canvas draws each coat, and the blur of its lamp: decided from the header alone.

const MOST_REACH = 15; // pixels, as in blur.frag

/**
 * Decide for each coat where it is drawn, and what it leaves beside its color.
 *
 * @param {boolean} isHalf whether floats can be drawn: else there is neither height nor depth
 */
function planOf({ coats, surface, lamp }, isHalf) {
  const isWoven = isHalf && surface !== null && surface.kind !== "flat";
  const isRaised = isWoven && surface.strength > 0;
  const _isLit = isHalf && lamp !== null && (isRaised || coats.some(({ relief }) => relief !== null));
  const firstCover = coats.findIndex(({ blend }) => blend === "cover");
  const hasPaint = (i) => firstCover >= 0 && i > firstCover;
  const isTested = coats.map(({ tolerance }, i) => isHalf && tolerance !== null && hasPaint(i));
  const lastTested = isTested.lastIndexOf(true);
  let hasHeights = false;
  const _plans = coats.map((coat, i) => {
    const isGlaze = coat.blend === "glaze";
    const isPressed = surface !== null && coat.dry > 0;
    const hasHeight = !isGlaze && _isLit && coat.relief !== null;
    const hasDepth = !isGlaze && (i < lastTested || (isHalf && Boolean(coat.blacks)));
    const hasDetail = hasHeight || hasDepth;
    const { isHiding } = coat, hasLayers = Boolean(coat.rub || coat.washes) && !coat.motion;
    const isDirect = !(hasLayers || isGlaze || isPressed || isHiding || isTested[i] || (hasHeights && hasDetail));
    hasHeights ||= hasHeight;
    const hasBlacks = Boolean(coat.blacks);
    return { isGlaze, isPressed, isHiding, hasBlacks, hasLayers, isTested: isTested[i], hasHeight, hasDepth, hasDetail, isDirect };
  });
  return {
    _plans,
    _isLit,
    _hasPattern: isRaised || (isWoven && _plans.some(({ isPressed, hasLayers }) => isPressed || hasLayers)),
    _hasDetail: _plans.some(({ hasDetail }) => hasDetail),
    // Whether 8 bits are too few also in motion: what strokes add up is seen where they are not opaque.
    _isFine: _plans.some(({ isGlaze, isHiding, hasLayers }, i) => isGlaze || isHiding || hasLayers || coats[i].kernel !== "image") ||
      !coats.some(({ underpaint }) => underpaint),
    _hasGlaze: _plans.some(({ isGlaze }) => isGlaze),
    _isStraight: !_isLit && _plans.every(({ isDirect }) => isDirect),
  };
}

/** Fill the weights of a blur, from the middle out, and return its reach: rendering/light.py `blur_taps`. */
function blurTaps(weights, deviation) {
  const reach = deviation > 1 / 6 ? Math.min(MOST_REACH, Math.ceil(SHARED.LIGHT_REACH * deviation - 0.5)) : 0;
  weights.fill(0);
  let total = 0;
  for (let k = -reach; k <= reach; k++) total += Math.exp(-0.5 * (k / Math.max(deviation, 1e-9)) ** 2);
  for (let k = 0; k <= reach; k++) weights[k] = Math.exp(-0.5 * (k / Math.max(deviation, 1e-9)) ** 2) / total;
  return reach;
}
