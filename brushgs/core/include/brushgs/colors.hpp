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

template <class T>
std::array<double, 3> base_rgb(const T* sh) {
    return {base_color(sh, 0), base_color(sh, 1), base_color(sh, 2)};
}

// IEC 61966-2-1, negative values mirrored.
inline double linear_of(double encoded) {
    const double size = std::abs(encoded);
    return std::copysign(size <= 0.04045 ? size / 12.92 : power_of((size + 0.055) / 1.055, 2.4), encoded);
}

// The inverse of `linear_of`.
inline double encoded_of(double linear) {
    const double size = std::abs(linear);
    return std::copysign(size <= 0.0031308 ? size * 12.92 : 1.055 * power_of(size, 1 / 2.4) - 0.055, linear);
}

// Display-encoded colors in OKLab, L, a and b, and back. Source: Ottosson 2020, A perceptual color space for image
// processing.
class Oklab {
public:
    using Color = std::array<double, 3>;

    // Matrices [3, 3] of linear light.
    Oklab(const double* cones_from_rgb, const double* lab_from_roots) {
        std::copy_n(cones_from_rgb, 9, cones_.begin());
        std::copy_n(lab_from_roots, 9, lab_.begin());
        from_cones_ = inverse_of(cones_);
        from_lab_ = inverse_of(lab_);
    }

    Color lab_of(Color rgb) const {
        for (double& value : rgb) value = linear_of(value);
        Color roots = turned(cones_, rgb);
        for (double& value : roots) value = std::cbrt(value);
        return turned(lab_, roots);
    }

    Color rgb_of(const Color& lab) const {
        Color roots = turned(from_lab_, lab);
        for (double& value : roots) value = value * value * value;
        Color rgb = turned(from_cones_, roots);
        for (double& value : rgb) value = encoded_of(value);
        return rgb;
    }

private:
    using Matrix = std::array<double, 9>;
    Matrix cones_, lab_, from_cones_, from_lab_;

    static Color turned(const Matrix& matrix, const Color& from) {
        Color to;
        for (std::size_t i = 0; i < 3; ++i)
            to[i] = matrix[3 * i] * from[0] + matrix[3 * i + 1] * from[1] + matrix[3 * i + 2] * from[2];
        return to;
    }

    static Matrix inverse_of(const Matrix& m) {
        const Matrix adjugate{m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                              m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                              m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
        const double determinant = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
        Matrix inverse = adjugate;
        for (double& value : inverse) value /= determinant;
        return inverse;
    }
};

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
