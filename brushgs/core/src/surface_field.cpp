// The direction of strokes by the Gaussians around each: lines of constant color, and the surface's extent.
//
// Gaussians are finer than strokes, so they show edges that strokes cross. The unit of length is the distance of the
// farthest neighbor, whose weight is zero: the result depends neither on unit and position of the scene, nor on the
// choice between equally far neighbors.
#include "brushgs/surface_field.hpp"

#include <algorithm>
#include <limits>

#include "brushgs/colors.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/pairs.hpp"
#include "brushgs/row_loop.hpp"
#include "brushgs/rows.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

constexpr std::size_t kFieldsPerItem = 256;
constexpr std::size_t kFieldNeighbors = 20;
constexpr double kSurface =
    0.6;  // share of the Gaussians used, those with the most paint: the others are mostly hidden
constexpr double kFarthest = 1e6;  // scene radii; larger distances are clipped
// Step of color across a stroke with weight 1/2, CIELAB / 100: 3 units are just visible side by side.
constexpr double kHalfStep = 0.03;
constexpr double kFlatness = 0.02;            // of the spread of neighbors, added to it: against neighbors on a line
constexpr double kElongated[2] = {0.5, 0.9};  // 1 - smaller / larger spread of elongated neighbors; 0.4 by chance
constexpr double kLeastSpread = 1e-12;        // squared distances of the farthest neighbor

// Of the Gaussians of the surface. Positions are in scene radii from the center.
struct Points {
    Extent extent;
    std::vector<std::uint32_t> rows;  // of the Gaussians
    Doubles places;                   // [rows, 3]
    Doubles shares;                   // [rows] root of their paint over that of the largest
    Doubles colors;                   // [rows, 3] CIELAB / 100 of those that are near strokes

    template <class T>
    void put(const T* mean, double* place) const {
        for (std::size_t k = 0; k < 3; ++k) {
            const double at = (static_cast<double>(mean[k]) - extent.center[k]) / extent.radius;
            place[k] = std::clamp(at, -kFarthest, kFarthest);
        }
    }
};

template <class T>
Points points_of(const SurfaceQuery<T>& gaussians, int num_threads) {
    const std::size_t count = gaussians.count;
    const Doubles paint = paint_of(gaussians.scales, gaussians.opacities, count, num_threads);
    Doubles ranked = paint;
    const auto rank = static_cast<std::ptrdiff_t>((1 - kSurface) * static_cast<double>(count));
    std::ranges::nth_element(ranked, ranked.begin() + rank);
    const double least = ranked[static_cast<std::size_t>(rank)];
    const double most = std::max(*std::ranges::max_element(paint), std::numeric_limits<double>::min());
    Points points{.extent = robust_extent(gaussians.means, count, num_threads),
                  .rows = {},
                  .places = {},
                  .shares = {},
                  .colors = {}};
    for (std::size_t i = 0; i < count; ++i) {
        if (!(paint[i] >= least)) continue;
        points.rows.push_back(static_cast<std::uint32_t>(i));
        points.shares.push_back(std::sqrt(paint[i] / most));
    }
    points.places.resize(3 * points.rows.size());
    for (std::size_t i = 0; i < points.rows.size(); ++i)
        points.put(gaussians.means + 3 * points.rows[i], &points.places[3 * i]);
    return points;
}

template <class T>
void find_colors(const SurfaceQuery<T>& gaussians, const std::vector<std::int32_t>& found, int num_threads,
                 Points& points) {
    std::vector<std::uint8_t> is_used(points.rows.size());
    for (const std::int32_t row : found) is_used[static_cast<std::size_t>(row)] = 1;
    points.colors.resize(3 * points.rows.size());
    for_each_row(points.rows.size(), kFieldsPerItem, num_threads, [&](std::size_t i) {
        if (is_used[i] == 0) return;
        const T* const sh = gaussians.sh + 3 * gaussians.sh_terms * points.rows[i];
        std::ranges::copy(cielab_of(sh, gaussians.xyz_over_white), &points.colors[3 * i]);
    });
}

// The Gaussians around one stroke: weights of sum 1 or 0, offsets and colors from their weighted means.
struct Near {
    double weights[kFieldNeighbors], offsets[kFieldNeighbors][3], colors[kFieldNeighbors][3];
    std::size_t count;

    void center(double (&values)[kFieldNeighbors][3]) const {
        double mean[3] = {};
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < 3; ++k) mean[k] += weights[j] * values[j][k];
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < 3; ++k) values[j][k] -= mean[k];
    }
};

