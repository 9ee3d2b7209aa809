#version 300 es
// A color smoothed along a row or a column, as far as weights let it run.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D uRun;  // color, and weight for the pixel before
uniform sampler2D uHold;
uniform vec2 uAlong;
uniform float uFar;  // pixels

layout(location = 0) out vec4 oRun;

const float LEAST = 0.02;  // of a weight

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), along = ivec2(uAlong), last = textureSize(uRun, 0) - 1;
  vec4 own = texelFetch(uRun, pixel, 0), sum = vec4(own.rgb, 1);
  int far = int(uFar);
  float weight = own.a;
  for (int k = 1; k <= far && weight > LEAST; k++) {
    vec4 other = texelFetch(uRun, pixel - k * along, 0);
    sum += weight * vec4(other.rgb, 1);
    weight *= other.a;
  }
  weight = 1.0;
  for (int k = 1; k <= far; k++) {
    ivec2 place = pixel + k * along;
    if (any(greaterThan(place, last))) break;
    vec4 other = texelFetch(uRun, place, 0);
    weight *= other.a;
    if (weight < LEAST) break;
    sum += weight * vec4(other.rgb, 1);
  }
  oRun = vec4(sum.rgb / sum.a, texelFetch(uHold, pixel, 0).r);
}
