#version 300 es
// The height of canvas or paper in standard deviations: `_linen` and `_paper` in rendering/surface.py.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "hash.glsl"

uniform ivec2 uSize;
uniform uint uStreams[2];  // of the two fields of noise
uniform float uSpacings[2];  // pixels
uniform float uDeviations[2];
uniform sampler2D uThreads;  // row 0 by column, row 1 by row of the picture: place among threads, thickness
uniform float uShare;  // of the threads that shows

layout(location = 0) out vec4 oHeight;

vec4 splines(float f) {
  float g = 1.0 - f;
  float near = (3.0 * f - 6.0) * f * f + 4.0, far = ((3.0 - 3.0 * f) * f + 3.0) * f + 1.0;
  return vec4(g * g * g, near, far, f * f * f) / 6.0;
}

// Cubic B-splines over numbers of a lattice; `place` from the upper left corner, pixels.
float noise(int i, vec2 place) {
  place /= uSpacings[i];
  ivec2 first = ivec2(place);
  vec2 f = place - vec2(first);
  vec4 alongX = splines(f.x), alongY = splines(f.y);
  float total = 0.0;
  for (int x = 0; x < 4; x++) {
    uint column = latticeColumn(uStreams[i], first.x + x);
    float sum = 0.0;
    for (int y = 0; y < 4; y++) sum += alongY[y] * latticeNumber(column, first.y + y);
    total += alongX[x] * sum;
  }
  return uDeviations[i] * NOISE_GAIN * total;
}

float bump(float part) {
  return 4.0 * part * (1.0 - part);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.x, uSize.y - 1 - int(gl_FragCoord.y));
  vec2 place = vec2(pixel) + 0.5;
  float one = noise(0, place), other = noise(1, place);
#ifdef LINEN
  vec2 ofColumn = texelFetch(uThreads, ivec2(pixel.x, 0), 0).rg;
  vec2 ofRow = texelFetch(uThreads, ivec2(pixel.y, 1), 0).rg;
  float x = ofColumn.r + WAVES * one, y = ofRow.r + WAVES * other;
  int column = int(x), row = int(y);
  float up = bump(x - float(column)), across = bump(y - float(row));
  float rise = ((column ^ row) & 1) == 1 ? -OVER : OVER;
  float warp = (ofColumn.g + SLUBS * other) * (up + rise * across);
  float weft = (ofRow.g + SLUBS * one) * (across - rise * up);
  oHeight = vec4(uShare * (max(warp, weft) - WEAVE_MEAN) / WEAVE_DEVIATION, 0, 0, 1);
#else
  oHeight = vec4(one + other, 0, 0, 1);
#endif
}
