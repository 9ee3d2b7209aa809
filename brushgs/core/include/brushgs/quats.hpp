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

// The unit quaternion of a rotation matrix: each of four formulas divides by one component; for precision, the largest
// is used. Source: Shepperd 1978, Quaternion from rotation matrix.
template <class T>
void write_quat(const double* m, T* quat) {
    const double wx = m[7] - m[5], wy = m[2] - m[6], wz = m[3] - m[1];
    const double xy = m[1] + m[3], xz = m[2] + m[6], yz = m[5] + m[7];
    const double rows[4][4] = {{1 + m[0] + m[4] + m[8], wx, wy, wz},
                               {wx, 1 + m[0] - m[4] - m[8], xy, xz},
                               {wy, xy, 1 - m[0] + m[4] - m[8], yz},
                               {wz, xz, yz, 1 - m[0] - m[4] + m[8]}};
    std::size_t largest = 0;
    for (std::size_t k = 1; k < 4; ++k)
        if (rows[k][k] > rows[largest][largest]) largest = k;
    double squares = 0;
    for (std::size_t k = 0; k < 4; ++k) squares += rows[largest][k] * rows[largest][k];
    for (std::size_t k = 0; k < 4; ++k) quat[k] = static_cast<T>(rows[largest][k] / std::sqrt(squares));
}

}  // namespace brushgs
