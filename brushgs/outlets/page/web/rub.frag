#version 300 es
// A pixel of rubbed tones that were made, in the tooth of the paper: the end of `Rub.__call__` in rendering/rub.py.
precision highp float;
precision highp int;

#include "shared.glsl"
#include "surface.glsl"

uniform vec2 uShare;  // of the layer, in a pixel
uniform float uLift;  // pixels of the layer below the picture, whose rows go up
uniform highp sampler2D uMade;  // see `makeRub`
uniform vec3 uPaper;
uniform vec3 uInk;
uniform float uTooth;
uniform float uMiddle;

layout(location = 0) out vec4 oColor;
#ifdef DEPTH
layout(location = 1) out vec4 oDetail;
#endif

void main() {
  vec4 made = textureLod(uMade, (gl_FragCoord.xy + vec2(0, uLift)) * uShare, 0.0);
  float tooth = uTooth * (1.0 - made.z) * (2.0 * grainAt(ivec2(gl_FragCoord.xy)) - 1.0);
  oColor = vec4(made.y * uPaper + made.x * (1.0 + tooth) * (uInk - uPaper), made.y);
#ifdef DEPTH
  oDetail = vec4(0, made.y * (made.w - uMiddle), 0, made.y);
#endif
}
