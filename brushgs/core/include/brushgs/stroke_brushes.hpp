// The surface around each stroke, and the brush that it takes. brushgs/passes/form/material.py and
// brushgs/passes/form/choose_brushes.py say why.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

template <class T>
struct BrushedStrokes {
    const T* means;      // [count, 3] world units
    const T* quats;      // [count, 4] w, x, y, z
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    const T* sh;         // [count, sh_terms, 3]
    std::size_t count;   // below 2^31
    std::size_t sh_terms;
    const double* cones_from_rgb;  // [3, 3] of linear light, see oklab.hpp
    const double* lab_from_roots;  // [3, 3]
    int num_threads;               // of which the result does not depend
};

// [count] each, 0 to 1: roughness, and how far a surface is smooth and light, and how far it is rough.
struct Surfaces {
    std::vector<double> roughness, smooth, rough;
};
template <class T>
Surfaces surfaces_of(const BrushedStrokes<T>& strokes);

// Rows of brushes, ascending: for long, short and other strokes, none empty; for large ones, and smooth and rough
// surfaces, which may be empty.
struct BrushRows {
    std::vector<std::uint8_t> of_long, of_short, of_others, of_large, of_smooth, of_rough;
};

// The brush [count] of each stroke; `material`, 0 to 1, is the share of surfaces that count.
template <class T>
std::vector<std::uint8_t> choose_brushes(const BrushedStrokes<T>& strokes, const BrushRows& brushes, double material,
                                         std::uint64_t seed);

}  // namespace brushgs