Near near_of(const Points& points, const double* place, const double* distances, const std::int32_t* found,
             std::size_t count, double reach) {
    Near near;
    near.count = count;
    double total = 0;
    for (std::size_t j = 0; j < count; ++j) {
        const auto row = static_cast<std::size_t>(found[j]);
        const double part = distances[j] / reach, rest = 1 - part * part;
        near.weights[j] = rest * rest * points.shares[row];
        total += near.weights[j];
        for (std::size_t k = 0; k < 3; ++k) {
            near.offsets[j][k] = (points.places[3 * row + k] - place[k]) / reach;
            near.colors[j][k] = points.colors[3 * row + k];
        }
    }
    for (std::size_t j = 0; j < count; ++j) near.weights[j] /= total > 0 ? total : 1;
    near.center(near.offsets);
    near.center(near.colors);
    return near;
}

// Weighted moments in the plane of a stroke, and across it, of places and colors.
struct Moments {
    double xx = 0, xy = 0, yy = 0, zz = 0, sides[2][3] = {};

    Moments(const StrokePlane& plane, const Near& near) {
        for (std::size_t j = 0; j < near.count; ++j) {
            const double x = dot(plane.along, near.offsets[j]), y = dot(plane.across, near.offsets[j]);
            const double z = dot(plane.normal, near.offsets[j]), weight = near.weights[j];
            xx += weight * x * x, xy += weight * x * y, yy += weight * y * y, zz += weight * z * z;
            for (std::size_t k = 0; k < 3; ++k) {
                sides[0][k] += weight * x * near.colors[j][k];
                sides[1][k] += weight * y * near.colors[j][k];
            }
        }
    }

    // The direction in which the color changes most, and the square of its slope minus that across.
    Pair change() const {
        const double more = kFlatness * (xx + yy) + kLeastSpread, wide = xx + more, high = yy + more;
        const double determinant = wide * high - xy * xy;
        double products[3] = {};
        for (std::size_t k = 0; k < 3; ++k) {
            const double x = (high * sides[0][k] - xy * sides[1][k]) / determinant;
            const double y = (wide * sides[1][k] - xy * sides[0][k]) / determinant;
            products[0] += x * x, products[1] += x * y, products[2] += y * y;
        }
        return pair_of(products[0], products[1], products[2]);
    }
};

}  // namespace

template <class T>
SurfaceField surface_field(const std::vector<StrokePlane>& planes, const SurfaceQuery<T>& gaussians, int num_threads) {
    const std::size_t count = planes.size();
    Points points = points_of(gaussians, num_threads);
    const std::size_t num_near = std::min(kFieldNeighbors, points.rows.size());
    Doubles places(3 * count), distances(num_near * count);
    std::vector<std::int32_t> found(num_near * count);
    for (std::size_t i = 0; i < count; ++i) points.put(planes[i].mean, &places[3 * i]);
    find_several({points.places.data(), places.data(), points.rows.size(), count, num_near, 3, num_threads},
                 distances.data(), found.data());
    find_colors(gaussians, found, num_threads, points);
    SurfaceField field{std::vector<Pair>(count), std::vector<Pair>(count)};
    for_each_row(count, kFieldsPerItem, num_threads, [&](std::size_t i) {
        const double farthest = distances[num_near * (i + 1) - 1], reach = farthest > 0 ? farthest : 1;
        const Near near =
            near_of(points, &places[3 * i], &distances[num_near * i], &found[num_near * i], num_near, reach);
        const Moments moments(planes[i], near);
        const UnitPair change(moments.change());
        const double size = std::min(planes[i].size / (reach * points.extent.radius), kFarthest);
        const double step = std::sqrt(change.weight) * size;  // of color, across the stroke
        const double say = step / (step + kHalfStep);
        field.color[i] = {-change.pair.x * say, -change.pair.y * say};
        const UnitPair extent(pair_of(moments.xx, moments.xy, moments.yy));
        const double sum = moments.xx + moments.yy;
        const double widest = 0.5 * (sum + extent.weight), narrow = 0.5 * (sum - extent.weight);
        const double is_long = ramp(extent.weight / std::max(widest, kLeastSpread), kElongated[0], kElongated[1]);
        const double is_flat = 1 - std::min(moments.zz / std::max(narrow, kLeastSpread), 1.0);
        field.extent[i] = {extent.pair.x * is_long * is_flat, extent.pair.y * is_long * is_flat};
    });
    return field;
}

template SurfaceField surface_field<float>(const std::vector<StrokePlane>&, const SurfaceQuery<float>&, int);
template SurfaceField surface_field<double>(const std::vector<StrokePlane>&, const SurfaceQuery<double>&, int);

}  // namespace brushgs
