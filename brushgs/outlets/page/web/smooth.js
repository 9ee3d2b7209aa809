// The fade that pages share: `smoothstep` of values/arrays.py.

/** The smooth step of all fades: 0 below 0, 1 above 1. */
const smoothed = (t) => (t <= 0 ? 0 : t >= 1 ? 1 : t * t * (3 - 2 * t));
