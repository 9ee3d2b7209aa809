#version 300 es
// The colors of strokes on the tone curve of a watercolour, in fewer pixels than the picture: `keyColors` of washes.js.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"

uniform sampler2D uSoft;  // premultiplied color and alpha of the strokes
uniform sampler2D uSpace;  // flow
uniform sampler2D uAround;  // colors and cover of the paint around holes
uniform vec2 uLow;  // of the small layer, in a pixel
uniform vec2 uTiny;  // of the smaller ones
uniform vec4 uKey;  // low, high, darkest, gamma
uniform vec2 uKeyMore;  // chroma, solid
uniform vec3 uLuminance;

layout(location = 0) out vec4 oKeyed;

vec3 keyed(vec4 paint) {
  vec3 color = paint.a > 0.0 ? clamp(paint.rgb / paint.a, LEAST_COLOR, 1.0) : vec3(1), dense = -log(color);
  float luma = dot(uLuminance, color), level = clamp((luma - uKey.x) / (uKey.y - uKey.x), 1e-4, 1.0);
  float wanted = -log(uKey.z + (1.0 - uKey.z) * pow(level, uKey.w));
  dense *= wanted / max(-log(luma), 1e-3);
  float mean = dot(dense, vec3(1.0 / 3.0));
  dense = max(mean + uKeyMore.x * (dense - mean), 0.0);
  float again = min(wanted / max(-log(dot(uLuminance, exp(-dense))), 1e-3), 2.0);
  return 1.0 - smoothed(uKeyMore.y * paint.a) * (1.0 - exp(-again * dense));
}

void main() {
  vec4 paint = texelFetch(uSoft, ivec2(gl_FragCoord.xy), 0);
  float alpha = paint.a;
#ifdef SHADOW
  float flow = textureLod(uSpace, gl_FragCoord.xy * uLow, 0.0).x;
  float inside = smoothed((alpha - SHADOW_RANGE.x + SHADOW_RANGE.y * flow) / SHADOW_FADE.x);
  vec3 color = alpha > 0.0 ? clamp(paint.rgb / alpha, LEAST_COLOR, 1.0) : vec3(1);
  oKeyed = vec4(pow(color, vec3(inside * (SHADOW_FADE.y + (1.0 - SHADOW_FADE.y) * alpha))), alpha);
#else
#ifdef HOLES
  vec4 around = textureLod(uAround, gl_FragCoord.xy * uTiny, 0.0);
  float closed = smoothed((around.a - WET_HOLE_CLOSED.x) / (WET_HOLE_CLOSED.y - WET_HOLE_CLOSED.x));
  float lift = max(1.0 / uKeyMore.y - alpha, 0.0) * closed;
  if (lift > 0.0) paint += lift * vec4(around.rgb / around.a, 1);
#endif
  oKeyed = vec4(keyed(paint), alpha);
#endif
}
