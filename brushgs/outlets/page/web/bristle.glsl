// Which bristle paints a place across a box, -1 to 1: `streaks` are the first one and the scale of the place.
float bristleAt(float place, vec4 streaks) {
  return streaks.x + 0.5 * BRISTLES * (1.0 + place * streaks.y);
}
