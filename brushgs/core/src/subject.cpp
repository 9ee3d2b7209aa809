#include "brushgs/subject.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "brushgs/draws.hpp"

namespace brushgs {

namespace {

constexpr double kFar = 50;  // least width of a gap, over the joint extent of both sides
constexpr int kMostCuts = 16;
constexpr double kTip = 0.15;  // interquartile ranges added beyond the tails, for ears or chair legs
// Captured objects span 1.4 to 3.1 interquartile ranges, objects in surroundings (a truck on a plaza, fruit in front of
// a wall) 3.9 and more: then only the middle is the subject.
constexpr double kMostSpan = 3.5;
constexpr double kReach = 0.9;  // interquartile ranges to each side of the median
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Rows by value, ties by row.
std::vector<std::uint32_t> ascending(std::span<const double> values) {
    std::vector<std::pair<double, std::uint32_t>> pairs(values.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {values[i], static_cast<std::uint32_t>(i)};
    std::sort(pairs.begin(), pairs.end());
    std::vector<std::uint32_t> order(values.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = pairs[i].second;
    return order;
}

std::vector<double> running_sum(std::span<const double> weights, std::span<const std::uint32_t> order) {
    std::vector<double> sums(order.size());
    double sum = 0;
    for (std::size_t i = 0; i < order.size(); ++i) sums[i] = sum += weights[order[i]];
    return sums;
}

std::size_t place_of(std::span<const double> sums, double share) {
    return static_cast<std::size_t>(std::ranges::lower_bound(sums, share * sums.back()) - sums.begin());
}

// The widest gap between points on a line, strays left out.
struct Gap {
    double share = 0;  // its width over the joint extent of both sides
    double middle = 0;
    bool is_upper = false;  // whether the upper side weighs more
};

Gap gap_of(std::span<const double> places, std::span<const double> weights) {
    if (places.size() < 2) return {};
    const auto order = ascending(places);
    const auto mass = running_sum(weights, order);
    if (!(mass.back() > 0)) return {};
    const std::size_t first = place_of(mass, kTail), last = std::min(place_of(mass, 1 - kTail), order.size() - 1);
    if (last <= first) return {};
    std::size_t widest = first;
    const auto width = [&](std::size_t i) { return places[order[i + 1]] - places[order[i]]; };
    for (std::size_t i = first; i < last; ++i) widest = width(i) > width(widest) ? i : widest;
    const double rest = places[order[last]] - places[order[first]] - width(widest);
    return {rest > 0 ? width(widest) / rest : 0, 0.5 * (places[order[widest]] + places[order[widest + 1]]),
            mass[widest] < 0.5 * mass.back()};
}

struct Points {
    std::vector<double> places, weights;  // [n, 3], [n]
    std::vector<std::uint32_t> rows;      // [n] of the scene
};

std::vector<double> column(const Points& points, std::size_t axis) {
    std::vector<double> values(points.rows.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = points.places[3 * i + axis];
    return values;
}

Points within(const Points& points, const Clump& box, double above) {
    Points found;
    for (std::size_t i = 0; i < points.rows.size(); ++i) {
        if (!box.holds(&points.places[3 * i]) || !(points.weights[i] > above)) continue;
        found.places.insert(found.places.end(), &points.places[3 * i], &points.places[3 * i] + 3);
        found.weights.push_back(points.weights[i]);
        found.rows.push_back(points.rows[i]);
    }
    return found;
}

// The box of a subject; true if it has surroundings.
bool bound(const Points& points, bool is_whole, Clump& box) {
    constexpr std::array<double, 5> at{kTail, 0.25, 0.5, 0.75, 1 - kTail};
    std::array<std::vector<double>, 3> found;
    double unit = 0, span = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        found[axis] = weighted_quantiles(column(points, axis), points.weights, at);
        unit = std::max(unit, found[axis][3] - found[axis][1]);
        span = std::max(span, found[axis][4] - found[axis][0]);
    }
    const bool has_surroundings = !is_whole && unit > 0 && span > kMostSpan * unit;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& q = found[axis];
        box.low[axis] = has_surroundings ? std::max(q[0], q[2] - kReach * unit) : q[0] - kTip * unit;
        box.high[axis] = has_surroundings ? std::min(q[4], q[2] + kReach * unit) : q[4] + kTip * unit;
    }
    return has_surroundings;
}

}  // namespace

std::vector<double> weighted_quantiles(std::span<const double> values, std::span<const double> weights,
                                       std::span<const double> at) {
    const auto order = ascending(values);
    const auto sums = running_sum(weights, order);
    std::vector<double> found;
    for (const double share : at) found.push_back(values[order[std::min(place_of(sums, share), order.size() - 1)]]);
    return found;
}

std::vector<std::uint32_t> thinned(std::size_t count, std::size_t most) {
    std::vector<std::uint32_t> rows(std::min(count, most));
    if (count <= most) {
        std::iota(rows.begin(), rows.end(), 0U);
        return rows;
    }
    Draws draws;
    const double part = static_cast<double>(count) / static_cast<double>(most);
    for (std::size_t i = 0; i < most; ++i) {
        rows[i] = static_cast<std::uint32_t>((static_cast<double>(i) + draws.next()) * part);
    }
    return rows;
}

bool Clump::is_part() const {
    return std::ranges::any_of(low, [](double value) { return value != -kInfinity; }) ||
           std::ranges::any_of(high, [](double value) { return value != kInfinity; });
}

bool Clump::holds(const double* point) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!(point[axis] >= low[axis] && point[axis] <= high[axis])) return false;
    }
    return true;
}

Clump heaviest_clump(const double* points, std::span<const double> weights) {
    Clump box{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    for (int cut = 0; cut < kMostCuts; ++cut) {
        std::array<std::vector<double>, 3> places;
        std::vector<double> masses;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            if (!box.holds(points + 3 * i)) continue;
            for (std::size_t axis = 0; axis < 3; ++axis) places[axis].push_back(points[3 * i + axis]);
            masses.push_back(weights[i]);
        }
        std::array<Gap, 3> gaps;
        std::ranges::transform(places, gaps.begin(), [&](const auto& one) { return gap_of(one, masses); });
        const auto widest = std::ranges::max_element(gaps, {}, &Gap::share);
        if (widest->share <= kFar) break;
        (widest->is_upper ? box.low : box.high)[widest - gaps.begin()] = widest->middle;
    }
    return box;
}

template <class T>
Subject find_subject(const T* means, const T* opacities, std::size_t count, bool is_whole) {
    Points points;
    const std::size_t step = std::max<std::size_t>((count + kMostSubjectRows - 1) / kMostSubjectRows, 1);
    for (std::size_t row = 0; row < count; row += step) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            points.places.push_back(static_cast<double>(means[3 * row + axis]));
        points.weights.push_back(static_cast<double>(opacities[row]));
        points.rows.push_back(static_cast<std::uint32_t>(row));
    }
    if (std::ranges::none_of(points.weights, [](double weight) { return weight != 0; }))
        std::ranges::fill(points.weights, 1.0);
    if (points.rows.empty()) return {};
    const Clump clump = heaviest_clump(points.places.data(), points.weights);
    if (clump.is_part()) points = within(points, clump, -1);
    Clump box;
    const bool has_surroundings = bound(points, is_whole, box);
    Points inside = within(points, box, 0);
    return {std::move(inside.rows.empty() ? points.rows : inside.rows), has_surroundings};
}

template Subject find_subject<float>(const float*, const float*, std::size_t, bool);
template Subject find_subject<double>(const double*, const double*, std::size_t, bool);

}  // namespace brushgs
