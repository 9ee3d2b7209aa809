#include "brushgs/moments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "brushgs/exponentials.hpp"
#include "brushgs/row_loop.hpp"
#include "brushgs/symmetric_eigen.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsPerItem = 4096;
constexpr std::size_t kGroupsPerItem = 64;
constexpr double kThomsen = 1.6075;  // exponent: an error of at most 1.1 %

// Half axes as they are visible in pictures.
template <class T>
std::array<double, 3> seen_of(const T* scales, double finest) {
    std::array<double, 3> seen{static_cast<double>(scales[0]), static_cast<double>(scales[1]),
                               static_cast<double>(scales[2])};
    std::size_t thin = 0, middle = 1, most = 2;
    if (seen[middle] < seen[thin]) std::swap(thin, middle);
    if (seen[most] < seen[middle]) std::swap(middle, most);
    if (seen[middle] < seen[thin]) std::swap(thin, middle);
    if (!(seen[middle] < finest)) return seen;
    seen[thin] = std::max(seen[thin], finest - seen[middle]);
    seen[middle] = finest;
    seen[most] = std::max(seen[most], finest);
    return seen;
}

// Half axes in the directions that the quaternion turns the axes to, as columns [3, 3].
template <class T>
void half_axes(const T* quat, const T* scales, double* axes) {
    double q[4], largest = 0, squares = 0;
    for (std::size_t k = 0; k < 4; ++k)
        q[k] = static_cast<double>(quat[k]), largest = std::max(largest, std::abs(q[k]));
    const double unit = 1 / largest;
    for (double& value : q) value *= unit, squares += value * value;  // first, so that no square overflows
    const double two = 2 / squares;
    const auto [w, x, y, z] = q;
    const double turned[9] = {1 - two * (y * y + z * z), two * (x * y - w * z),     two * (x * z + w * y),
                              two * (x * y + w * z),     1 - two * (x * x + z * z), two * (y * z - w * x),
                              two * (x * z - w * y),     two * (y * z + w * x),     1 - two * (x * x + y * y)};
    for (std::size_t k = 0; k < 9; ++k) axes[k] = turned[k] * static_cast<double>(scales[k % 3]);
}

void mirror(double* matrix) { matrix[3] = matrix[1], matrix[6] = matrix[2], matrix[7] = matrix[5]; }

}  // namespace

template <class T>
void seen_scales(const T* scales, std::size_t count, double finest, int num_threads, double* seen) {
    for_each_row(count, kRowsPerItem, num_threads, [&](std::size_t i) {
        const auto own = seen_of(scales + 3 * i, finest);
        std::copy_n(own.data(), 3, seen + 3 * i);
    });
}

template <class T>
void projected_areas(const T* scales, std::size_t count, double finest, int num_threads, double* areas) {
    for_each_row(count, kRowsPerItem, num_threads, [&](std::size_t i) {
        auto [a, b, c] = seen_of(scales + 3 * i, finest);
        if (b > a) std::swap(a, b);
        if (c > a) std::swap(a, c);
        const double unit = a > 0 ? a : 1;  // powers of tiny and huge scales stay in range
        const double ab = power_of(b / unit, kThomsen), ac = power_of(c / unit, kThomsen);
        areas[i] = a > 0 ? power_of((ab + ac + ab * ac) / 3, 1 / kThomsen) * (unit * unit) : 0;
    });
}

template <class T>
std::vector<double> paint_of(const T* scales, const T* opacities, std::size_t count, int num_threads) {
    std::vector<double> paint(count);
    projected_areas(scales, count, 0.0, num_threads, paint.data());
    for (std::size_t i = 0; i < count; ++i) paint[i] *= static_cast<double>(opacities[i]);
    return paint;
}

