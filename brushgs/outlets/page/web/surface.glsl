// What is painted on, at a pixel of the picture: rendering/surface.py.
#ifdef PATTERN
uniform highp sampler2D uPattern;  // height in standard deviations

float patternAt(ivec2 pixel) {
  return texelFetch(uPattern, pixel, 0).r;
}

float grainAt(ivec2 pixel) {
  return clamp(0.5 + 0.24 * patternAt(pixel), 0.0, 1.0);
}
#else
float patternAt(ivec2 pixel) {
  return 0.0;
}

float grainAt(ivec2 pixel) {
  return 1.0;
}
#endif
