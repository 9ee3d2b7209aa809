#include "brushgs/scene_strokes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "brushgs/coverage.hpp"
#include "brushgs/groups.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/light_along.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"

namespace brushgs {

namespace {

using Rows = Buffer<std::uint32_t>;
using Doubles = std::vector<double>;

constexpr double kC0 = 0.28209479177387814;

// passes/finest.py
constexpr double kLowPass = 0.3, kRows = 720, kDistance = 2.4, kFovY = 50.0 / 180.0 * std::numbers::pi;
// passes/reduce/contribution.py
constexpr double kReach = 0.25, kFarthest = 4.0, kLeastVisible = 1e-6, kAlmostOpaque = 0.99, kColumn = 2.0 / 64;
constexpr double kLines[7][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
// passes/reduce/cluster.py, detail.py, features.py, lloyd.py
constexpr double kContributionPower = 0.375, kLeastDetail = 0.01, kMostDetail = 0.1, kColorWeight = 0.07;
constexpr std::size_t kDetailNeighbors = 16, kDimensions = 9;
constexpr int kSteps = 20;
constexpr double kGain = 1e-3;
// passes/reduce/merge.py, passes/form/gaps.py
constexpr double kOverlap = 1.35, kTouch = 20.0, kCurled = 0.2, kPlane = 1.2;
constexpr std::size_t kNeighbors = 12, kTouching = 8;
constexpr double kEnoughTouching = 4, kAlone[2] = {0.4, 0.8}, kFlat[2] = {0.9, 0.98};

double percentile(Doubles& values, double share) {
    const double place = share * static_cast<double>(values.size() - 1), low = std::floor(place), t = place - low;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(low);
    std::nth_element(values.begin(), at, values.end());
    const double a = *at, b = at + 1 == values.end() ? a : *std::min_element(at + 1, values.end());
    return t >= 0.5 ? b - (b - a) * (1 - t) : a + (b - a) * t;
}

double finest_of(double radius) { return std::sqrt(kLowPass) * 2 * std::tan(0.5 * kFovY) * kDistance * radius / kRows; }

// Scales as they are visible in pictures, see passes/finest.py.
template <class T>
Doubles seen_scales(const T* scales, std::size_t count, double finest) {
    Doubles seen(scales, scales + 3 * count);
    for (std::size_t row = 0; row < count; ++row) {
        std::array<std::size_t, 3> order{3 * row, 3 * row + 1, 3 * row + 2};
        std::ranges::sort(order, {}, [&](std::size_t i) { return seen[i]; });
        const double thin = seen[order[0]], middle = seen[order[1]];
        if (middle >= finest) continue;
        seen[order[0]] = std::max(thin, finest - middle);
        seen[order[1]] = finest;
        seen[order[2]] = std::max(seen[order[2]], finest);
    }
    return seen;
}

Doubles areas_of(const Doubles& scales) {
    Doubles areas(scales.size() / 3);
    projected_areas(scales.data(), areas.size(), 1, areas.data());
    return areas;
}

std::array<double, 3> cross(const double* a, const double* b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::array<double, 3> unit(std::array<double, 3> v) {
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return {v[0] / length, v[1] / length, v[2] / length};
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Adds the light that reaches each point along one line, from both ends.
void add_light(const double* direction, const Doubles& points, const Doubles& depths, Doubles& light) {
    const auto line = unit({direction[0], direction[1], direction[2]});
    std::size_t least = 0;
    for (std::size_t i = 1; i < 3; ++i) least = std::abs(line[i]) < std::abs(line[least]) ? i : least;
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    const auto across = unit(cross(line.data(), axis)), beside = cross(line.data(), across.data());
    const std::size_t count = depths.size();
    const double side = 2 * kFarthest, columns = std::ceil(2 * side / kColumn);
    Doubles place(count), above(count), below(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double* point = points.data() + 3 * i;
        const double row = std::floor((dot(point, across.data()) + side) / kColumn);
        const double rank = std::floor((dot(point, beside.data()) + side) / kColumn);
        place[i] = (row * columns + rank) * (3 * side) + (dot(point, line.data()) + side);
    }
    light_along({place.data(), depths.data(), count, kReach, above.data(), below.data()});
    for (std::size_t i = 0; i < count; ++i) light[i] += std::exp(above[i]) + std::exp(below[i]);
}

Doubles visible_shares(const SceneGaussians& scene, const Extent& extent, const Doubles& areas) {
    Doubles placed(3 * scene.count);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const double away = (static_cast<double>(scene.means[i]) - extent.center[i % 3]) / extent.radius;
        placed[i] = std::clamp(away, -kFarthest, kFarthest);
    }
    const Rows order = rows_along_curve(placed.data(), scene.count, 3, 1);
    Doubles points(placed.size()), depths(scene.count), light(scene.count), shares(scene.count);
    for (std::size_t i = 0; i < scene.count; ++i) {
        const std::size_t row = order[i];
        std::copy_n(placed.data() + 3 * row, 3, points.data() + 3 * i);
        const double painted = 2 * std::numbers::pi * static_cast<double>(scene.opacities[row]) *
                               (areas[row] / (extent.radius * extent.radius)) / (kColumn * kColumn);
        depths[i] = -std::log1p(-std::min(painted, kAlmostOpaque));
    }
    for (const auto& line : kLines) add_light(line, points, depths, light);
    for (std::size_t i = 0; i < scene.count; ++i) shares[order[i]] = std::max(light[i] / 14, kLeastVisible);
    return shares;
}

double base_color(const SceneGaussians& scene, std::size_t row, std::size_t channel) {
    const double coefficient = static_cast<double>(scene.sh[3 * scene.sh_terms * row + channel]);
    return std::clamp(0.5 + kC0 * coefficient, 0.0, 1.0);
}

struct Features {
    std::vector<float> points;  // [count, kDimensions]
    Doubles places;             // [count, 3] contracted
};

Features features_of(const SceneGaussians& scene, const Extent& extent) {
    Features found{std::vector<float>(kDimensions * scene.count), Doubles(3 * scene.count)};
    for (std::size_t row = 0; row < scene.count; ++row) {
        double away[3], square = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            away[i] = (static_cast<double>(scene.means[3 * row + i]) - extent.center[i]) / extent.radius;
            square += away[i] * away[i];
        }
        const double distance = std::max(std::sqrt(square), 1.0), contraction = (2 - 1 / distance) / distance;
        float* point = found.points.data() + kDimensions * row;
        for (std::size_t i = 0; i < 3; ++i) {
            found.places[3 * row + i] = away[i] * contraction;
            const double scale = static_cast<double>(scene.scales[3 * row + i]) * (contraction / extent.radius);
            point[i] = static_cast<float>(away[i] * contraction);
            point[3 + i] = static_cast<float>(std::min(scale, 2.0));
            point[6 + i] = static_cast<float>(kColorWeight * base_color(scene, row, i));
        }
    }
    return found;
}

Doubles color_detail(const SceneGaussians& scene, const Doubles& places) {
    const Rows order = rows_along_curve(places.data(), scene.count, 3, 1);
    Doubles detail(scene.count);
    for (std::size_t start = 0; start < scene.count;) {
        const std::size_t left = scene.count - start;
        const std::size_t size = left < 2 * kDetailNeighbors ? left : kDetailNeighbors;  // the last holds the rest too
        double mean[3] = {0, 0, 0}, squares = 0;
        for (std::size_t i = start; i < start + size; ++i) {
            for (std::size_t c = 0; c < 3; ++c) mean[c] += base_color(scene, order[i], c) / static_cast<double>(size);
        }
        for (std::size_t i = start; i < start + size; ++i) {
            for (std::size_t c = 0; c < 3; ++c) squares += std::pow(base_color(scene, order[i], c) - mean[c], 2);
        }
        const double deviation = std::sqrt(squares / static_cast<double>(size));
        for (std::size_t i = start; i < start + size; ++i) detail[order[i]] = deviation;
        start += size;
    }
    return detail;
}

Doubles cluster_weights(const SceneGaussians& scene, const Doubles& areas, const Doubles& visible,
                        const Doubles& places) {
    Doubles weights = color_detail(scene, places);
    for (std::size_t i = 0; i < scene.count; ++i) {
        const double contribution = static_cast<double>(scene.opacities[i]) * areas[i] * visible[i];
        weights[i] = std::pow(contribution, kContributionPower) * (kLeastDetail + std::min(weights[i], kMostDetail));
    }
    const double largest = *std::ranges::max_element(weights);
    for (double& weight : weights) weight = largest > 0 ? std::max(weight / largest, 1e-9) : 1.0;
    return weights;
}

struct Members {
    const std::int32_t* labels;
    std::size_t num_groups;
    std::vector<std::int32_t> rows;
    std::vector<std::int64_t> begins;
};

// Weights over their sum by group; equal weights if that sum is zero.
Doubles shares_by_group(Doubles weights, const Members& members) {
    Doubles totals(members.num_groups);
    const auto label = [&](std::size_t row) { return static_cast<std::size_t>(members.labels[row]); };
    for (std::size_t row = 0; row < weights.size(); ++row) totals[label(row)] += weights[row];
    for (std::size_t group = 0; group < members.num_groups; ++group) {
        if (totals[group] != 0) continue;
        for (auto i = members.begins[group]; i < members.begins[group + 1]; ++i) {
            weights[static_cast<std::size_t>(members.rows[static_cast<std::size_t>(i)])] = 1;
            totals[group] += 1;
        }
    }
    for (std::size_t row = 0; row < weights.size(); ++row) weights[row] /= totals[label(row)];
    return weights;
}

Doubles sums_of(const float* values, std::size_t width, const Doubles& shares, const Members& members) {
    Doubles totals(members.num_groups), sums(members.num_groups * width);
    sum_groups<float>({values, shares.data(), members.rows.data(), members.begins.data(), members.num_groups, width, 1,
                       totals.data(), sums.data()});
    return sums;
}

double ramp(double value, const double* ends) { return std::clamp((value - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0); }

// Growth of the variance of each stroke along its layer, see passes/form/gaps.py.
Doubles growth_of(const Doubles& means, const Doubles& scales, const Doubles& axes, const Doubles& opacities) {
    const std::size_t count = opacities.size(), num = std::min(kNeighbors, count - 1);
    std::vector<std::int32_t> neighbors(count * num);
    if (num > 0) find_neighbors({means.data(), count, num, 3, 1}, neighbors.data());
    std::vector<std::int64_t> rows(count);
    for (std::size_t i = 0; i < count; ++i) rows[i] = static_cast<std::int64_t>(i);
    Doubles passed(count), touching(count), parallel(count), growth(count);
    cover({means.data(), scales.data(), axes.data(), opacities.data(), rows.data(), neighbors.data(), count, num,
           std::min(kTouching, num), kTouch, 1, passed.data(), touching.data(), parallel.data()});
    for (std::size_t i = 0; i < count; ++i) {
        const double flat = ramp(parallel[i] / std::max(touching[i], 1.0), kFlat);
        growth[i] = (kCurled + (kPlane - kCurled) * flat) * std::min(touching[i] / kEnoughTouching, 1.0) *
                    ramp(opacities[i] * passed[i], kAlone);
    }
    return growth;
}

// The unit quaternion of a rotation matrix, by the largest of four formulas (Shepperd 1978).
std::array<double, 4> quat_of(const double* m) {
    const double wx = m[7] - m[5], wy = m[2] - m[6], wz = m[3] - m[1];
    const double xy = m[1] + m[3], xz = m[2] + m[6], yz = m[5] + m[7];
    const double rows[4][4] = {{1 + m[0] + m[4] + m[8], wx, wy, wz},
                               {wx, 1 + m[0] - m[4] - m[8], xy, xz},
                               {wy, xy, 1 - m[0] + m[4] - m[8], yz},
                               {wz, xz, yz, 1 - m[0] - m[4] + m[8]}};
    std::size_t largest = 0;
    for (std::size_t i = 1; i < 4; ++i) largest = rows[i][i] > rows[largest][largest] ? i : largest;
    std::array<double, 4> quat{};
    double square = 0;
    for (std::size_t i = 0; i < 4; ++i) square += rows[largest][i] * rows[largest][i];
    for (std::size_t i = 0; i < 4; ++i) quat[i] = rows[largest][i] / std::sqrt(square);
    return quat;
}

void append(std::vector<float>& column, const double* values, std::size_t width) {
    constexpr double largest = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < width; ++i) column.push_back(static_cast<float>(std::min(values[i], largest)));
}

// The shapes of the strokes: covariances by the law of total variance, larger where a layer would leave gaps.
struct Shapes {
    Doubles scales, axes, opacities;
};

Shapes shapes_of(const SceneGaussians& scene, const Members& members, const Doubles& shares, const Doubles& means,
                 const Doubles& areas, double finest) {
    const std::size_t num = members.num_groups;
    Doubles within(9 * num), between(9 * num), covariances(9 * num);
    sum_covariances<float>({scene.means, scene.quats, scene.scales, shares.data(), members.rows.data(),
                            members.begins.data(), means.data(), num, 1, within.data(), between.data()});
    Shapes found{Doubles(3 * num), Doubles(9 * num), Doubles(num)};
    const auto spread = [&](auto factor) {
        for (std::size_t i = 0; i < 9 * num; ++i) covariances[i] = within[i] + factor(i / 9) * between[i];
        principal_axes(covariances.data(), num, 1, found.scales.data(), found.axes.data());
    };
    spread([](std::size_t) { return 1.0; });
    const Doubles footprints = areas_of(seen_scales(found.scales.data(), num, finest));
    stop_groups<float>({scene.opacities, areas.data(), footprints.data(), members.rows.data(), members.begins.data(),
                        num, 1, found.opacities.data()});
    spread([](std::size_t) { return kOverlap; });
    const Doubles more = growth_of(means, seen_scales(found.scales.data(), num, finest), found.axes, found.opacities);
    spread([&](std::size_t group) { return kOverlap + more[group]; });
    return found;
}

SceneStrokes merge_members(const SceneGaussians& scene, const Members& members, const Doubles& areas,
                           const Doubles& visible, double finest) {
    const std::size_t width = 3 * scene.sh_terms;
    Doubles paint(scene.count);
    for (std::size_t i = 0; i < scene.count; ++i) paint[i] = static_cast<double>(scene.opacities[i]) * areas[i];
    const Doubles shares = shares_by_group(paint, members);
    const Doubles means = sums_of(scene.means, 3, shares, members);
    const Shapes shapes = shapes_of(scene, members, shares, means, areas, finest);
    Doubles seen(scene.count);
    for (std::size_t i = 0; i < scene.count; ++i) seen[i] = shares[i] * visible[i];
    const Doubles sh = sums_of(scene.sh, width, shares_by_group(seen, members), members);
    SceneStrokes out;
    out.count = members.num_groups;
    out.sh_terms = scene.sh_terms;
    for (std::size_t group = 0; group < members.num_groups; ++group) {
        const auto begin = static_cast<std::size_t>(members.begins[group]);
        if (members.begins[group + 1] - members.begins[group] == 1) {  // a lone Gaussian stays as it is
            const auto row = static_cast<std::size_t>(members.rows[begin]);
            const auto copy = [row](std::vector<float>& column, const float* values, std::size_t size) {
                column.insert(column.end(), values + size * row, values + size * (row + 1));
            };
            copy(out.means, scene.means, 3);
            copy(out.quats, scene.quats, 4);
            copy(out.scales, scene.scales, 3);
            copy(out.opacities, scene.opacities, 1);
            copy(out.sh, scene.sh, width);
            continue;
        }
        append(out.means, means.data() + 3 * group, 3);
        append(out.quats, quat_of(shapes.axes.data() + 9 * group).data(), 4);
        append(out.scales, shapes.scales.data() + 3 * group, 3);
        append(out.opacities, shapes.opacities.data() + group, 1);
        append(out.sh, sh.data() + width * group, width);
    }
    return out;
}

}  // namespace

Extent robust_extent(const float* means, std::size_t count) {
    const auto box = [&](double low_share, double high_share) {
        Extent extent{};
        double square = 0;
        Doubles values(count);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(means[3 * i + axis]);
            const double low = percentile(values, low_share), high = percentile(values, high_share);
            extent.center[axis] = 0.5 * (low + high);
            square += (high - low) * (high - low);
        }
        extent.radius = 0.5 * std::sqrt(square);
        return extent;
    };
    Extent extent = box(0.01, 0.99);
    if (!(extent.radius > 0)) extent = box(0, 1);
    if (!(extent.radius > 0)) extent.radius = 1;
    return extent;
}

Reach reach_in(const PictureView& view, const float* means, std::size_t count) {
    constexpr double within = 0.98;
    Doubles across, down;
    for (std::size_t i = 0; i < count; ++i) {
        double seen[3];
        for (std::size_t row = 0; row < 3; ++row) {
            const double* m = view.viewmat + 4 * row;
            seen[row] = m[3];
            for (std::size_t k = 0; k < 3; ++k) seen[row] += m[k] * static_cast<double>(means[3 * i + k]);
        }
        if (seen[2] <= view.near) continue;
        across.push_back(std::abs(view.fx * seen[0] / seen[2]));
        down.push_back(std::abs(view.fy * seen[1] / seen[2]));
    }
    if (across.empty() || 2 * across.size() < count) return {};
    return {std::max(std::min(percentile(across, within), view.width / 2), 1.0),
            std::max(std::min(percentile(down, within), view.height / 2), 1.0)};
}

SceneStrokes strokes_of_scene(const SceneGaussians& scene, std::size_t num_strokes, const double* draws,
                              void (*tell)(double share)) {
    const std::size_t width = 3 * scene.sh_terms;
    if (scene.count <= num_strokes) {
        const auto all = [&](const float* values, std::size_t size) {
            return std::vector<float>(values, values + size * scene.count);
        };
        return {all(scene.means, 3),  all(scene.quats, 4), all(scene.scales, 3), all(scene.opacities, 1),
                all(scene.sh, width), scene.count,         scene.sh_terms};
    }
    const Extent extent = robust_extent(scene.means, scene.count);
    const double finest = scene.is_antialiased ? 0 : finest_of(extent.radius);
    const Doubles areas = areas_of(seen_scales(scene.scales, scene.count, finest));
    const Doubles visible = visible_shares(scene, extent, areas);
    tell(0.3);
    const Features features = features_of(scene, extent);
    const Doubles weights = cluster_weights(scene, areas, visible, features.places);
    tell(0.4);
    const Clusters found = find_clusters({features.points.data(), weights.data(), scene.count, kDimensions},
                                         {num_strokes, draws, kSteps, kGain, 1});
    tell(0.9);
    Members members{found.labels.get(), found.num_clusters, std::vector<std::int32_t>(scene.count),
                    std::vector<std::int64_t>(found.num_clusters + 1)};
    group_rows(members.labels, scene.count, members.num_groups, members.rows.data(), members.begins.data());
    return merge_members(scene, members, areas, visible, finest);
}

}  // namespace brushgs
