#version 300 es
// The height of paint and canvas, blurred along x, and then along y, so that the last pass reads four heights
// and not four columns of them: `finish` in rendering/coats.py, and rendering/light.py. A texel holds four pixels
// of a row, which share most of what they are made of.
precision highp float;
precision highp int;

#include "surface.glsl"
#include "shared.glsl"

const int MOST_REACH = 15;

uniform float uTaps[MOST_REACH + 4];  // weights, from the middle out; 0 beyond the reach
uniform int uReach;  // pixels

uniform ivec2 uSize;
#ifdef DOWN
uniform highp sampler2D uHeight;  // blurred along x
#endif
uniform highp sampler2D uCanvas;  // premultiplied color and alpha
uniform highp sampler2D uDetail;  // height of the paint
uniform float uSurfaceHeight;  // standard deviation, pixels

layout(location = 0) out vec4 oHeights;

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
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec4 total = vec4(0);
#ifdef DOWN
  for (int k = -uReach; k <= uReach; k++) {
    ivec2 place = ivec2(texel.x, clamp(texel.y + k, 0, uSize.y - 1));
    total += uTaps[abs(k)] * texelFetch(uHeight, place, 0);
  }
#else
  for (int k = -uReach; k <= uReach + 3; k++) {
    ivec2 pixel = ivec2(clamp(4 * texel.x + k, 0, uSize.x - 1), texel.y);
    total += heightAt(pixel) * vec4(uTaps[abs(k)], uTaps[abs(k - 1)], uTaps[abs(k - 2)], uTaps[abs(k - 3)]);
  }
#endif
  oHeights = total;
}
