#include "brushgs/extent.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr double kOutside = 0.01;  // share of the points beyond each side of the box

template <class T>
Extent extent_of(const T* points, std::size_t count, double outside, int num_threads) {
    double low[3], high[3];
    parallel_for(3, num_threads, [&](std::size_t axis) {
        std::vector<double> values(count);
        for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(points[3 * i + axis]);
        low[axis] = percentile(values, outside);
        high[axis] = percentile(values, 1 - outside, outside);
    });
    Extent found{};
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        found.center[axis] = 0.5 * (low[axis] + high[axis]);
        squares += (high[axis] - low[axis]) * (high[axis] - low[axis]);
    }
    found.radius = 0.5 * std::sqrt(squares);
    return found;
}

}  // namespace

double percentile(std::vector<double>& values, double share, double lower) {
    const double last = static_cast<double>(values.size() - 1), place = share * last, below = std::floor(place),
                 part = place - below;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(below);
    std::nth_element(values.begin() + static_cast<std::ptrdiff_t>(std::floor(lower * last)), at, values.end());
    const double low = *at, high = at + 1 == values.end() ? low : *std::min_element(at + 1, values.end());
    return part >= 0.5 ? high - (high - low) * (1 - part) : low + (high - low) * part;  // exact at both ends
}

template <class T>
Extent robust_extent(const T* points, std::size_t count, int num_threads) {
    if (count == 0) return {.center = {0, 0, 0}, .radius = 1};
    Extent found = extent_of(points, count, kOutside, num_threads);
    if (!(found.radius > 0)) found = extent_of(points, count, 0.0, num_threads);
    if (!(found.radius > 0)) found.radius = 1;
    return found;
}

template <class T>
double contract(const T* point, const Extent& extent, double* place) {
    double squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        place[k] = (static_cast<double>(point[k]) - extent.center[k]) / extent.radius;
        squares += place[k] * place[k];
    }
    const double distance = std::max(std::sqrt(squares), 1.0), contraction = (2 - 1 / distance) / distance;
    for (std::size_t k = 0; k < 3; ++k) place[k] *= contraction;
    return contraction / extent.radius;
}

template Extent robust_extent<float>(const float*, std::size_t, int);
template Extent robust_extent<double>(const double*, std::size_t, int);
template double contract<float>(const float*, const Extent&, double*);
template double contract<double>(const double*, const Extent&, double*);

}  // namespace brushgs
