#version 300 es
// A pixel of the finished picture: `finish` in rendering/coats.py.
precision highp float;
precision highp int;

#include "surface.glsl"
#ifdef LIT
#include "light.glsl"
#endif

uniform ivec2 uOrigin;  // lower left corner of the picture in the framebuffer, pixels
uniform ivec2 uSize;
uniform highp sampler2D uCanvas;  // premultiplied color and alpha
uniform highp sampler2D uTint;  // of all glazes
uniform bool uHasGround;  // whether the color of the surface is seen
uniform vec3 uGround;
#ifdef PICTURE
uniform bool uIsImage;  // whether the ground is an image instead
uniform sampler2D uGroundImage;
uniform vec2 uShown;  // share of the image along each axis, about its middle
#endif
uniform float uTone;  // standard deviation of the color of the surface, over the color
uniform vec4 uBackground;  // behind all, or 0

layout(location = 0) out vec4 oColor;

vec3 groundAt(ivec2 pixel) {
  vec3 ground = uGround;
#ifdef PICTURE
  vec2 place = (vec2(pixel) + 0.5) / vec2(uSize);
  vec3 image = texture(uGroundImage, 0.5 + uShown * (vec2(place.x, 1.0 - place.y) - 0.5)).rgb;
  if (uIsImage) ground = image;
#endif
  return ground * (1.0 + uTone * patternAt(pixel));
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) - uOrigin;
#ifdef BARE
  vec4 paint = vec4(0);
#else
  vec4 paint = texelFetch(uCanvas, pixel, 0);
#endif
#ifdef GLAZED
  vec3 tint = texelFetch(uTint, pixel, 0).rgb;
#else
  vec3 tint = vec3(1);
#endif
  float passed = 1.0 - paint.a;
  vec3 ground = groundAt(pixel);
  if (uHasGround) {
    paint = vec4(paint.rgb + passed * ground * tint, 1);
  } else {  // glazes are as much color and alpha as give the same picture on white
    float darkest = min(min(tint.r, tint.g), tint.b);
    paint = vec4(paint.rgb + passed * (tint - darkest), 1.0 - passed * darkest);
  }
#ifdef LIT
  paint.rgb = lit(paint.rgb, paint.a, pixel, uSize - 1);
#endif
  oColor = paint + (1.0 - paint.a) * uBackground;
}
