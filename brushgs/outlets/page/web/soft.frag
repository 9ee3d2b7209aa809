#version 300 es
// A pixel of a layer of underpaint, which has fewer pixels than the picture.
precision highp float;
precision highp sampler2D;

uniform vec2 uOrigin;  // lower left corner of the picture in the framebuffer, pixels
uniform vec2 uSpan;  // pixels of the picture along the sides of the layer
uniform sampler2D uSoft;  // premultiplied color and alpha
uniform sampler2D uSoftDetail;  // height and depth, times alpha

layout(location = 0) out vec4 oColor;
#ifdef DETAIL
layout(location = 1) out vec4 oDetail;
#endif

void main() {
  vec2 place = (gl_FragCoord.xy - uOrigin) / uSpan;
  oColor = textureLod(uSoft, place, 0.0);
#ifdef DETAIL
  oDetail = vec4(textureLod(uSoftDetail, place, 0.0).rg, 0, oColor.a);
#endif
}
