#version 300 es
// Four planes, each blurred by a Gaussian of its own along a row or a column.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"

uniform sampler2D uBlurred;
uniform vec2 uAlong;
uniform vec4 uRates;  // 1 / twice the variances
uniform float uFar;  // pixels

layout(location = 0) out vec4 oBlurred;

void main() {
  ivec2 last = textureSize(uBlurred, 0) - 1;
  vec4 sum = vec4(0), weights = vec4(0);
  for (float k = -uFar; k <= uFar; k++) {
    vec4 value = texelFetch(uBlurred, clamp(ivec2(gl_FragCoord.xy + k * uAlong), ivec2(0), last), 0);
    vec4 weight = exp(-k * k * uRates);
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
