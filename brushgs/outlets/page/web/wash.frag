#version 300 es
// A pixel of washes that were made, on the grain of the paper: the end of `mix_washes` in tests/rendering/wet_reference.py.
precision highp float;
precision highp int;

#include "shared.glsl"
#include "surface.glsl"
#include "smooth.glsl"

uniform vec2 uShare;  // of the layers, in a pixel
uniform float uLift;  // pixels of the layers below the picture, whose rows go up
uniform highp sampler2D uMade;  // densities, cover by paper
uniform highp sampler2D uMadeMore;  // see `makeWashes`
uniform float uGrain;
uniform vec2 uLightNoise;  // of the least wash by grain, over its range; most density
uniform vec3 uGround;
uniform float uTone;
uniform float uMiddle;

layout(location = 0) out vec4 oColor;
#ifdef DEPTH
layout(location = 1) out vec4 oDetail;
#endif

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 place = (gl_FragCoord.xy + vec2(0, uLift)) * uShare;
  vec4 wash = textureLod(uMade, place, 0.0), more = textureLod(uMadeMore, place, 0.0);
#ifdef PATTERN
  float grain = (0.5 - grainAt(pixel)) / GRAIN_DEVIATION;
#else
  const float grain = 0.0;
#endif
  float share = (1.0 + uGrain * grain * more.y) * (1.0 - smoothed(more.x + uLightNoise.x * grain)) * more.z;
  vec3 tint = exp(-clamp(wash.rgb * share, 0.0, uLightNoise.y));
#ifdef GLAZE
  oColor = vec4(tint, 0);
#else
  float covered = 1.0 - (1.0 - wash.a) * min(min(tint.r, tint.g), tint.b);
  oColor = vec4(max(tint - 1.0 + covered, 0.0) * uGround * (1.0 + uTone * patternAt(pixel)), covered);
#endif
#ifdef DEPTH
  oDetail = vec4(0, covered * (more.w - uMiddle), 0, covered);
#endif
}
