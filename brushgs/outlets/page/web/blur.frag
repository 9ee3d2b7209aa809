#version 300 es
// The height of paint and canvas, blurred along x: `finish` in rendering/coats.py, and rendering/light.py.
precision highp float;
precision highp int;

#include "surface.glsl"
#include "shared.glsl"
#include "taps.glsl"

uniform ivec2 uSize;
uniform highp sampler2D uCanvas;  // premultiplied colour and alpha
uniform highp sampler2D uDetail;  // height of the paint
uniform float uSurfaceHeight;  // standard deviation, pixels

layout(location = 0) out vec4 oHeight;

float heightAt(ivec2 pixel) {
  float height = 0.0;
#ifdef DETAIL
  height = texelFetch(uDetail, pixel, 0).r;
#endif
#ifdef PATTERN
  height += (1.0 - CARRIED * texelFetch(uCanvas, pixel, 0).a) * uSurfaceHeight * patternAt(pixel);
#endif
  return height;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float total = 0.0;
  for (int k = -uReach; k <= uReach; k++) {
    total += uTaps[abs(k)] * heightAt(ivec2(clamp(pixel.x + k, 0, uSize.x - 1), pixel.y));
  }
  oHeight = vec4(total, 0, 0, 1);
}
