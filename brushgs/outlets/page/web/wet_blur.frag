#version 300 es
// Four planes, each blurred as far as a number says along a row or a column: in one step what the rounds of
// `smoothPlanes` of washes.js do, whose exponentials, each half as wide as the one before, add up to this kernel.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"

uniform sampler2D uBlurred;
uniform vec2 uPlace;  // of what is blurred, in a pixel here
uniform vec2 uAlong;
uniform vec4 uRates;  // of the widest exponential, by pixel
uniform float uFar;  // pixels

layout(location = 0) out vec4 oBlurred;

void main() {
  vec4 sum = vec4(0), weights = vec4(0);
  for (float k = -uFar; k <= uFar; k++) {
    vec4 value = textureLod(uBlurred, (gl_FragCoord.xy + k * uAlong) * uPlace, 0.0);
    vec4 e = exp(-abs(k) * uRates), weight = e * (64.0 - e * (40.0 - 4.0 * e * e)) / 45.0;
#ifdef COVER
    value = value.aaaa;
#elif defined(CORES)
    value = clamp((value - WET_CORE.x) / WET_CORE.y, 0.0, 1.0);
    value *= value * (3.0 - 2.0 * value);
#endif
    sum += weight * value;
    weights += weight;
  }
  oBlurred = sum / weights;
}
