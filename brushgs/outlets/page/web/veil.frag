#version 300 es
// A pixel of the veil over what is not highlighted.
precision highp float;
precision highp int;

uniform ivec2 uOrigin;  // lower left corner of the picture in the framebuffer, pixels
uniform sampler2D uShares;  // alpha of the strokes that are highlighted, and of all others
uniform float uGround;  // 1 where the bare ground is highlighted
uniform vec4 uVeil;

layout(location = 0) out vec4 oColor;

const float GROUND_WEIGHT = 0.1;  // of ground that shines through: a pale wash belongs to its strokes
const vec2 BOUNDS = vec2(0.04, 0.96);  // shares are stored in steps: within them all is as painted

void main() {
  vec2 alphas = texelFetch(uShares, ivec2(gl_FragCoord.xy) - uOrigin, 0).rg;
  float bare = GROUND_WEIGHT * max(0.0, 1.0 - alphas.r - alphas.g);
  float share = (alphas.r + bare * uGround) / max(alphas.r + alphas.g + bare, 1e-6);
  float veiled = uVeil.a * (1.0 - clamp((share - BOUNDS.x) / (BOUNDS.y - BOUNDS.x), 0.0, 1.0));
  oColor = vec4(veiled * uVeil.rgb, veiled);
}
