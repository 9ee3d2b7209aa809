#include "brushgs/framing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "brushgs/cpu.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/subject.hpp"
#include "brushgs/view_pictures.hpp"

namespace brushgs {

namespace {

using Rows = std::vector<std::uint32_t>;

constexpr std::size_t kMostRows = 60'000;  // that are examined
constexpr std::size_t kViewsAround = 4;    // around the scene
constexpr int kFramedSide = 96;            // pixels
constexpr double kMostAround = 2;          // covered pixels around the middle over those of the middle
constexpr double kVoxels = 64;             // of the dense middle, along the diagonal of the scene
constexpr double kDenseTail = 0.015;       // share of the weight cut at each end of an axis
constexpr double kAttachedVoxels = 48;     // along the diagonal of the middle
constexpr double kFarthest = 0.35;         // longest reach of a tip, in longest sides of the middle
constexpr double kLargestSharp = 0.05;     // diagonals; larger Gaussians are haze
constexpr double kSolidVoxel = 0.06;       // painted area over that of a voxel's side
constexpr double kMostOfOne = 0.05;        // of that by one Gaussian
constexpr double kMargin = 0.05;           // empty share of the picture on each side of the subject
constexpr double kVisibleSigmas = 2;       // visible extent of a Gaussian
constexpr int kEyeSteps = 30;              // of bisection

template <class T>
Bounds subject_bounds(const SceneView<T>& scene, bool is_whole) {
    return bounds_of(scene.means, find_subject(scene.means, scene.opacities, scene.count, is_whole).rows);
}

template <class T>
double largest_scale(const SceneView<T>& scene, std::size_t row) {
    return static_cast<double>(*std::max_element(scene.scales + 3 * row, scene.scales + 3 * row + 3));
}

double diagonal(const Bounds& box) {
    return std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
}

double longest(const Bounds& box) {
    double side = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) side = std::max(side, box.high[axis] - box.low[axis]);
    return side;
}

template <class T>
Rows rows_within(const SceneView<T>& scene, const Bounds& box) {
    Rows rows;
    for (std::size_t row = 0; row < scene.count; ++row)
        if (box.holds(scene.means + 3 * row)) rows.push_back(static_cast<std::uint32_t>(row));
    return rows;
}

std::size_t covered(const ViewSample& sample, const Axes& axes) {
    const std::vector<float> shades(sample.count);
    return paint_shades(sample, {axes, kFramedSide}, shades, shades).num_seen;
}

// Voxels around the middle of an object.
class Voxels {
public:
    explicit Voxels(const Bounds& middle)
        : border_(kFarthest * longest(middle)), size_(diagonal(middle) / kAttachedVoxels) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            origin_[axis] = middle.low[axis] - border_;
            const double width = middle.high[axis] - middle.low[axis] + 2 * border_;
            shape_[axis] = static_cast<std::size_t>(std::floor(width / size_)) + 1;
            first_[axis] = cell(middle.low[axis], axis), last_[axis] = cell(middle.high[axis], axis);
        }
        paint_.resize(shape_[0] * shape_[1] * shape_[2]);
    }

    double border() const { return border_; }
    std::size_t count() const { return paint_.size(); }

    template <class T>
    std::size_t key(const T* point) const {
        std::size_t key = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            key = key * shape_[axis] + cell(static_cast<double>(point[axis]), axis);
        return key;
    }

    void add(std::size_t key, double area) { paint_[key] += std::min(area / (size_ * size_), kMostOfOne); }

    // Whether each is reached from the middle over faces, edges and corners of voxels with paint.
    std::vector<std::uint8_t> reached() const {
        std::vector<std::uint8_t> is_reached(count());
        std::vector<std::array<std::size_t, 3>> open;
        const auto reach = [&](const std::array<std::size_t, 3>& at) {
            auto& mark = is_reached[(at[0] * shape_[1] + at[1]) * shape_[2] + at[2]];
            if (mark == 0) open.push_back(at);
            mark = 1;
        };
        for (std::size_t x = first_[0]; x <= last_[0]; ++x)
            for (std::size_t y = first_[1]; y <= last_[1]; ++y)
                for (std::size_t z = first_[2]; z <= last_[2]; ++z) reach({x, y, z});
        while (!open.empty()) {
            const auto from = open.back();
            open.pop_back();
            for (std::size_t i = 0; i < 27; ++i) {
                const std::array steps{i / 9, i / 3 % 3, i % 3};
                std::array<std::size_t, 3> at;
                bool is_inside = true;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    at[axis] = from[axis] + steps[axis] - 1;  // of a border wraps around, which is outside
                    is_inside = is_inside && at[axis] < shape_[axis];
                }
                if (is_inside && paint_[(at[0] * shape_[1] + at[1]) * shape_[2] + at[2]] >= kSolidVoxel) reach(at);
            }
        }
        return is_reached;
    }

