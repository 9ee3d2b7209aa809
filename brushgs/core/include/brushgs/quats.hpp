// Quaternions of any length above zero.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace brushgs {

// The same in float64 with length 1; divided by its largest component first, so that no square overflows.
template <class T>
std::array<double, 4> unit_quat(const T* quat) {
    std::array<double, 4> unit;
    double largest = 0, squares = 0;
    for (std::size_t k = 0; k < 4; ++k) {
        unit[k] = static_cast<double>(quat[k]);
        largest = std::max(largest, std::abs(unit[k]));
    }
    for (double& value : unit) value /= largest, squares += value * value;
    const double length = std::sqrt(squares);
    for (double& value : unit) value /= length;
    return unit;
}

// The rotation [3, 3] of a quaternion of length 1: columns are the turned axes.
inline std::array<double, 9> rotation_of(const std::array<double, 4>& quat) {
    const auto [w, x, y, z] = quat;
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

}  // namespace brushgs
