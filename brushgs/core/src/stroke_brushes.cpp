#include "brushgs/stroke_brushes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "brushgs/colors.hpp"
#include "brushgs/equal_rows.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/stroke_relief.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;
using Rows = std::vector<std::uint8_t>;

constexpr std::size_t kAround = 16;   // nearest neighbors
constexpr std::size_t kCompared = 6;  // of them, for comparison
constexpr int kMeanRounds = 2;        // of means over the neighbors and the stroke itself
// Differences in normal (1 - |cos|), color (OKLab) and logarithm of size that are clipped: of two objects.
constexpr std::array<double, 3> kFar{0.8, 0.15, 1};
// Mean differences, in these units, at which roughness begins and is full; and their weights.
constexpr std::array<double, 3> kNone{0.1, 0.2, 0.2}, kFull{0.55, 0.7, 0.5}, kWeights{0.5, 0.3, 0.2};
constexpr double kLeastMiddle = 0.4, kMostMiddle = 0.55;  // of roughness between smooth and rough surfaces
constexpr double kWidth = 0.15;                           // from there to fully smooth or rough
constexpr double kLong = 1.9, kShort = 1.35;              // length over width
constexpr double kLarge = 2.2;                            // times the median size
constexpr std::uint64_t kChoice = 4, kTakes = 7;          // draws of `chance`

double smoothstep(double x) {
    x = std::clamp(x, 0.0, 1.0);
    return x * x * (3 - 2 * x);
}

template <class T>
std::array<double, 2> larger_scales(const T* scales) {
    std::array<double, 3> sorted;
    for (std::size_t k = 0; k < 3; ++k) sorted[k] = static_cast<double>(scales[k]);
    std::ranges::sort(sorted);
    return {sorted[1], sorted[2]};
}

// What neighbors are compared by.
struct Compared {
    std::array<double, 3> normal, lab;
    double log_size;
};

template <class T>
std::vector<Compared> compared(const BrushedStrokes<T>& strokes) {
    const Oklab oklab(strokes.cones_from_rgb, strokes.lab_from_roots);
    std::vector<Compared> found(strokes.count);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const T *scales = strokes.scales + 3 * i, *sh = strokes.sh + 3 * strokes.sh_terms * i;
        const auto thinnest = static_cast<std::size_t>(std::min_element(scales, scales + 3) - scales);
        const auto turned = rotation_of(unit_quat(strokes.quats + 4 * i));
        const auto [width, length] = larger_scales(scales);
        constexpr double least = std::numeric_limits<double>::min();
        found[i] = {{turned[thinnest], turned[3 + thinnest], turned[6 + thinnest]},
                    oklab.lab_of(base_rgb(sh)),
                    (std::log(std::max(width, least)) + std::log(std::max(length, least))) / 2};
    }
    return found;
}

// Of each in normal, color and size, 0 to 1.
std::array<double, 3> difference_of(const Compared& a, const Compared& b) {
    double cosine = 0;
    for (std::size_t k = 0; k < 3; ++k) cosine += a.normal[k] * b.normal[k];
    const double apart = std::hypot(a.lab[0] - b.lab[0], a.lab[1] - b.lab[1], a.lab[2] - b.lab[2]);
    const std::array found{1 - std::abs(cosine), apart, std::abs(a.log_size - b.log_size)};
    std::array<double, 3> shares;
    for (std::size_t k = 0; k < 3; ++k) shares[k] = std::clamp(found[k] / kFar[k], 0.0, 1.0);
    return shares;
}

template <class T>
Doubles roughness_of(const BrushedStrokes<T>& strokes) {
    Doubles found(strokes.count);
    const std::size_t num = std::min(kAround, std::max<std::size_t>(strokes.count, 1) - 1);
    if (num == 0) return found;
    const Doubles points(strokes.means, strokes.means + 3 * strokes.count);
    std::vector<std::int32_t> neighbors(num * strokes.count);
    find_neighbors({points.data(), strokes.count, num, 3, strokes.num_threads}, neighbors.data());
    const auto looks = compared(strokes);
    const std::size_t num_compared = std::min(num, kCompared);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        std::array<double, 3> sums{};
        for (std::size_t k = 0; k < num_compared; ++k) {
            const auto one = difference_of(looks[i], looks[static_cast<std::size_t>(neighbors[num * i + k])]);
            for (std::size_t kind = 0; kind < 3; ++kind) sums[kind] += one[kind];
        }
        for (std::size_t kind = 0; kind < 3; ++kind) {
            const double mean = sums[kind] / static_cast<double>(num_compared);
            found[i] += kWeights[kind] * std::clamp((mean - kNone[kind]) / (kFull[kind] - kNone[kind]), 0.0, 1.0);
        }
    }
    for (int round = 0; round < kMeanRounds; ++round) {
        const Doubles before = found;
        for (std::size_t i = 0; i < strokes.count; ++i) {
            for (std::size_t k = 0; k < num; ++k) found[i] += before[static_cast<std::size_t>(neighbors[num * i + k])];
            found[i] /= static_cast<double>(1 + num);
        }
    }
    return found;
}

