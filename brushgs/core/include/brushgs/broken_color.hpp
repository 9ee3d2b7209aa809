// Broken color: each stroke a little lighter or darker, warmer or cooler, while local means stay.
// brushgs/passes/color/broken_color.py says why, and what the options mean.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

template <class T>
struct BrokenColor {
    const T* means;      // [count, 3] world units
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    std::size_t count;   // below 2^31
    std::size_t sh_terms;
    const double* cones_from_rgb;  // [3, 3] of linear light, see oklab.hpp
    const double* lab_from_roots;  // [3, 3]
    double lightness, chroma;      // standard deviations in OKLab
    double follows;                // 0 to 1
    std::uint64_t seed;
    int num_threads;  // of which the result does not depend
};

// Shifts the base colors in `sh` [count, sh_terms, 3].
template <class T>
void break_colors(const BrokenColor<T>& query, T* sh);

}  // namespace brushgs
