#version 300 es
// A pixel of a stroke: its coverage, its color with streaks, the height of its paint. APART, in motion, is without what
// a software renderer does for all pixels where one needs it: branches and `discard`.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"
#include "bristle.glsl"

uniform vec2 uOrigin;  // lower left corner of the picture in the framebuffer, pixels
uniform vec2 uSize;
uniform float uStep;  // pixels of the picture along one of the framebuffer
uniform sampler2D uAtlas;
#ifdef TINTS
uniform sampler2D uTints;
flat in float vTintStep;
#endif
uniform sampler2D uNoise;  // of bristles: all bands, tufts alone; repeats
uniform sampler2D uBelow;  // premultiplied color and alpha of what the coat is tested against
uniform sampler2D uBelowDetail;  // its .g: depth times alpha

#ifdef APART
in vec3 vAt;
#else
flat in vec2 vCenter;
flat in vec4 vPlace;
#endif
flat in vec4 vPaint;
flat in vec2 vKind;
#if defined(IMAGE) && !defined(APART)
flat in vec4 vTexels;
#endif
#ifdef STREAKS
flat in vec4 vStreaks;
#endif
#ifdef RELIEF
flat in vec2 vRelief;
#endif
#ifdef TESTED
flat in vec2 vLimit;
#endif
#ifdef MASK
flat in float vMember;
#endif

layout(location = 0) out vec4 oColor;
#ifdef DETAIL
layout(location = 1) out vec4 oDetail;  // height and depth times alpha, 0, alpha
#endif

void main() {
  vec2 pixel = uStep * (gl_FragCoord.xy - uOrigin);
  float coverage, height = 0.5;
#ifdef APART
  vec2 inAtlas = vAt.xy, sampled = textureLod(uAtlas, inAtlas, 0.0).rg;
  coverage = sampled.x, height = sampled.y;
#else
  vec2 offset = vec2(pixel.x, uSize.y - pixel.y) - vCenter;
  vec2 place = vec2(dot(offset, vPlace.xy), dot(offset, vPlace.zw));
  if (!(max(abs(place.x), abs(place.y)) < 1.0)) discard;
#ifdef IMAGE
  vec2 inAtlas = vTexels.xy + (0.5 + 0.5 * place) * vTexels.zw;
  if (vKind.x == 0.0) {
    // textureLod: neighbors of a pixel may lie outside of the stroke
    vec2 sampled = textureLod(uAtlas, inAtlas, 0.0).rg;
    coverage = sampled.x, height = sampled.y;
  } else coverage = exp(-0.5 * GAUSSIAN_SIGMAS * GAUSSIAN_SIGMAS * dot(place, place));
#elif defined(GAUSSIAN)
  coverage = exp(-0.5 * GAUSSIAN_SIGMAS * GAUSSIAN_SIGMAS * dot(place, place));
#else
  coverage = dot(place, place) < 1.0 ? 1.0 : 0.0;
#endif
#endif
  float alpha = min(MAX_ALPHA, vPaint.a * coverage);
#ifdef TESTED
  ivec2 texel = ivec2(pixel);
  float below = texelFetch(uBelow, texel, 0).a;
  if (below > SOLID_BELOW) {
    alpha *= smoothed((texelFetch(uBelowDetail, texel, 0).g / below - vLimit.x) * vLimit.y);
  }
#endif
#ifndef APART
  if (!(alpha >= MIN_ALPHA)) discard;
#endif

#ifdef MASK
  oColor = alpha * vec4(vMember, 1.0 - vMember, 0, 1);
#else
  vec3 color = vPaint.rgb;
#ifdef STREAKS
#ifdef APART
  float bristle = vAt.z;
#else
  float bristle = bristleAt(place.y, vStreaks);
  if (vStreaks.z != 0.0 || vStreaks.w != 0.0)
#endif
  {
    vec2 noise = 2.0 * textureLod(uNoise, vec2((bristle + 0.5) / STREAK_PERIOD, 0.5), 0.0).rg - 1.0;
    color *= 1.0 + dot(noise, vStreaks.zw);
  }
#endif
#ifdef TINTS
  if (vTintStep > 0.0) {
    vec3 tint = textureLod(uTints, inAtlas, 0.0).rgb;
    color = max(color + vTintStep * (255.0 * tint - TINT_ZERO), 0.0);
  }
#endif
#ifdef GLAZE
  oColor = vec4(pow(clamp(color, DARKEST, 1.0), vec3(alpha)), 1.0 - alpha);
#else
  oColor = vec4(alpha * color, alpha);
#endif
#ifdef DETAIL
  float paint = 0.0;
#ifdef RELIEF
  paint = vRelief.x + vRelief.y * (height - 0.5);
#endif
  oDetail = vec4(alpha * paint, alpha * vKind.y, 0, alpha);
#endif
#endif
}
