#version 300 es
// A pixel of a coat, as it is blended with the canvas: rendering/coats.py `Canvas.lay`.
precision highp float;
precision highp int;

#include "press.glsl"
#include "surface.glsl"
#include "shared.glsl"

uniform highp sampler2D uCoat;  // premultiplied color and alpha; of a glaze tint and 1 - alpha
uniform highp sampler2D uCoatDetail;  // height and depth, times alpha
uniform float uDry;
uniform bool uIsHeight;  // whether the height of the canvas is blended, or its depth

layout(location = 0) out vec4 oColor;
#ifdef GLAZE
layout(location = 1) out vec4 oTint;
#endif

#ifdef BLACKS
const float OUTLINE = 0.012;  // tones over which an outline is soft
const int HALO_TAPS = 3;

uniform float uThreshold;  // tone below which a mass is black
uniform ivec2 uSize;
uniform float uUnit;  // pixels of the picture along one of the picture that lengths refer to
uniform float uMiddle;  // depth of the middle of the scene
uniform vec3 uInk;
uniform vec3 uPaper;

// The tone at a pixel, averaged over a window but not over edges: one step of a guided filter.
float toneWithin(ivec2 pixel, float radius, float contrast, int taps) {
  vec2 sums = vec2(0);
  float count = 0.0, own = 0.0;
  ivec2 last = uSize - 1;
  for (int y = -taps; y <= taps; y++) {
    for (int x = -taps; x <= taps; x++) {
      ivec2 place = clamp(pixel + ivec2(round(vec2(x, y) * (radius / float(taps)))), ivec2(0), last);
      vec4 coat = texelFetch(uCoat, place, 0);
      float tone = coat.g + 1.0 - coat.a;
      sums += vec2(tone, tone * tone);
      count += 1.0;
      if (x == 0 && y == 0) own = tone;
    }
  }
  float mean = sums.x / count, spread = max(sums.y / count - mean * mean, 0.0);
  return mix(mean, own, spread / (spread + contrast * contrast));
}

// Whether something nearer lies beside a pixel, for which paper is left.
bool isBehind(ivec2 pixel, float alpha) {
  float depth = texelFetch(uCoatDetail, pixel, 0).g / alpha + uMiddle, nearest = depth;
  ivec2 last = uSize - 1;
  for (int y = -HALO_TAPS; y <= HALO_TAPS; y++) {
    for (int x = -HALO_TAPS; x <= HALO_TAPS; x++) {
      ivec2 place = clamp(pixel + ivec2(round(vec2(x, y) * (HALO * uUnit / float(HALO_TAPS)))), ivec2(0), last);
      float beside = texelFetch(uCoat, place, 0).a;
      if (beside > 0.5) nearest = min(nearest, texelFetch(uCoatDetail, place, 0).g / beside + uMiddle);
    }
  }
  return depth - nearest > JUMP * nearest;
}

float inkAt(ivec2 pixel, float alpha) {
  if (alpha <= 0.5 || isBehind(pixel, alpha)) return 0.0;
  float fine = toneWithin(pixel, FINE.x * uUnit, FINE.y, 2), broad = toneWithin(pixel, BROAD.x * uUnit, BROAD.y, 4);
  return clamp(0.5 + (uThreshold - 0.5 * (fine + broad)) / OUTLINE, 0.0, 1.0);
}
#endif

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 coat = texelFetch(uCoat, pixel, 0);
#ifdef GLAZE
  float alpha = 1.0 - coat.a;
#else
  float alpha = coat.a;
#endif
  float share = 1.0;
#ifdef HIDES
  share = smoothed((alpha - HIDES_BOUNDS.x) / (HIDES_BOUNDS.y - HIDES_BOUNDS.x)) / max(alpha, MIN_ALPHA);
#endif
#ifdef BLACKS
  coat.rgb = alpha * mix(uPaper, uInk, inkAt(pixel, alpha));
#endif
#ifdef PRESSED
  share *= pressed(share * alpha, grainAt(pixel), uDry);
#endif
#if defined(GLAZE)
  oColor = oTint = vec4(1.0 - (1.0 - coat.rgb) * share, 1);  // what is multiplied
#elif defined(DETAIL)
  alpha *= share;
  oColor = vec4(share * texelFetch(uCoatDetail, pixel, 0).rg, 0, uIsHeight ? CARRIED * alpha : alpha);
#else
  oColor = share * coat;
#endif
}
