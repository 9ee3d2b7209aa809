// Base colors of Gaussians, display-encoded values in linear light, and CIELAB.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "brushgs/exponentials.hpp"

namespace brushgs {

constexpr double kBand0 = 0.28209479177387814;  // 1 / (2 sqrt(pi)): the view-independent basis function

// A channel, 0 to 1, of the color without its view-dependent part.
template <class T>
double base_color(const T* sh, std::size_t channel) {
    return std::clamp(0.5 + kBand0 * static_cast<double>(sh[channel]), 0.0, 1.0);
}

// IEC 61966-2-1, negative values mirrored.
inline double linear_of(double encoded) {
    const double size = std::abs(encoded);
    return std::copysign(size <= 0.04045 ? size / 12.92 : power_of((size + 0.055) / 1.055, 2.4), encoded);
}

// A display-encoded color in OKLab: L, a, b. Source: Ottosson 2020, A perceptual color space for image processing.
inline std::array<double, 3> oklab_of(std::array<double, 3> rgb, const double* cones_from_rgb,
                                      const double* lab_from_roots) {
    const auto turned = [](const double* m, const std::array<double, 3>& from) {
        std::array<double, 3> to;
        for (std::size_t i = 0; i < 3; ++i)
            to[i] = m[3 * i] * from[0] + m[3 * i + 1] * from[1] + m[3 * i + 2] * from[2];
        return to;
    };
    for (double& value : rgb) value = linear_of(value);
    std::array<double, 3> cones = turned(cones_from_rgb, rgb);
    for (double& value : cones) value = std::cbrt(value);
    return turned(lab_from_roots, cones);
}

// The base color in CIELAB / 100; `xyz_over_white` [3, 3] is of linear light. Source: ISO/CIE 11664-4.
template <class T>
std::array<double, 3> cielab_of(const T* sh, const double* xyz_over_white) {
    constexpr double darkest = 6.0 / 29;  // below this root, its tangent
    const double light[3] = {linear_of(base_color(sh, 0)), linear_of(base_color(sh, 1)), linear_of(base_color(sh, 2))};
    double roots[3];
    for (std::size_t i = 0; i < 3; ++i) {
        const double* row = xyz_over_white + 3 * i;
        const double value = row[0] * light[0] + row[1] * light[1] + row[2] * light[2];
        roots[i] = value > darkest * darkest * darkest ? std::cbrt(value) : value / (3 * darkest * darkest) + 4.0 / 29;
    }
    return {1.16 * roots[1] - 0.16, 5 * (roots[0] - roots[1]), 2 * (roots[1] - roots[2])};
}

}  // namespace brushgs