private:
    double border_, size_, origin_[3]{};
    std::size_t shape_[3]{}, first_[3]{}, last_[3]{};
    std::vector<double> paint_;

    std::size_t cell(double place, std::size_t axis) const {
        const double steps = std::floor((place - origin_[axis]) / size_);
        return std::min(static_cast<std::size_t>(std::max(steps, 0.0)), shape_[axis] - 1);
    }
};

// Coordinate of the eye at which the outermost points are equally far from the middle of the picture: the sum of the
// two outermost slopes decreases with it.
double middle_place(const double* points, std::size_t count, std::size_t axis, double eye_z) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < count; ++i)
        low = std::min(low, points[3 * i + axis]), high = std::max(high, points[3 * i + axis]);
    for (int step = 0; step < kEyeSteps; ++step) {
        const double eye = 0.5 * (low + high);
        double least = std::numeric_limits<double>::infinity(), most = -least;
        for (std::size_t i = 0; i < count; ++i) {
            const double depth = points[3 * i + 2] - eye_z, slope = points[3 * i + axis] / depth - eye * (1 / depth);
            least = std::min(least, slope), most = std::max(most, slope);
        }
        (most + least > 0 ? low : high) = eye;
    }
    return 0.5 * (low + high);
}

// The points widened by the extent of Gaussians, if that is more than a margin: one Gaussian, or dots along a line.
void widen(std::vector<double>& points, const SceneView<float>& scene) {
    std::vector<double> sizes(scene.count);
    for (std::size_t row = 0; row < scene.count; ++row) sizes[row] = largest_scale(scene, row);
    const double reach = kVisibleSigmas * percentile(sizes, 0.5);
    Rows all(points.size() / 3);
    std::iota(all.begin(), all.end(), 0U);
    if (reach <= kMargin * longest(bounds_of(points.data(), all))) return;
    std::vector<double> wide;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        for (std::size_t way = 0; way < 6; ++way) {
            std::array place{points[i], points[i + 1], points[i + 2]};
            place[way / 2] += way % 2 == 0 ? reach : -reach;
            wide.insert(wide.end(), place.begin(), place.end());
        }
    }
    points = std::move(wide);
}

}  // namespace

template <class T>
Bounds bounds_of(const T* points, const std::vector<std::uint32_t>& rows) {
    constexpr double far = std::numeric_limits<double>::infinity();
    Bounds box{{far, far, far}, {-far, -far, -far}};
    for (const std::uint32_t row : rows) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto place = static_cast<double>(points[3 * std::size_t{row} + axis]);
            box.low[axis] = std::min(box.low[axis], place), box.high[axis] = std::max(box.high[axis], place);
        }
    }
    return box;
}

template <class T>
bool has_surroundings(const SceneView<T>& scene, const double* level, int num_threads) {
    const Subject middle = find_subject(scene.means, scene.opacities, scene.count, false);
    if (!middle.has_surroundings) return false;
    const Bounds whole = subject_bounds(scene, true), inner = bounds_of(scene.means, middle.rows);
    ViewSample all;
    for (std::size_t axis = 0; axis < 3; ++axis) all.center[axis] = 0.5 * (whole.low[axis] + whole.high[axis]);
    all.radius = 0.5 * diagonal(whole);
    ViewSample part = all;
    const Rows rows = thinned(scene.count, kMostRows);
    const double growth = std::sqrt(static_cast<double>(scene.count) / static_cast<double>(rows.size()));
    for (const std::uint32_t row : rows) {
        add_row(scene, row, growth, all);
        if (inner.holds(scene.means + 3 * std::size_t{row})) add_row(scene, row, growth, part);
    }
    std::vector<double> ratios(kViewsAround);
    parallel_for(kViewsAround, num_threads, [&](std::size_t view) {
        const double azimuth = 2 * std::numbers::pi * static_cast<double>(view) / static_cast<double>(kViewsAround);
        const Axes axes = axes_around(level, azimuth, kElevation);
        const auto of_all = static_cast<double>(covered(all, axes)), of_part = static_cast<double>(covered(part, axes));
        ratios[view] = (of_all - of_part) / std::max(of_part, 1.0);
    });
    return percentile(ratios, 0.5) > kMostAround;
}

