// Sine and cosine without the C library: written so that the compiler can vectorise a loop over them, and
// rounding the same on every instruction set.
#pragma once

#include <cmath>

namespace brushgs::BRUSHGS_ISA {

struct SinCos {
    double sin, cos;
};

constexpr double kLargestAngle = 1e5;  // radians: what `sincos_of` takes

// The angle, reduced to (-pi, pi] if it is out of the range of `sincos_of`. For loading loops, not for the lanes.
[[gnu::always_inline]] static inline double within_reach(double angle) {
    const bool is_near = -kLargestAngle <= angle && angle <= kLargestAngle;
    return is_near ? angle : std::atan2(std::sin(angle), std::cos(angle));
}

// To about 1e-16 absolute for |angle| <= kLargestAngle.
[[gnu::always_inline]] static inline SinCos sincos_of(double angle) {
    constexpr double two_over_pi = 0.63661977236758134308;
    constexpr double half_pi_high = 1.57079632679489655800;  // pi/2 as a double, and what that leaves
    constexpr double half_pi_low = 6.12323399573676603587e-17;
    constexpr double rounder = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to a whole number
    const double quarters = (angle * two_over_pi + rounder) - rounder;
    const double x = (angle - quarters * half_pi_high) - quarters * half_pi_low;
    const double xx = x * x;
    // Taylor series on |x| <= pi/4: the first term omitted is below 2e-17.
    const double s =
        x + x * xx *
                (-1.0 / 6 +
                 xx * (1.0 / 120 + xx * (-1.0 / 5040 +
                                         xx * (1.0 / 362880 + xx * (-1.0 / 39916800 + xx * (1.0 / 6227020800.0 -
                                                                                            xx / 1307674368000.0))))));
    const double c =
        1 + xx * (-0.5 + xx * (1.0 / 24 +
                               xx * (-1.0 / 720 + xx * (1.0 / 40320 +
                                                        xx * (-1.0 / 3628800 + xx * (1.0 / 479001600 +
                                                                                     xx * (-1.0 / 87178291200.0 +
                                                                                           xx / 20922789888000.0)))))));
    // Which quarter of the circle, as 0, 1, 2, 3, without integers (they would not vectorise everywhere).
    const double turns = quarters * 0.25;
    const double whole = (turns - 0.375 + rounder) - rounder;
    const double quarter = (turns - whole) * 4;
    const bool is_swapped = quarter == 1 || quarter == 3;
    const double sin_size = is_swapped ? c : s;
    const double cos_size = is_swapped ? s : c;
    return {quarter >= 2 ? -sin_size : sin_size, quarter == 1 || quarter == 2 ? -cos_size : cos_size};
}

}  // namespace brushgs::BRUSHGS_ISA
