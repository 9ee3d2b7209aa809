// Scenes of faint Gaussians: their opacities count relative to the highest.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "brushgs/extent.hpp"

namespace brushgs {

// The 99th percentile of some opacities, at least one.
template <class T>
double high_opacity(const T* opacities, std::size_t count) {
    std::vector<double> values(opacities, opacities + count);
    return percentile(values, 0.99);
}

// What opacities are divided by, from 1e-6 to 1. The high opacity is 0.83 and more in real scenes. If it is below 0.8,
// the whole scene is faint, and its opacities are scaled up to this.
inline double faintness(double high_opacity) { return std::max(std::min(high_opacity / 0.8, 1.0), 1e-6); }

}  // namespace brushgs
