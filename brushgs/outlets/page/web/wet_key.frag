#version 300 es
// What washes are made of, in fewer pixels than the picture: colors on the tone curve, noise, focus; or the border.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"
#include "hash.glsl"
#include "wet_noise.glsl"

uniform vec2 uSize;
uniform vec4 uLens;
#ifndef BORDER
uniform sampler2D uSoft;  // premultiplied color and alpha of the strokes
uniform sampler2D uSoftDetail;  // its .g: depth from the middle times alpha
uniform sampler2D uAround;  // colors and cover of the paint around holes
uniform vec2 uLow;  // of the small layer, in a pixel
uniform mat3 uRays;  // to directions in cells of the noise
uniform vec3 uEye;  // in them
uniform vec3 uFocus;
uniform float uReach;
uniform float uMiddle;
uniform vec4 uKey;  // low, high, darkest, gamma
uniform vec2 uKeyMore;  // chroma, solid
uniform vec3 uLuminance;
#endif

layout(location = 0) out vec4 oKeyed;
#ifndef BORDER
layout(location = 1) out vec4 oNoise;  // flow, slow, focus, depth

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
#endif

void main() {
  vec2 place = vec2(gl_FragCoord.x, uSize.y - gl_FragCoord.y);
  vec3 ray = vec3((place - uLens.zw) / uLens.xy, 1);
#ifdef BORDER
  vec2 inside = min(place, uSize - place);
  float border = min(inside.x, inside.y) / length(uSize);
  oKeyed = vec4(smoothed((border - 0.025 - 0.007 * noiseAt(ray, 1.0).x) / 0.004));
#else
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 paint = texelFetch(uSoft, pixel, 0);
  float alpha = paint.a, depth = uMiddle;
  oNoise = vec4(0);
  if (alpha > 0.0) {
    depth += texelFetch(uSoftDetail, pixel, 0).g / alpha;
    vec3 point = depth * (uRays * ray) + uEye, away = (point - uFocus) / uReach;
    oNoise.xy = noiseAt(point, depth);
    oNoise.z = min(1.0, 0.15 + 0.95 * exp(-dot(away, away)));
  }
  oNoise.w = depth;
#ifdef SHADOW
  float inside = smoothed((alpha - SHADOW_RANGE.x + SHADOW_RANGE.y * oNoise.x) / SHADOW_FADE.x);
  vec3 color = alpha > 0.0 ? clamp(paint.rgb / alpha, LEAST_COLOR, 1.0) : vec3(1);
  oKeyed = vec4(pow(color, vec3(inside * (SHADOW_FADE.y + (1.0 - SHADOW_FADE.y) * alpha))), alpha);
#else
#ifdef HOLES
  vec4 around = textureLod(uAround, gl_FragCoord.xy * uLow, 0.0);
  float closed = smoothed((around.a - WET_HOLE_CLOSED.x) / (WET_HOLE_CLOSED.y - WET_HOLE_CLOSED.x));
  float lift = max(1.0 / uKeyMore.y - alpha, 0.0) * closed;
  if (lift > 0.0) paint += lift * vec4(around.rgb / around.a, 1);
#endif
  oKeyed = vec4(keyed(paint), alpha);
#endif
#endif
}
