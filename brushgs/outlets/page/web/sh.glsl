// Real spherical harmonics, ordered and signed as in brushgs/values/sh.py; SH_DEGREE is 0 to 3.

uniform highp sampler2D uSh;  // (degree + 1)^2 texels a stroke, row by row

vec3 shTerm(int place) {
  int width = textureSize(uSh, 0).x;
  return texelFetch(uSh, ivec2(place % width, place / width), 0).rgb;
}

// The color of stroke `id` seen in direction d (unit length, from the eye to the stroke), at least 0.
vec3 shColor(int id, vec3 d) {
  int first = id * (SH_DEGREE + 1) * (SH_DEGREE + 1);
  vec3 color = 0.5 + 0.28209479177387814 * shTerm(first);
#if SH_DEGREE >= 1
  float x = d.x, y = d.y, z = d.z;
  color += 0.4886025119029199 * (z * shTerm(first + 2) - y * shTerm(first + 1) - x * shTerm(first + 3));
#endif
#if SH_DEGREE >= 2
  float xx = x * x, yy = y * y, zz = z * z;
  vec3 mixed = x * y * shTerm(first + 4) - y * z * shTerm(first + 5) - x * z * shTerm(first + 7);
  color += 1.0925484305920792 * mixed;
  color += 0.31539156525252005 * (2.0 * zz - xx - yy) * shTerm(first + 6);
  color += 0.5462742152960396 * (xx - yy) * shTerm(first + 8);
#endif
#if SH_DEGREE >= 3
  color -= 0.5900435899266435 * y * (3.0 * xx - yy) * shTerm(first + 9);
  color += 2.890611442640554 * x * y * z * shTerm(first + 10);
  color -= 0.4570457994644658 * y * (4.0 * zz - xx - yy) * shTerm(first + 11);
  color += 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * shTerm(first + 12);
  color -= 0.4570457994644658 * x * (4.0 * zz - xx - yy) * shTerm(first + 13);
  color += 1.445305721320277 * z * (xx - yy) * shTerm(first + 14);
  color -= 0.5900435899266435 * x * (xx - 3.0 * yy) * shTerm(first + 15);
#endif
  return max(color, 0.0);
}
