// Numbers of places: brushgs/values/hashing.py.
const uint GOLDEN_32 = 0x9E3779B1u;

uint hash32(uint bits) {
  bits ^= bits >> 16;
  bits *= 0x7FEB352Du;
  bits ^= bits >> 15;
  bits *= 0x846CA68Bu;
  return bits ^ bits >> 16;
}

// -1 to below 1; `column` is the hash of a column, see `latticeColumn`.
float latticeNumber(uint column, int y) {
  return float(hash32(column + uint(y) * GOLDEN_32) >> 8) / 8388608.0 - 1.0;
}

uint latticeColumn(uint stream, int x) {
  return hash32(stream + uint(x) * GOLDEN_32);
}