template <class T>
std::vector<std::uint32_t> dense_rows(const SceneView<T>& scene) {
    const Bounds whole = subject_bounds(scene, true);
    const Rows inside = rows_within(scene, whole);
    const Rows rows = taken_from(inside.data(), 1, thinned(inside.size(), kMostRows));
    const double voxel = std::max(diagonal(whole) / kVoxels, 1e-300);
    std::array<std::vector<double>, 3> places;
    std::vector<std::uint64_t> keys(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            places[axis].push_back(static_cast<double>(scene.means[3 * std::size_t{rows[i]} + axis]));
            const double cell = std::floor((places[axis][i] - whole.low[axis]) / voxel);
            keys[i] = keys[i] * static_cast<std::uint64_t>(kVoxels + 1) + static_cast<std::uint64_t>(cell);
        }
    }
    std::vector<std::uint64_t> sorted = keys;
    std::ranges::sort(sorted);
    std::vector<double> weights(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), keys[i]);
        weights[i] = static_cast<double>(scene.opacities[rows[i]]) * static_cast<double>(last - first);
    }
    constexpr std::array<double, 2> at{kDenseTail, 1 - kDenseTail};
    Bounds middle;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto ends = weighted_quantiles(places[axis], weights, at);
        middle.low[axis] = ends[0], middle.high[axis] = ends[1];
    }
    Rows found;
    for (const std::uint32_t row : rows)
        if (middle.holds(scene.means + 3 * std::size_t{row})) found.push_back(row);
    return found;
}

template <class T>
std::vector<std::uint32_t> attached_rows(const SceneView<T>& scene, const Bounds& middle) {
    const double size = diagonal(middle);
    if (!(size > 0)) return {};
    Voxels voxels(middle);
    Bounds near = middle;
    for (std::size_t axis = 0; axis < 3; ++axis) near.low[axis] -= voxels.border(), near.high[axis] += voxels.border();
    Rows rows;
    for (const std::uint32_t row : rows_within(scene, near))
        if (!middle.holds(scene.means + 3 * std::size_t{row}) && largest_scale(scene, row) < kLargestSharp * size)
            rows.push_back(row);
    const std::vector<T> scales = taken_from(scene.scales, 3, rows);
    std::vector<double> areas(rows.size());
    projected_areas(scales.data(), rows.size(), 0.0, 1, areas.data());
    std::vector<std::size_t> keys;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        keys.push_back(voxels.key(scene.means + 3 * std::size_t{rows[i]}));
        voxels.add(keys[i], 2 * std::numbers::pi * static_cast<double>(scene.opacities[rows[i]]) * areas[i]);
    }
    const auto is_reached = voxels.reached();
    Rows found;
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (is_reached[keys[i]] != 0) found.push_back(rows[i]);
    return found;
}

Framed framed_points(const SceneView<float>& scene, const double* level) {
    Framed framed{{}, has_surroundings(scene, level)};
    Rows rows;
    if (framed.has_surroundings) {
        rows = dense_rows(scene);
    } else {
        rows = find_subject(scene.means, scene.opacities, scene.count, true).rows;
        const Rows more = attached_rows(scene, bounds_of(scene.means, rows));
        rows.insert(rows.end(), more.begin(), more.end());
    }
    const std::vector<float> means = taken_from(scene.means, 3, rows);
    framed.points.assign(means.begin(), means.end());
    if (!rows.empty()) widen(framed.points, scene);
    return framed;
}

Eye fit_eye(const double* points, std::size_t count, const double* tangents) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    double most[2][2]{{-inf, -inf}, {-inf, -inf}}, low[3]{inf, inf, inf}, high[3]{-inf, -inf, -inf}, far = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double* const point = points + 3 * i;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], point[axis]), high[axis] = std::max(high[axis], point[axis]);
            far = std::max(far, std::abs(point[axis]));
        }
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double slope = tangents[axis] * (1 - 2 * kMargin) * point[2];
            most[axis][0] = std::max(most[axis][0], point[axis] - slope);
            most[axis][1] = std::max(most[axis][1], -point[axis] - slope);
        }
    }
    double size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-6 * far});
    if (size == 0) size = 1e-9;  // all at the origin
    const double middle = 0.5 * (low[2] + high[2]);
    // A very wide lens could fit the points from between them: the eye stays in front of the nearest.
    double eye_z = std::min(middle - 0.5 * size, low[2] - 0.05 * size);
    for (std::size_t axis = 0; axis < 2; ++axis)
        eye_z = std::min(eye_z, -(most[axis][0] + most[axis][1]) / (2 * (tangents[axis] * (1 - 2 * kMargin))));
    return {{middle_place(points, count, 0, eye_z), middle_place(points, count, 1, eye_z), eye_z}, middle - eye_z};
}

template Bounds bounds_of<float>(const float*, const std::vector<std::uint32_t>&);
template bool has_surroundings<float>(const SceneView<float>&, const double*, int);
template bool has_surroundings<double>(const SceneView<double>&, const double*, int);
template std::vector<std::uint32_t> dense_rows<float>(const SceneView<float>&);
template std::vector<std::uint32_t> dense_rows<double>(const SceneView<double>&);
template std::vector<std::uint32_t> attached_rows<float>(const SceneView<float>&, const Bounds&);
template std::vector<std::uint32_t> attached_rows<double>(const SceneView<double>&, const Bounds&);

}  // namespace brushgs
