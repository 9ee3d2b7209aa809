// The smooth step of all fades: 0 below 0, 1 above 1.
float smoothed(float t) {
  t = clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}
