#include "brushgs/worth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/components.hpp"
#include "brushgs/faint.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;
using Marks = std::vector<std::uint8_t>;
using Rows = std::vector<std::int64_t>;

constexpr double kVeil = 0.3, kVeilSize = 2;  // opacity below which, and neighbors' sizes above which it is a veil
// Share of the light stopped by strokes that are not faint. At 0.5 the chair loses 0.1 dB.
constexpr double kCovered = 0.7;
// Minimum share of the light stopped by all strokes together, below which they are fog; the second around veils.
// Without fog the chair, trained on white, stands clear; at 0.3 its upholstery, many veils deep, loses 0.4 dB.
constexpr double kFog = 0.12, kVeilFog = 0.25;
constexpr std::size_t kDeep = 128;   // strokes around fog that count: with 16 the chair's upholstery is fog (-1 dB)
constexpr double kTouch = 2;         // standard deviations along the line between two strokes at which they end
constexpr double kFirm = 0.6;        // opacity
constexpr double kSpeck = 2;         // sum of the opacities of a group; more is a body
constexpr double kMostSpecks = 0.3;  // share of the strokes; if more touch nothing, the scene is made so

std::size_t index(std::int64_t row) { return static_cast<std::size_t>(row); }

// Median of the neighbors' sizes.
double usual_size(const Surroundings& around, std::size_t row) {
    const std::size_t count = around.num_neighbors;
    if (count == 0) return around.sizes[row];
    Doubles sizes(count);
    for (std::size_t k = 0; k < count; ++k) sizes[k] = around.sizes[index(around.neighbors[count * row + k])];
    std::ranges::sort(sizes);
    return 0.5 * (sizes[(count - 1) / 2] + sizes[count / 2]);
}

// Marks of the faint strokes that are covered or fog.
Marks unseen(const Surroundings& around, const Doubles& opacities) {
    Marks is_unseen(around.count);
    Doubles others = opacities, least(around.count, kFog);
    Rows faint, rows;
    for (std::size_t i = 0; i < around.count; ++i) {
        if (!(opacities[i] < kVeil)) continue;
        const bool is_veil = around.sizes[i] > kVeilSize * usual_size(around, i);
        if (is_veil) least[i] = kVeilFog;
        if (is_veil || opacities[i] < kFaintStroke) faint.push_back(static_cast<std::int64_t>(i)), others[i] = 0;
    }
    const Doubles passed = around.passed(others, faint);
    for (std::size_t i = 0; i < faint.size(); ++i) is_unseen[index(faint[i])] = 1 - passed[i] > kCovered ? 1 : 0;
    for (std::size_t i = 0; i < around.count; ++i)
        if (opacities[i] < least[i] && !is_unseen[i]) rows.push_back(static_cast<std::int64_t>(i));
    for (const std::size_t num_others : {Surroundings::kNeighbors, kDeep}) {  // few need the second, slower search
        const Doubles light = around.passed(opacities, rows, num_others);
        Rows left;
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const std::size_t row = index(rows[i]);
            if (1 - (1 - opacities[row]) * light[i] < least[row]) left.push_back(rows[i]);
        }
        rows = std::move(left);
    }
    for (const std::int64_t row : rows) is_unseen[index(row)] = 1;
    return is_unseen;
}

// Standard deviation of a stroke along a line of any length times that length; both in `unit`.
double reach_along(const Surroundings& around, std::size_t row, const double* line, double unit) {
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double along = 0;
        for (std::size_t k = 0; k < 3; ++k) along += around.axes[9 * row + 3 * k + axis] * line[k];
        along *= around.scales[3 * row + axis] / unit;
        squares += along * along;
    }
    return std::sqrt(squares);
}

// Whether strokes reach each other along the line between them.
bool touch(const Surroundings& around, std::size_t row, std::size_t other) {
    double line[3], longest = std::numeric_limits<double>::min(), squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        line[k] = around.means[3 * other + k] - around.means[3 * row + k];
        longest = std::max({longest, std::abs(line[k]), around.scales[3 * row + k], around.scales[3 * other + k]});
    }
    for (double& value : line) value /= longest, squares += value * value;  // which stay in range
    return squares <= kTouch * (reach_along(around, row, line, longest) + reach_along(around, other, line, longest));
}

// The group of each row by the pairs that touch, both `kept`.
std::vector<std::int32_t> groups_of(const Surroundings& around, const Marks& kept) {
    Rows rows, others;
    for (std::size_t i = 0; i < around.neighbors.size(); ++i) {
        const std::size_t row = i / around.num_neighbors, other = index(around.neighbors[i]);
        if (!kept[row] || !kept[other] || !touch(around, row, other)) continue;
        rows.push_back(static_cast<std::int64_t>(row)), others.push_back(static_cast<std::int64_t>(other));
    }
    std::vector<std::int32_t> groups(around.count);
    find_components({rows.data(), others.data(), rows.size()}, groups.data(), around.count);
    return groups;
}

// Takes the marks of strokes in small detached groups that are not solid.
void drop_specks(const Surroundings& around, const Doubles& opacities, Marks& kept) {
    const auto groups = groups_of(around, kept);
    Doubles counts(around.count), sums(around.count);
    for (std::size_t i = 0; i < around.count; ++i) {
        if (kept[i]) counts[index(groups[i])] += 1, sums[index(groups[i])] += opacities[i];
    }
    Rows specks;
    for (std::size_t i = 0; i < around.count; ++i) {
        const std::size_t group = index(groups[i]);
        if (kept[i] && sums[group] < kSpeck && sums[group] < kFirm * counts[group])
            specks.push_back(static_cast<std::int64_t>(i));
    }
    const auto num_kept = static_cast<double>(std::ranges::count(kept, 1));
    if (static_cast<double>(specks.size()) > kMostSpecks * num_kept) return;
    for (const std::int64_t row : specks) kept[index(row)] = 0;
}

}  // namespace

template <class T>
Marks worth_keeping(const StrokeQuery<T>& strokes) {
    Marks kept(strokes.count, 1);
    Doubles opacities(strokes.opacities, strokes.opacities + strokes.count);
    if (std::ranges::all_of(opacities, [](double opacity) { return opacity == 0; })) return kept;  // no paint at all
    const double raise = faintness(high_opacity(opacities.data(), opacities.size()));
    for (double& opacity : opacities) opacity = std::min(opacity / raise, 1.0);
    const Surroundings around = surroundings_of(strokes);
    const Marks is_unseen = unseen(around, opacities);
    for (std::size_t i = 0; i < strokes.count; ++i) kept[i] = is_unseen[i] ? 0 : 1;
    drop_specks(around, opacities, kept);
    return kept;
}

template Marks worth_keeping<float>(const StrokeQuery<float>&);
template Marks worth_keeping<double>(const StrokeQuery<double>&);

}  // namespace brushgs
