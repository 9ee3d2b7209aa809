#version 300 es
// Noise and focus of the points that four pixels show, in the mean, for a small layer; or the border of a sheet.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "shared.glsl"
#include "smooth.glsl"
#include "hash.glsl"
#include "wet_noise.glsl"

uniform vec2 uSize;
uniform vec4 uLens;
#ifdef BORDER
uniform vec2 uSheet;  // the picture, in pixels of the layer
#else
uniform sampler2D uSoft;  // premultiplied color and alpha of the strokes
uniform sampler2D uSoftDetail;  // its .g: depth from the middle times alpha
uniform vec2 uPlace;  // of the picture of strokes, in a pixel here
uniform mat3 uRays;  // to directions in cells of the noise
uniform vec3 uEye;  // in them
uniform vec3 uFocus;
uniform float uReach;
uniform float uMiddle;
#endif

layout(location = 0) out vec4 oSpace;  // flow, slow, focus, 0

void main() {
#ifdef BORDER
  vec2 place = vec2(gl_FragCoord.x, uSize.y - gl_FragCoord.y), inside = min(place, uSheet - place);
  float border = min(inside.x, inside.y) / length(uSheet);
  vec3 ray = vec3((place - uLens.zw) / uLens.xy, 1);
  oSpace = vec4(smoothed((border - 0.025 - 0.007 * noiseAt(ray, 1.0).x) / 0.004));
#else
  oSpace = vec4(0);
  vec2 place = gl_FragCoord.xy * uPlace, pixel = place * uSize;
  float alpha = textureLod(uSoft, place, 0.0).a;
  if (alpha == 0.0) return;
  float depth = uMiddle + textureLod(uSoftDetail, place, 0.0).g / alpha;
  vec3 ray = vec3((vec2(pixel.x, uSize.y - pixel.y) - uLens.zw) / uLens.xy, 1);
  vec3 point = depth * (uRays * ray) + uEye, away = (point - uFocus) / uReach;
  oSpace.xy = noiseAt(point, depth);
  oSpace.z = min(1.0, 0.15 + 0.95 * exp(-dot(away, away)));
#endif
}
