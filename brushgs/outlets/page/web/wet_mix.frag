#version 300 es
// What light meets in washes, but for the grain, as `makeWashes` has it: for wash.frag.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"
#include "wet_wash.glsl"

uniform sampler2D uKeyed;
uniform sampler2D uSpace;  // flow, slow, focus
uniform sampler2D uSoftDetail;  // its .g: depth from the middle times alpha
uniform sampler2D uWide;
uniform sampler2D uRims;  // blurred means
uniform sampler2D uOutlines;  // cover, blurred by three widths
uniform sampler2D uCores;
uniform sampler2D uBorder;
uniform vec2 uLow;  // of the small layers, in a pixel
uniform vec2 uTiny;  // of the smaller ones
uniform vec3 uWidths;  // in those, pixels
uniform float uMiddle;
uniform vec2 uLamp;  // right, down
uniform vec4 uGround;  // height above it in reaches: times depth by pixel coordinates, and of the eye
uniform vec3 uRimShares;
uniform vec2 uFlows;
uniform vec3 uDips;
uniform vec3 uCrests;
uniform vec2 uLight;
uniform float uLightFlow;
uniform float uLost[7];

layout(location = 0) out vec4 oPaint;
layout(location = 1) out vec4 oMore;

vec3 outlinesAt(vec2 place) {
  return textureLod(uOutlines, place, 0.0).rgb;
}

// How far an outline is lost, and how far its side is that of the lamp: `outlines` of washes.js.
vec2 lostAt(vec2 place, vec2 texel) {
  vec3 soft = outlinesAt(place);
  vec3 across = outlinesAt(place + vec2(texel.x, 0)) - outlinesAt(place - vec2(texel.x, 0));
  vec3 along = outlinesAt(place - vec2(0, texel.y)) - outlinesAt(place + vec2(0, texel.y));
  vec3 slope = uWidths * (uLamp.x * across + uLamp.y * along) / (WET_STEEP * min(soft, 1.0 - soft) + 1e-6);
  vec3 side = -clamp(slope, -1.0, 1.0), cores = textureLod(uCores, place, 0.0).rgb;
  vec3 near = (cores / max(soft, 1e-6) - WET_NEAR_CORE.x) / WET_NEAR_CORE.y;
  vec3 may = vec3(smoothed(near.x), smoothed(near.y), smoothed(WET_LIT + side.z));
  vec3 fade = may * min(WET_OPENED * (1.0 - soft), 0.5), weight = fade * fade;
  return vec2(max(max(fade.x, fade.y), fade.z), dot(weight, side) / (dot(weight, vec3(1)) + 1e-6));
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 place = gl_FragCoord.xy * uLow;
  vec4 keyed = texelFetch(uKeyed, pixel, 0), noise = textureLod(uSpace, place, 0.0);
  float tone;
  mat3 densities = washesAt(keyed.rgb, texelFetch(uWide, pixel, 0).rgb, noise.xz, tone);
  vec3 means = vec3(1.0 / 3.0) * densities, blurred = textureLod(uRims, place, 0.0).rgb;
  vec3 factors = 1.0 + uRimShares * clamp((means - blurred) / (means + 0.15), 0.0, 0.5);
  float dip = (noise.y - uDips.y) / uDips.z, crest = (noise.y - uCrests.y) / uCrests.z;
  factors.x *= 1.0 - uDips.x * exp(-dip * dip) + uCrests.x * exp(-crest * crest) * (1.0 - noise.z);
  factors.xy *= 1.0 + uFlows * noise.x;
  float strength = texelFetch(uBorder, pixel, 0).r, cover = 0.0;
  float depth = uMiddle + texelFetch(uSoftDetail, pixel, 0).g / max(keyed.a, 1e-6);
#ifndef SHADOW
  cover = smoothed((keyed.a - WET_PAPER.x) / WET_PAPER.y);
#ifndef HOLES
  vec2 lost = lostAt(gl_FragCoord.xy * uTiny, 4.0 * uTiny);
  float height = depth * dot(uGround.xyz, vec3(gl_FragCoord.xy, 1)) + uGround.w;
  float side = lost.y - WET_CONTACT.x * (1.0 - smoothed(height));
  float score = uLost[2] * noise.y - uLost[3] * noise.z + uLost[4] * side - uLost[5] * tone;
  float kept = 1.0 - smoothed((score - uLost[0]) / uLost[1]) * (1.0 - smoothed(1.0 - 2.0 * uLost[6] * lost.x));
  strength *= kept * smoothed(WET_SPILL * keyed.a);
  cover *= WET_VEIL + (1.0 - WET_VEIL) * kept;
#endif
#endif
  float grain = clamp(1.3 * (means.x + means.y), 0.12, 1.0) * (1.0 - uAtFocus * noise.z);
  oPaint = vec4(densities * factors, cover);
  oMore = vec4((uLight.x + uLightFlow * noise.x - tone) / uLight.y, grain, strength, depth);
}
