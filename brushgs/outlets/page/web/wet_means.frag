#version 300 es
// Of four pixels: mean densities of the washes, and cover by paper; or the paint around holes.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"
#ifdef HOLES
uniform sampler2D uSoft;
uniform float uSolid;
#else
#include "wet_wash.glsl"
uniform sampler2D uKeyed;
uniform sampler2D uSpace;  // flow, slow, focus
uniform sampler2D uWide;
#endif

layout(location = 0) out vec4 oMeans;

void main() {
  oMeans = vec4(0);
#ifndef HOLES
  vec4 space = texelFetch(uSpace, ivec2(gl_FragCoord.xy), 0);
#endif
  for (int k = 0; k < 4; k++) {
    ivec2 pixel = 2 * ivec2(gl_FragCoord.xy) + ivec2(k & 1, k >> 1);
#ifdef HOLES
    vec4 paint = texelFetch(uSoft, min(pixel, textureSize(uSoft, 0) - 1), 0);
    if (paint.a > 0.0) oMeans += 0.25 * min(uSolid * paint.a, 1.0) * vec4(paint.rgb / paint.a, 1);
#else
    pixel = min(pixel, textureSize(uKeyed, 0) - 1);
    vec4 keyed = texelFetch(uKeyed, pixel, 0);
    float tone;
    mat3 densities = washesAt(keyed.rgb, texelFetch(uWide, pixel, 0).rgb, space.xz, tone);
    oMeans += 0.25 * vec4(vec3(1.0 / 3.0) * densities, smoothed((keyed.a - WET_PAPER.x) / WET_PAPER.y));
#endif
  }
}
