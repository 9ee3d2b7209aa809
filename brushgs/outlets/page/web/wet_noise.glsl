// Noise in space at the points that pixels show: space_noise.js.
uniform uint uSeed;
uniform uvec3 uPrimes;  // of the hash of a cell, by axis
uniform float uCell;  // size of the finest cells at depth 1

float slopeAt(uint h, vec3 p) {
  float u = h < 8u ? p.x : p.y, v = h < 4u ? p.y : h == 12u || h == 14u ? p.x : p.z;
  return ((h & 1u) != 0u ? -u : u) + ((h & 2u) != 0u ? -v : v);
}

float octaveAt(vec3 point, uint stream) {
  vec3 cell = floor(point), place = point - cell;
  vec3 share = place * place * place * (place * (place * 6.0 - 15.0) + 10.0);
  uvec3 first = uvec3(ivec3(cell)) * uPrimes;
  float total = 0.0;
  for (int c = 0; c < 8; c++) {
    uvec3 corner = uvec3(c & 1, (c >> 1) & 1, c >> 2), bits = first + corner * uPrimes;
    vec3 near = mix(1.0 - share, share, vec3(corner));
    uint h = hash32(stream ^ bits.x ^ bits.y ^ bits.z) & 15u;
    total += near.x * near.y * near.z * slopeAt(h, place - vec3(corner));
  }
  return total / NOISE_DEVIATION;
}

// Flow and slow noise of a point, cells of the noise are 1 there.
vec2 noiseAt(vec3 point, float depth) {
  const int last = int(NOISE_OCTAVES);
  float level = log2(uCell * depth), whole = floor(level), t = level - whole;
  vec2 sums = vec2(0), squares = vec2(0);
  for (int k = 0; k <= last + 1; k++) {
    float size = whole + float(k);
    uint stream = hash32(uSeed + GOLDEN_32 * uint(int(size)));
    vec3 finer = point * exp2(-size);
    vec2 weights = vec2(0);
    if (k <= last) {
      weights.x = pow(NOISE_PERSISTENCE, -float(k)) * (k == 0 ? 1.0 - t : k == last ? t : 1.0);
      sums.x += weights.x * octaveAt(finer, stream);
    }
    if (k >= last - 1) {
      weights.y = max(1.0 - abs(float(k - last) - t + 0.5) / 1.5, 0.0);
      sums.y += weights.y * octaveAt(finer, ~stream);
    }
    squares += weights * weights;
  }
  return sums / sqrt(squares);
}
