#version 300 es
// The height of paint and canvas, blurred along x, and then along y, so that the last pass reads four heights
// and not four columns of them: `finish` in rendering/coats.py, and rendering/light.py.
precision highp float;
precision highp int;

#include "surface.glsl"
#include "shared.glsl"

const int MOST_REACH = 15;

uniform float uTaps[MOST_REACH + 1];  // weights, from the middle out
uniform int uReach;  // pixels

uniform ivec2 uSize;
#ifdef DOWN
uniform highp sampler2D uHeight;  // blurred along x
#endif
uniform highp sampler2D uCanvas;  // premultiplied color and alpha
uniform highp sampler2D uDetail;  // height of the paint
uniform float uSurfaceHeight;  // standard deviation, pixels

layout(location = 0) out vec4 oHeight;

float heightAt(ivec2 pixel) {
  float height = 0.0;
#if defined(DOWN)
  height = texelFetch(uHeight, pixel, 0).r;
#elif defined(DETAIL)
  height = texelFetch(uDetail, pixel, 0).r;
#endif
#if defined(PATTERN) && !defined(DOWN)
  height += (1.0 - CARRIED * texelFetch(uCanvas, pixel, 0).a) * uSurfaceHeight * patternAt(pixel);
#endif
  return height;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float total = 0.0;
  for (int k = -uReach; k <= uReach; k++) {
#ifdef DOWN
    ivec2 place = ivec2(pixel.x, clamp(pixel.y + k, 0, uSize.y - 1));
#else
    ivec2 place = ivec2(clamp(pixel.x + k, 0, uSize.x - 1), pixel.y);
#endif
    total += uTaps[abs(k)] * heightAt(place);
  }
  oHeight = vec4(total, 0, 0, 1);
}
