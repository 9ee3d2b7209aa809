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

}  // namespace brushgs