// The median of values, weighted by paint.
double middle_of(const Doubles& values, const Doubles& paint) {
    const double largest = *std::ranges::max_element(paint);
    std::vector<std::array<double, 2>> order(values.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = {values[i], largest > 0 ? paint[i] / largest : 1};
    std::ranges::sort(order);
    double total = 0;
    for (auto& [value, share] : order) share = total += share;
    return (*std::ranges::find_if(order, [&](const auto& one) { return one[1] >= total / 2; }))[0];
}

Rows united(const Rows& one, const Rows& other) {
    Rows all;
    std::ranges::set_union(one, other, std::back_inserter(all));
    return all;
}

std::uint8_t taken(const Rows& rows, double share) {
    return rows[static_cast<std::size_t>(share * static_cast<double>(rows.size()))];
}

}  // namespace

template <class T>
Surfaces surfaces_of(const BrushedStrokes<T>& strokes) {
    Surfaces surfaces{roughness_of(strokes), Doubles(strokes.count), Doubles(strokes.count)};
    if (strokes.count == 0) return surfaces;
    const Doubles paint = paint_of(strokes.scales, strokes.opacities, strokes.count, strokes.num_threads);
    const double middle = std::clamp(middle_of(surfaces.roughness, paint), kLeastMiddle, kMostMiddle);
    const LightRange lights =
        light_range(PaintedStrokes<T>{strokes.scales, strokes.opacities, strokes.sh, strokes.count, strokes.sh_terms,
                                      strokes.cones_from_rgb, strokes.lab_from_roots});
    const double range = std::max(lights.light - lights.dark, kLeastLightRange);
    const Oklab oklab(strokes.cones_from_rgb, strokes.lab_from_roots);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const T* const sh = strokes.sh + 3 * strokes.sh_terms * i;
        const double lightness = oklab.lab_of(base_rgb(sh))[0];
        const double away = (surfaces.roughness[i] - middle) / kWidth;
        surfaces.smooth[i] = smoothstep(-away) * smoothstep((lightness - lights.dark) / range);
        surfaces.rough[i] = smoothstep(away);
    }
    return surfaces;
}

template <class T>
std::vector<std::uint8_t> choose_brushes(const BrushedStrokes<T>& strokes, const BrushRows& brushes, double material,
                                         std::uint64_t seed) {
    const std::vector<float> places(strokes.means, strokes.means + 3 * strokes.count);
    std::vector<std::uint64_t> hashes(strokes.count);
    hash_rows(places.data(), strokes.count, 3, 1, hashes.data());
    Doubles sizes(strokes.count);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const auto [width, length] = larger_scales(strokes.scales + 3 * i);
        sizes[i] = std::sqrt(length) * std::sqrt(width);
    }
    Doubles sorted = sizes;
    const double usual = sizes.empty() ? 0 : percentile(sorted, 0.5);
    const std::array groups{&brushes.of_long, &brushes.of_short, &brushes.of_others};
    std::array<Rows, 3> with_large;
    std::ranges::transform(groups, with_large.begin(),
                           [&](const Rows* rows) { return united(*rows, brushes.of_large); });
    std::vector<std::uint8_t> found(strokes.count);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const auto [width, length] = larger_scales(strokes.scales + 3 * i);
        const double aspect = !(length > 0) ? 1 : width > 0 ? length / width : std::numeric_limits<double>::infinity();
        const std::size_t group = aspect > kLong ? 0 : aspect < kShort ? 1 : 2;
        found[i] =
            taken(sizes[i] > kLarge * usual ? with_large[group] : *groups[group], chance(hashes[i], seed, kChoice));
    }
    if (!(material > 0) || (brushes.of_smooth.empty() && brushes.of_rough.empty())) return found;
    const Surfaces surfaces = surfaces_of(strokes);
    const auto replace = [&](const Rows& rows, const Doubles& shares) {
        for (std::size_t i = 0; !rows.empty() && i < strokes.count; ++i)
            if (chance(hashes[i], seed, kTakes) < material * shares[i])
                found[i] = taken(rows, chance(hashes[i], seed, kChoice));
    };
    replace(brushes.of_smooth, surfaces.smooth);
    replace(brushes.of_rough, surfaces.rough);
    return found;
}

template Surfaces surfaces_of<float>(const BrushedStrokes<float>&);
template Surfaces surfaces_of<double>(const BrushedStrokes<double>&);
template std::vector<std::uint8_t> choose_brushes<float>(const BrushedStrokes<float>&, const BrushRows&, double,
                                                         std::uint64_t);
template std::vector<std::uint8_t> choose_brushes<double>(const BrushedStrokes<double>&, const BrushRows&, double,
                                                          std::uint64_t);

}  // namespace brushgs
