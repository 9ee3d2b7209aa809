// How thick the paint of strokes is, and how deep its furrows: by their size, row and lightness, relative to a usual
// stroke. brushgs/rendering/relief.py says why.
#pragma once

#include <cstddef>

namespace brushgs {

constexpr double kLeastLightRange = 0.1;  // OKLab L from fully dark to light: paint of one tone has one thickness

template <class T>
struct PaintedStrokes {
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    const T* sh;         // [count, sh_terms, 3]
    std::size_t count, sh_terms;
    const double* cones_from_rgb;  // [3, 3] of linear light, see oklab.hpp
    const double* lab_from_roots;  // [3, 3]
};

struct LightRange {
    double dark = 0, light = 1;  // OKLab L
};

// The median of the logarithm of the geometric mean of the two larger scales; minus infinity without size. count > 0.
template <class T>
double median_log_size(const T* scales, std::size_t count);

// OKLab L of the 0.4 and 0.8 quantiles of painted area.
template <class T>
LightRange light_range(const PaintedStrokes<T>& strokes);

// Writes thickness and gain [count, 2]: `middle` is the usual logarithm of a size, not finite for strokes that are all
// alike; `by_light`, 0 to 1, is how far lights are thick and darks thin.
template <class T>
void relative_reliefs(const PaintedStrokes<T>& strokes, double middle, double by_light, LightRange lights,
                      double* reliefs);

}  // namespace brushgs
