// Photographs are taken from above and from the side, so undersides are badly trained: seen from below Gaussians are
// large and edges few. Objects stand on a foot below a low center of mass, and on something level.
#include <algorithm>
#include <cmath>

#include "brushgs/colors.hpp"
#include "brushgs/cpu.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/subject.hpp"
#include "brushgs/view_pictures.hpp"

namespace brushgs {

namespace {

constexpr int kSide = 96;                       // pixels
constexpr double kFoot = 0.1, kLowest = 0.04;   // height share of the foot; share of rows that a scene stands on
constexpr double kFlat = 2;                     // least ratio of middle to smallest scale for a normal
constexpr double kLevel = 0.93969262078590838;  // cosine of 20 degrees, between a level normal and the axis
constexpr std::size_t kDown = 4;                // -y, the axis of COLMAP that points up
constexpr double kFarBetter = 2;                // it stays unless another one is this many times as probable
// Below this many rows a scene is a fragment: its probability is limited.
constexpr std::size_t kFewRows = 5'000;
constexpr double kMostOfFew = 0.8;

using Values = std::vector<double>;
using Looks = std::array<std::array<double, 3>, 26>;

// Axes, edges and corners of a cube, at length 1.
Looks directions() {
    Looks found;
    std::size_t next = 0;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                const double length = std::sqrt(x * x + y * y + z * z);
                if (length > 0) found[next++] = {x / length, y / length, z / length};
            }
        }
    }
    return found;
}

// A camera that looks in a direction, with arbitrary roll.
Axes axes_toward(const std::array<double, 3>& forward) {
    const auto cross = [](const auto& a, const auto& b) {
        return std::array{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    std::array<double, 3> least{};
    least[static_cast<std::size_t>(std::ranges::min_element(forward, {}, [](double value) { return std::abs(value); }) -
                                   forward.begin())] = 1;
    auto right = cross(forward, least);
    const double length = std::hypot(right[0], right[1], right[2]);
    for (double& value : right) value /= length;
    const auto down = cross(forward, right);
    return {right[0], right[1], right[2], down[0], down[1], down[2], forward[0], forward[1], forward[2]};
}

// Length of the gradient of a shade between pixels that show the subject, summed.
double sum_gradients(const SmallPicture& picture) {
    double sum = 0;
    for (std::size_t y = 0; y + 1 < picture.side; ++y) {
        for (std::size_t x = 0; x + 1 < picture.side; ++x) {
            const std::size_t here = y * picture.side + x;
            const auto step = [&](std::size_t other) {
                const bool both = picture.is_seen(here) && picture.is_seen(other);
                return both ? static_cast<double>(picture.straight(other, 0) - picture.straight(here, 0)) : 0;
            };
            sum += std::hypot(step(here + 1), step(here + picture.side));
        }
    }
    return sum;
}

// Edges per pixel and mean shade of size of a picture; zeros if nothing shows.
struct Look {
    double edges = 0, size = 0;
};

Look look_from(const ViewSample& sample, const std::array<double, 3>& direction, const std::vector<float>& shades,
               const std::vector<float>& sizes) {
    const auto picture =
        paint_shades(sample, {axes_toward({-direction[0], -direction[1], -direction[2]}), kSide}, shades, sizes);
    if (picture.num_seen == 0) return {};
    const auto seen = static_cast<double>(picture.num_seen);
    double size = 0;
    for (std::size_t pixel = 0; pixel < picture.alpha.size(); ++pixel)
        if (picture.is_seen(pixel)) size += static_cast<double>(picture.straight(pixel, 1));
    return {sum_gradients(picture) / seen, size / seen};
}

std::vector<float> luminances(const ViewSample& sample) {
    std::vector<float> shades(sample.count);
    for (std::size_t row = 0; row < sample.count; ++row) {
        double shade = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double color = 0.5 + kBand0 * static_cast<double>(sample.sh[3 * row + k]);
            shade += kLuminance[k] * std::clamp(color, 0.0, 1.0);
        }
        shades[row] = static_cast<float>(shade);
    }
    return shades;
}

struct Interval {
    double low, high;
    double length() const { return high - low; }
};

Interval quantiles(Values values, double outside) {
    const double low = percentile(values, outside);
    return {low, percentile(values, 1 - outside, outside)};
}

// Area of the box with 90 % of the points along each axis; 0 for very few points.
double footprint(const Values& across, const Values& along) {
    if (across.size() < 10) return 0;
    return quantiles(across, 0.05).length() * quantiles(along, 0.05).length();
}

double mean_where(const std::array<Look, 26>& looks, const Looks& from, std::size_t axis, Interval heights,
                  double Look::*value) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < looks.size(); ++i) {
        if (!(from[i][axis] > heights.low && from[i][axis] < heights.high)) continue;
        sum += looks[i].*value;
        ++count;
    }
    return sum / count;
}

