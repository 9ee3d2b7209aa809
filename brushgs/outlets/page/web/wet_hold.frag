#version 300 es
// How far color runs from a pixel to the one before it: `weightsAlong` of washes.js.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D uKeyed;
uniform sampler2D uSpace;  // its .yz: slow noise, focus
uniform vec2 uLow;  // of the small layer, in a pixel
uniform float uSigma;  // pixels
uniform vec3 uWash;  // edge, wet, loose

layout(location = 0) out vec4 oRun;  // color, weight along a row
layout(location = 1) out vec4 oHold;  // weight along a column

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 color = texelFetch(uKeyed, pixel, 0).rgb;
  vec2 noise = textureLod(uSpace, gl_FragCoord.xy * uLow, 0.0).yz;
  float wetness = clamp(0.5 * noise.x + 0.45, 0.0, 1.0) * (1.0 - 0.85 * noise.y);
  float hold = (1.0 - 0.92 * min(uWash.y * wetness, 1.0)) / ((1.0 + uWash.z * (1.0 - noise.y)) * uWash.x / uSigma);
  vec2 weights = vec2(0);
  for (int k = 0; k < 2; k++) {
    if (pixel[k] == 0) continue;
    ivec2 before = pixel;
    before[k]--;
    float apart = dot(abs(color - texelFetch(uKeyed, before, 0).rgb), vec3(1));
    weights[k] = exp(-sqrt(2.0) / uSigma * (1.0 + hold * apart));
  }
  oRun = vec4(color, weights.x);
  oHold = vec4(weights.y);
}
