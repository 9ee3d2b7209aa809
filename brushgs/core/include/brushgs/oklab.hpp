// Display-encoded colours -> OKLab, by tables of both curves.
#pragma once

#include <cstddef>

namespace brushgs {

struct OklabTables {
    const float* light;  // [num_light] linear light of encoded values, evenly spaced from 0 to 1
    std::size_t num_light;
    const float* roots;  // [num_roots] cube roots of squares of values, likewise
    std::size_t num_roots;
    const float* cones_from_rgb;  // [3, 3]
    const float* lab_from_roots;  // [3, 3]
};

// Writes [3, count] from colours [count, 3], 0 to 1; what is beyond is clipped.
void oklab_planes(const OklabTables& tables, const float* rgb, std::size_t count, int num_threads, float* planes);

}  // namespace brushgs