template <class T>
void sum_covariances(const Covariances<T>& query) {
    for_each_row(query.num_groups, kGroupsPerItem, query.num_threads, [&](std::size_t group) {
        double within[9] = {}, between[9] = {}, axes[9];
        const double* center = query.centers + 3 * group;
        for (std::int64_t at = query.begins[group]; at < query.begins[group + 1]; ++at) {
            const auto i = static_cast<std::size_t>(query.rows[at]);
            const double share = query.shares[i];
            half_axes(query.quats + 4 * i, query.scales + 3 * i, axes);
            double away[3];
            for (std::size_t k = 0; k < 3; ++k) away[k] = static_cast<double>(query.means[3 * i + k]) - center[k];
            for (std::size_t p = 0; p < 3; ++p)
                for (std::size_t q = p; q < 3; ++q) {
                    const double* a = axes + 3 * p;
                    const double* b = axes + 3 * q;
                    within[3 * p + q] += share * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
                    between[3 * p + q] += share * away[p] * away[q];
                }
        }
        mirror(within), mirror(between);
        std::copy_n(within, 9, query.within + 9 * group);
        std::copy_n(between, 9, query.between + 9 * group);
    });
}

void principal_axes(const double* covariances, std::size_t count, int num_threads, double* scales, double* axes) {
    for_each_row(count, kGroupsPerItem, num_threads, [&](std::size_t i) {
        double matrix[9], vectors[9];
        std::copy_n(covariances + 9 * i, 9, matrix);
        const double trace = matrix[0] + matrix[4] + matrix[8], unit = trace > 0 ? trace : 1;
        for (double& value : matrix) value /= unit;
        symmetric_eigen(matrix, vectors, 3);
        std::size_t order[3] = {0, 1, 2};
        const auto swap_if = [&](std::size_t a, std::size_t b) {
            if (matrix[4 * order[b]] < matrix[4 * order[a]]) std::swap(order[a], order[b]);
        };
        swap_if(0, 1), swap_if(1, 2), swap_if(0, 1);
        double* const found = axes + 9 * i;
        for (std::size_t rank = 0; rank < 3; ++rank) {
            scales[3 * i + rank] = std::sqrt(std::max(matrix[4 * order[rank]], 0.0)) * std::sqrt(unit);
            double largest = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double value = vectors[3 * k + order[rank]];
                if (std::abs(value) > std::abs(largest)) largest = value;
            }
            for (std::size_t k = 0; k < 3; ++k)
                found[3 * k + rank] = largest < 0 ? -vectors[3 * k + order[rank]] : vectors[3 * k + order[rank]];
        }
        const double turn = found[0] * (found[4] * found[8] - found[5] * found[7]) -
                            found[1] * (found[3] * found[8] - found[5] * found[6]) +
                            found[2] * (found[3] * found[7] - found[4] * found[6]);
        if (turn < 0)
            for (std::size_t k = 0; k < 3; ++k) found[3 * k] = -found[3 * k];
    });
}

template <class T>
void stop_groups(const Stopping<T>& query) {
    for_each_row(query.num_groups, kGroupsPerItem, query.num_threads, [&](std::size_t group) {
        const double footprint = query.footprints[group];
        double passed = 0;
        for (std::int64_t at = query.begins[group]; at < query.begins[group + 1]; ++at) {
            const auto i = static_cast<std::size_t>(query.rows[at]);
            const double part = footprint > query.areas[i] ? query.areas[i] / footprint : 1;
            passed -= log_of_rest(part * static_cast<double>(query.opacities[i]));
        }
        query.stopped[group] = rest_of_exp(passed);
    });
}

template void seen_scales<float>(const float*, std::size_t, double, int, double*);
template void seen_scales<double>(const double*, std::size_t, double, int, double*);
template void projected_areas<float>(const float*, std::size_t, double, int, double*);
template void projected_areas<double>(const double*, std::size_t, double, int, double*);
template std::vector<double> paint_of<float>(const float*, const float*, std::size_t, int);
template std::vector<double> paint_of<double>(const double*, const double*, std::size_t, int);
template void sum_covariances<float>(const Covariances<float>&);
template void sum_covariances<double>(const Covariances<double>&);
template void stop_groups<float>(const Stopping<float>&);
template void stop_groups<double>(const Stopping<double>&);

}  // namespace brushgs