// The places of a sample along one axis and across it, with an axis up; and the painted areas.
struct Upright {
    Values heights, across, along;
    const Values& weights;

    Upright(const ViewSample& sample, const Values& painted, std::size_t axis, double sign) : weights(painted) {
        for (std::size_t row = 0; row < sample.count; ++row) {
            const double* place = &sample.places[3 * row];
            heights.push_back(sign * place[axis]);
            across.push_back(place[axis == 0 ? 1 : 0]);
            along.push_back(place[axis == 2 ? 1 : 2]);
        }
    }

    double total() const {
        double sum = 0;
        for (const double weight : weights) sum += weight;
        return sum > 0 ? sum : 1;
    }

    double center(const Values& values) const {
        double sum = 0;
        for (std::size_t i = 0; i < values.size(); ++i) sum += values[i] * weights[i];
        return sum / total();
    }

    // Footprint of the rows with heights between two.
    double footprint_within(Interval part) const {
        Values one, other;
        for (std::size_t i = 0; i < heights.size(); ++i) {
            if (!(heights[i] > part.low && heights[i] < part.high)) continue;
            one.push_back(across[i]);
            other.push_back(along[i]);
        }
        return footprint(one, other);
    }

    // Footprint of the lowest tenth minus that of the highest, over the whole footprint.
    double foot(Interval ends) const {
        const double part = kFoot * ends.length(), whole = footprint(across, along), everywhere = HUGE_VAL;
        const double lowest = footprint_within({-everywhere, ends.low + part}),
                     highest = footprint_within({ends.high - part, everywhere});
        return (lowest - highest) / (whole > 0 ? whole : 1);
    }

    // Distance of the center of mass inside the box of the lowest points, in widths of the sample.
    double stability() const {
        Values copy = heights;
        const double lowest = percentile(copy, kLowest);
        double widths[2], room[2];
        const Values* sides[2] = {&across, &along};
        for (std::size_t side = 0; side < 2; ++side) {
            const Values& values = *sides[side];
            Values low;
            for (std::size_t i = 0; i < heights.size(); ++i)
                if (heights[i] <= lowest) low.push_back(values[i]);
            const Interval box = quantiles(low, 0.05);
            const double middle = center(values);
            room[side] = std::min(middle - box.low, box.high - middle);
            const auto [first, last] = std::ranges::minmax_element(values);
            widths[side] = *last - *first;
        }
        const double widest = 1e-6 * std::max(widths[0], widths[1]), least = widest > 0 ? widest : 1;
        return std::min(room[0] / std::max(widths[0], least), room[1] / std::max(widths[1], least));
    }
};

