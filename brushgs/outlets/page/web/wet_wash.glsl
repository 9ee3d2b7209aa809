// Densities of the washes, one a column, and the tone of the second: `wetLayer` of washes.js.
uniform vec3 uShares;
uniform vec2 uSteps;
uniform vec2 uHardness;
uniform vec2 uMasses;
uniform float uWander;
uniform float uAtFocus;
uniform vec3 uLuminance;

mat3 washesAt(vec3 fine, vec3 wide, vec2 noise, out float tone) {
  mat3 densities = mat3(-log(clamp(wide, LEAST_COLOR, 1.0)), vec3(0), vec3(0));
  tone = 1.0;
#ifndef SHADOW
  densities[1] = densities[0];
  densities[2] = -log(clamp(fine, LEAST_COLOR, 1.0));
  vec3 done = densities[0] *= uShares.x;
  for (int k = 0; k < 2; k++) {
    vec3 dense = densities[k + 1];
    float own = 1e-4 + dot(uLuminance, dense), place = own / uSteps[k] + uWander * noise.x, whole = floor(place);
    float level = whole + smoothed((place - whole - 0.5) * uHardness[k] + 0.5);
    float change = clamp(level * uSteps[k] / own, 0.6, 1.5) - 1.0;
    float factor = 1.0 + uMasses[k] * (1.0 - uAtFocus * noise.y) * change;
    if (k == 0) tone = own * factor;
    densities[k + 1] = max(uShares[k + 1] * factor * dense - done, 0.0);
    done += densities[k + 1];
  }
#endif
  return densities;
}
