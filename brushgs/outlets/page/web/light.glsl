// A lamp on the height of a picture: rendering/light.py.
uniform highp sampler2D uHeight;  // blurred, see blur.frag
uniform vec3 uLamp;  // unit vectors to the lamp, and half way to the eye: x right, y down, z to the eye
uniform vec3 uHalfWay;
uniform float uStrength;
uniform float uGloss;
uniform float uExponent;
uniform float uLevelShine;  // of a level surface

// The height at a pixel; beyond its border the picture goes on as at the border.
float blurredAt(ivec2 pixel, ivec2 last) {
  pixel = clamp(pixel, ivec2(0), last);
  return texelFetch(uHeight, ivec2(pixel.x >> 2, pixel.y), 0)[pixel.x & 3];
}

// `last` is the last pixel of the picture, whose rows go up.
vec3 lit(vec3 color, float alpha, ivec2 pixel, ivec2 last) {
  float right = blurredAt(pixel + ivec2(1, 0), last) - blurredAt(pixel - ivec2(1, 0), last);
  float down = blurredAt(pixel - ivec2(0, 1), last) - blurredAt(pixel + ivec2(0, 1), last);
  vec3 normal = normalize(vec3(-0.5 * right, -0.5 * down, 1));
  float shade = clamp(dot(normal, uLamp) / uLamp.z, 0.0, 2.0);
  float mirrored = pow(clamp(dot(normal, uHalfWay), 0.0, 1.0), uExponent);
  float shine = alpha * clamp(mirrored - uLevelShine, 0.0, 1.0);
  return color * (1.0 + uStrength * (shade - 1.0)) + uGloss * shine;
}