// How far flat Gaussians that are level lie low: the weight of those in the lowest third of the height minus that of
// the highest, over the weight of all flat ones.
double low_ground(const ViewSample& sample, const Values& shares, const Values& weights, std::size_t axis) {
    double low = 0, high = 0, all = 0;
    for (std::size_t row = 0; row < sample.count; ++row) {
        const float* scales = &sample.scales[3 * row];
        std::array<float, 3> sorted{scales[0], scales[1], scales[2]};
        std::ranges::sort(sorted);
        if (!(static_cast<double>(sorted[1]) > kFlat * static_cast<double>(sorted[0]))) continue;
        all += weights[row];
        const auto shortest = static_cast<std::size_t>(std::min_element(scales, scales + 3) - scales);
        const double normal = rotation_of(unit_quat(&sample.quats[4 * row]))[3 * axis + shortest];
        if (!(std::abs(normal) > kLevel)) continue;
        low += shares[row] < 1.0 / 3 ? weights[row] : 0;
        high += shares[row] > 2.0 / 3 ? weights[row] : 0;
    }
    return (low - high) / (all > 0 ? all : 1);
}

}  // namespace

std::array<PerAxis, kEvidence.size()> measure_up(const ViewSample& sample, int num_threads) {
    const auto shades = luminances(sample), sizes = shades_of_size(sample);
    const auto from = directions();
    std::array<Look, 26> looks;
    parallel_for(looks.size(), num_threads,
                 [&](std::size_t i) { looks[i] = look_from(sample, from[i], shades, sizes); });
    const Values weights = painted_weights(sample);
    std::array<PerAxis, kEvidence.size()> values;
    parallel_for(3, num_threads, [&](std::size_t axis) {
        const auto above_minus_below = [&](double height, double Look::*value) {
            return mean_where(looks, from, axis, {height, 2}, value) -
                   mean_where(looks, from, axis, {-2, -height}, value);
        };
        const Upright upright(sample, weights, axis, 1);
        const auto ends = weighted_quantiles(upright.heights, weights, std::array{0.01, 0.99});
        const Interval box{ends[0], ends[1]};
        Values shares = upright.heights;
        for (double& share : shares)
            share = std::clamp((share - box.low) / (box.length() > 0 ? box.length() : 1), 0.0, 1.0);
        const std::array found{above_minus_below(0.1, &Look::size),
                               above_minus_below(0.99, &Look::size),
                               above_minus_below(0.1, &Look::edges),
                               above_minus_below(0.99, &Look::edges),
                               upright.foot(box),
                               0.5 - upright.center(shares),
                               low_ground(sample, shares, weights, axis)};
        for (std::size_t kind = 0; kind < found.size(); ++kind) {
            values[kind][axis] = found[kind];
            values[kind][axis + 3] = -found[kind];
        }
        values.back()[axis] = upright.stability();
        values.back()[axis + 3] = Upright(sample, weights, axis, -1).stability();
    });
    return values;
}

PerAxis up_evidence(const ViewSample& sample, int num_threads) {
    const auto values = measure_up(sample, num_threads);
    PerAxis odds{};
    for (std::size_t kind = 0; kind < values.size(); ++kind) {
        const auto& [name, scale, weight] = kEvidence[kind];
        for (std::size_t axis = 0; axis < odds.size(); ++axis)
            odds[axis] += weight * 1.5 * std::tanh(values[kind][axis] / (1.5 * scale));  // saturates
    }
    return odds;
}

PerAxis up_chances(const ViewSample& sample, int num_threads) {
    PerAxis chances = sample.count == 0 ? PerAxis{} : up_evidence(sample, num_threads);
    for (std::size_t axis = 0; axis < chances.size(); ++axis) chances[axis] += std::log(kUpPriors[axis]);
    const double most = *std::ranges::max_element(chances);
    double sum = 0;
    for (double& chance : chances) sum += chance = std::exp(chance - most);
    for (double& chance : chances) chance /= sum;
    double& best = *std::ranges::max_element(chances);
    if (sample.count > 0 && sample.num_rows < kFewRows && best > kMostOfFew) {
        const double factor = (1 - kMostOfFew) / (1 - best);
        for (double& chance : chances) chance *= factor;
        best = kMostOfFew;
    }
    return chances;
}

std::size_t believed_axis(const PerAxis& chances) {
    const auto best = std::ranges::max_element(chances);
    return *best > kFarBetter * chances[kDown] ? static_cast<std::size_t>(best - chances.begin()) : kDown;
}

}  // namespace brushgs
