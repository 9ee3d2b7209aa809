#version 300 es
// A pixel of a coat, as it is blended with the canvas: rendering/coats.py `Canvas.lay`.
precision highp float;
precision highp int;

#include "press.glsl"
#include "surface.glsl"
#include "shared.glsl"

uniform highp sampler2D uCoat;  // premultiplied colour and alpha; of a glaze tint and 1 - alpha
uniform highp sampler2D uCoatDetail;  // height and depth, times alpha
uniform float uDry;
uniform bool uIsHeight;  // whether the height of the canvas is blended, or its depth

layout(location = 0) out vec4 oColor;
#ifdef GLAZE
layout(location = 1) out vec4 oTint;
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
