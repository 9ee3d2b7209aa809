#include "brushgs/visible_shares.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "brushgs/cpu.hpp"
#include "brushgs/exponentials.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/light_along.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

namespace {

using Vector = std::array<double, 3>;

// In both directions: axes and space diagonals of a cube. 13 lines change a picture by under 0.1 dB.
constexpr Vector kLines[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
constexpr std::size_t kNumLines = std::size(kLines);
constexpr double kColumn = 2.0 / 64;    // across the diameter of the scene; 32 and 128 columns prune no better
constexpr double kReach = 0.25;         // radii within which occluders count: a room does not hide what stands in it
constexpr double kFarthest = 4.0;       // radii; positions beyond are clipped, so that columns keep their width
constexpr double kLeastVisible = 1e-6;  // weights stay above zero: a cluster may consist of hidden Gaussians
constexpr double kAlmostOpaque = 0.99;  // the rasterizer's limit on alpha
constexpr std::size_t kMostAtOnce = 4;  // lines: each holds some ten numbers for each Gaussian while it works
constexpr std::size_t kPerThread = 10'000;  // Gaussians, some 0.5 ms a line

double dot(const double* a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector unit(const Vector& v) {
    const double length = std::sqrt(dot(v.data(), v));
    return {v[0] / length, v[1] / length, v[2] / length};
}

// Gaussians in the order of a space-filling curve: neighbors in memory too. Of six million each line then takes a
// third of the time.
struct Ordered {
    Buffer<std::uint32_t> rows;
    Buffer<double> points;  // [count, 3] radii from the center of the scene
    Buffer<double> depths;  // [count] optical
};

template <class T>
Ordered in_order(const VisibleShares<T>& query) {
    const auto places = make_buffer<double>(3 * query.count);
    for (std::size_t i = 0; i < 3 * query.count; ++i) {
        const double away = static_cast<double>(query.means[i]) - query.extent.center[i % 3];
        places[i] = std::clamp(away / query.extent.radius, -kFarthest, kFarthest);
    }
    Ordered found{rows_along_curve(places.get(), query.count, 3, query.num_threads),
                  make_buffer<double>(3 * query.count), make_buffer<double>(query.count)};
    for (std::size_t i = 0; i < query.count; ++i) {
        const std::size_t row = found.rows[i];
        std::copy_n(&places[3 * row], 3, &found.points[3 * i]);
        const double area = query.areas[row] / (query.extent.radius * query.extent.radius);
        // 2 pi s^2: the integral of the kernel.
        const double painted =
            2 * std::numbers::pi * static_cast<double>(query.opacities[row]) * area / (kColumn * kColumn);
        found.depths[i] = -log_of_rest(std::min(painted, kAlmostOpaque));
    }
    return found;
}

// Light that reaches each Gaussian along its column, from one end plus from the other, 0 to 2.
void light_along_line(const Vector& direction, const Ordered& ordered, std::size_t count, double* light) {
    const Vector line = unit(direction);
    Vector axis{};
    axis[static_cast<std::size_t>(std::ranges::min_element(line, {}, [](double x) { return std::abs(x); }) -
                                  line.begin())] = 1;
    const Vector across = unit(cross(line, axis)), beside = cross(line, across);
    constexpr double side = 2 * kFarthest;  // above any coordinate along any direction
    const double columns = std::ceil(2 * side / kColumn);
    const auto places = make_buffer<double>(count), from_below = make_buffer<double>(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double* point = &ordered.points[3 * i];
        const double row = std::floor((dot(point, across) + side) / kColumn);
        const double rank = std::floor((dot(point, beside) + side) / kColumn);
        // One number sorts by column, then by depth; columns are further apart than the reach.
        places[i] = (row * columns + rank) * (3 * side) + (dot(point, line) + side);
    }
    light_along({.places = places.get(),
                 .depths = ordered.depths.get(),
                 .count = count,
                 .reach = kReach,
                 .from_above = light,
                 .from_below = from_below.get()});
    for (std::size_t i = 0; i < count; ++i) light[i] = exp_of(light[i]) + exp_of(from_below[i]);
}

}  // namespace

template <class T>
void visible_shares(const VisibleShares<T>& query) {
    if (query.count == 0) return;
    const Ordered ordered = in_order(query);
    const auto most = static_cast<std::size_t>(std::max(query.num_threads, 1));
    const std::size_t at_once = std::clamp<std::size_t>(query.count / kPerThread, 1, std::min(kMostAtOnce, most));
    const auto light = make_buffer<double>(at_once * query.count), sums = make_buffer<double>(query.count);
    std::fill_n(sums.get(), query.count, 0.0);
    for (std::size_t first = 0; first < kNumLines; first += at_once) {
        const std::size_t num = std::min(at_once, kNumLines - first);
        parallel_for(num, static_cast<int>(num), [&](std::size_t i) {
            light_along_line(kLines[first + i], ordered, query.count, &light[i * query.count]);
        });
        for (std::size_t i = 0; i < num * query.count; ++i) sums[i % query.count] += light[i];
    }
    for (std::size_t i = 0; i < query.count; ++i)
        query.shares[ordered.rows[i]] = std::max(sums[i] / (2 * kNumLines), kLeastVisible);
}

template void visible_shares<float>(const VisibleShares<float>&);
template void visible_shares<double>(const VisibleShares<double>&);

}  // namespace brushgs
