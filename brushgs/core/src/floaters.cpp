#include "brushgs/floaters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "brushgs/components.hpp"
#include "brushgs/exponentials.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/faint.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/row_loop.hpp"
#include "brushgs/rows.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;
using Marks = std::vector<std::uint8_t>;
using Rows = std::vector<std::int64_t>;

constexpr std::size_t kRowsPerItem = 1024;
constexpr std::size_t kNeighbors = 16;
constexpr double kFaintest = 0.02;  // opacity at which the visible extent of a Gaussian ends
constexpr std::int32_t kMany = 6;   // touching neighbors of a core Gaussian (DBSCAN): a dense fog of strays has fewer
constexpr int kChain = 4;           // longest chain of Gaussians attached to a body
// A smaller group is a body only if it is solid: its opacities sum to kSolid, or kSolidHaze where their mean is below
// kHaze. The groups around koala and chair sum to at most 1.6 and 3.0 (those above 2 are haze: mean below 0.1), a
// flower head of the sunflowers to 8, a lamp or leaf of the truck to 3 and more.
constexpr double kFewRows = 100, kFewShare = 0.001;
constexpr double kSolid = 2.0, kHaze = 0.15, kSolidHaze = 5.0;
// Distance of a floater from the nearest body, in radii of the scene. koala's are 0.097 to 0.34 away, those of the
// chair 0.28 in the median; fuzz on surfaces and severed blades of grass stay below 0.05.
constexpr double kSureGap = 0.08, kStrongGap = 0.03;
// Painted area of all floaters over the squared radius. Clean scenes: at most 4.8e-5 (sunflowers); truck 9e-4 (scraps
// of sky), koala 1.3e-3, chair 2.7e-2.
constexpr double kVisible = 1e-4;
// Share of the rows: if more float, there are no bodies. In a fragment of 1,000 scattered points 0.7 float; in the
// chair with its haze 0.04.
constexpr double kMostRows = 0.3;
constexpr std::size_t kFewestRows = 200;
// Edge of a cell in radii, and the minimum sum of opacities in a cell and its 26 neighbors that is part of a body: more
// than any floater has. Against a full search on eight scenes, 9 of the chair's 4161 sure floaters are missed, and no
// other.
constexpr double kCell = 0.02, kDense = 8.0;
constexpr double kMostCells = 1 << 20;  // to each side of the middle; farther Gaussians share a cell
constexpr double kLargest = 1e6;        // scale, in radii: squares of larger ones might leave the range of float32

// Distances of Gaussians from the bodies.
struct Detachment {
    Doubles gaps;             // [count] to the nearest body, radii of the scene; 0 for Gaussians of a body
    Doubles areas;            // [count] painted area over the squared radius
    bool has_bodies = false;  // whether enough of the scene is solid for meaningful gaps
};

// Pairs of Gaussians that touch, of each `a` before `b`.
struct Pairs {
    Rows a, b;
};

template <class T>
std::vector<std::uint64_t> cells_of(const FloaterQuery<T>& query, const Extent& extent) {
    std::vector<std::uint64_t> cells(query.count);
    for (std::size_t i = 0; i < query.count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const double away = static_cast<double>(query.means[3 * i + k]) - extent.center[k];
            const double place = std::clamp(std::floor(away / (kCell * extent.radius)), 2 - kMostCells, kMostCells - 2);
            cells[i] = (cells[i] << 21) + static_cast<std::uint64_t>(place + kMostCells);
        }
    }
    return cells;
}

// Marks of the rows in cells that are surely part of a body.
template <class T>
Marks in_dense_cells(const FloaterQuery<T>& query, const Extent& extent, const Doubles& opacities) {
    const auto keys = cells_of(query, extent);
    const auto order = rows_by_key(keys.data(), query.count, query.num_threads);
    std::vector<std::uint64_t> cells;
    Doubles own_sums, own_counts;
    for (std::size_t i = 0; i < query.count; ++i) {
        const std::uint64_t key = keys[order[i]];
        if (cells.empty() || cells.back() != key) cells.push_back(key), own_sums.push_back(0), own_counts.push_back(0);
        own_sums.back() += opacities[order[i]], own_counts.back() += 1;
    }
    Doubles sums(cells.size()), counts(cells.size());
    for (std::int64_t step = 0; step < 27; ++step) {
        const std::int64_t offset =
            ((step / 9 - 1) * (1LL << 42)) + ((step / 3 % 3 - 1) * (1LL << 21)) + (step % 3 - 1);
        std::size_t at = 0;  // both cells ascend
        for (std::size_t i = 0; i < cells.size(); ++i) {
            const std::uint64_t other = cells[i] + static_cast<std::uint64_t>(offset);
            while (at < cells.size() && cells[at] < other) ++at;
            if (at < cells.size() && cells[at] == other) sums[i] += own_sums[at], counts[i] += own_counts[at];
        }
    }
    Marks is_dense(query.count);
    for (std::size_t i = 0, cell = 0; i < query.count; ++i) {
        if (cells[cell] != keys[order[i]]) ++cell;
        is_dense[order[i]] = sums[cell] >= kDense && sums[cell] >= kHaze * counts[cell] ? 1 : 0;
    }
    return is_dense;
}

// Half axes in directions that a quaternion turns, radii of the scene, as columns; and the visible extent in
// deviations.
struct Visible {
    std::array<double, 9> axes;
    double sigmas;
};

template <class T>
Visible visible_extent(const FloaterQuery<T>& query, std::size_t row, double opacity, double radius) {
    Visible found{rotation_of(unit_quat(query.quats + 4 * row)),
                  std::sqrt(2 * log_of(std::max(opacity / kFaintest, 1.0)))};
    for (std::size_t k = 0; k < 9; ++k)
        found.axes[k] *= std::min(static_cast<double>(query.scales[3 * row + k % 3]) / radius, kLargest);
    return found;
}

// How far a Gaussian reaches along a unit vector.
double reach_along(const Visible& extent, const std::array<double, 3>& line) {
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double along = 0;
        for (std::size_t k = 0; k < 3; ++k) along += extent.axes[3 * k + axis] * line[k];
        squares += along * along;
    }
    return std::sqrt(squares) * extent.sigmas;
}

Doubles places_of(const auto* means, const std::vector<std::uint32_t>& rows) {
    Doubles places(3 * rows.size());
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<double>(means[3 * rows[i / 3] + i % 3]);
    return places;
}

// The points nearest to each query, [num_queries, count].
struct Near {
    Doubles distances;
    std::vector<std::int32_t> rows;
};

Near nearest_to(const Doubles& points, const Doubles& queries, std::size_t count, int num_threads) {
    Near found{Doubles(queries.size() / 3 * count), std::vector<std::int32_t>(queries.size() / 3 * count)};
    find_several({points.data(), queries.data(), points.size() / 3, queries.size() / 3, count, 3, num_threads},
                 found.distances.data(), found.rows.data());
    return found;
}

// All pairs of these rows and their neighbors that touch, each pair once, ascending.
template <class T>
Pairs touching_pairs(const FloaterQuery<T>& query, const Doubles& opacities, double radius,
                     const std::vector<std::uint32_t>& rows) {
    const std::size_t count = std::min(kNeighbors + 1, query.count);
    const Doubles points(query.means, query.means + 3 * query.count);
    const Near near = nearest_to(points, places_of(query.means, rows), count, query.num_threads);
    std::vector<std::uint32_t> places(query.count);  // among the extents, from 1 on
    std::vector<Visible> extents;
    const auto need = [&](std::size_t row) {
        if (places[row] > 0) return;
        extents.push_back(visible_extent(query, row, opacities[row], radius));
        places[row] = static_cast<std::uint32_t>(extents.size());
    };
    for (const std::uint32_t row : rows) need(row);
    for (const std::int32_t row : near.rows) need(static_cast<std::size_t>(row));
    Marks touches(near.rows.size());
    for_each_row(rows.size(), kRowsPerItem, query.num_threads, [&](std::size_t i) {
        const std::size_t row = rows[i];
        const Visible& own = extents[places[row] - 1];
        for (std::size_t at = count * i + 1; at < count * (i + 1); ++at) {
            const auto other = static_cast<std::size_t>(near.rows[at]);
            const double length = std::max(near.distances[at], 1e-30);
            std::array<double, 3> line;
            for (std::size_t k = 0; k < 3; ++k) line[k] = (points[3 * other + k] - points[3 * row + k]) / length;
            const Visible& theirs = extents[places[other] - 1];
            touches[at] = near.distances[at] < radius * (reach_along(own, line) + reach_along(theirs, line)) ? 1 : 0;
        }
    });
    std::vector<std::uint64_t> keys;
    for (std::size_t at = 0; at < touches.size(); ++at) {
        if (!touches[at]) continue;
        const std::uint64_t row = rows[at / count], other = static_cast<std::uint64_t>(near.rows[at]);
        keys.push_back(std::min(row, other) << 32 | std::max(row, other));
    }
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());  // Clang 14 has no std::ranges::unique
    Pairs pairs;
    for (const std::uint64_t key : keys) {
        pairs.a.push_back(static_cast<std::int64_t>(key >> 32));
        pairs.b.push_back(static_cast<std::int64_t>(key & 0xFFFFFFFF));
    }
    return pairs;
}

std::size_t index(std::int64_t row) { return static_cast<std::size_t>(row); }

// The group of each row, by the pairs that touch. Source: Ester et al. 1996, A density-based algorithm (DBSCAN: core
// and border points).
std::vector<std::int32_t> groups_of(const Pairs& pairs, const Marks& is_dense) {
    const std::size_t count = is_dense.size(), num_pairs = pairs.a.size();
    std::vector<std::int32_t> num_touching(count), groups(count);
    for (const Rows* side : {&pairs.a, &pairs.b})
        for (const std::int64_t row : *side) ++num_touching[index(row)];
    const auto is_core = [&](std::int64_t row) {
        return is_dense[index(row)] != 0 || num_touching[index(row)] >= kMany;
    };
    Pairs of_cores;
    for (std::size_t i = 0; i < num_pairs; ++i) {
        if (!is_core(pairs.a[i]) || !is_core(pairs.b[i])) continue;
        of_cores.a.push_back(pairs.a[i]), of_cores.b.push_back(pairs.b[i]);
    }
    find_components({of_cores.a.data(), of_cores.b.data(), of_cores.a.size()}, groups.data(), count);
    const auto join_borders = [&](const Rows& here, const Rows& there) {
        for (std::size_t i = 0; i < num_pairs; ++i)
            if (!is_core(here[i]) && is_core(there[i])) groups[index(here[i])] = groups[index(there[i])];
    };
    join_borders(pairs.a, pairs.b);
    join_borders(pairs.b, pairs.a);
    return groups;
}

// Marks of the rows that belong to no body; dense rows do.
Marks outside_bodies(const Doubles& opacities, const Pairs& pairs, const Marks& is_dense,
                     const std::vector<std::int32_t>& groups) {
    const std::size_t count = opacities.size();
    Doubles counts(count), sums(count);
    for (std::size_t i = 0; i < count; ++i) counts[index(groups[i])] += 1, sums[index(groups[i])] += opacities[i];
    const double most = std::max(kFewRows, kFewShare * static_cast<double>(count));
    Marks is_body(count), is_detached(count);
    for (std::size_t group = 0; group < count; ++group) {
        const double solid = sums[group] < kHaze * counts[group] ? kSolidHaze : kSolid;
        is_body[group] = counts[group] >= most || sums[group] >= solid ? 1 : 0;
    }
    for (std::size_t i = 0; i < count; ++i)
        if (is_dense[i]) is_body[index(groups[i])] = 1;
    for (std::size_t i = 0; i < count; ++i) is_detached[i] = is_body[index(groups[i])] ? 0 : 1;
    for (int link = 0; link < kChain; ++link) {
        Rows attached;
        for (std::size_t i = 0; i < pairs.a.size(); ++i) {
            if (is_detached[index(pairs.a[i])] == is_detached[index(pairs.b[i])]) continue;
            attached.push_back(is_detached[index(pairs.a[i])] ? pairs.a[i] : pairs.b[i]);
        }
        for (const std::int64_t row : attached) is_detached[index(row)] = 0;
    }
    return is_detached;
}

// The gap of a group is that of its nearest Gaussian.
template <class T>
Doubles gaps_of(const FloaterQuery<T>& query, double radius, const Marks& is_detached,
                const std::vector<std::int32_t>& groups) {
    const auto rows = marked(is_detached);
    const Near near =
        nearest_to(places_of(query.means, marked(is_detached, 0)), places_of(query.means, rows), 1, query.num_threads);
    Doubles least(query.count, std::numeric_limits<double>::infinity()), gaps(query.count);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        double& gap = least[index(groups[rows[i]])];
        gap = std::min(gap, near.distances[i] / radius);
    }
    for (const std::uint32_t row : rows) gaps[row] = least[index(groups[row])];
    return gaps;
}

// Of Gaussians with few at the same place.
template <class T>
Detachment measure_detachment(const FloaterQuery<T>& query) {
    const Extent extent = robust_extent(query.means, query.count, query.num_threads);
    Detachment found{Doubles(query.count), Doubles(query.count)};
    projected_areas(query.scales, query.count, 0, query.num_threads, found.areas.data());
    for (std::size_t i = 0; i < query.count; ++i)
        found.areas[i] = found.areas[i] * static_cast<double>(query.opacities[i]) / (extent.radius * extent.radius);
    if (query.count < kFewestRows) return found;
    const double raise = faintness(high_opacity(query.opacities, query.count));
    Doubles opacities(query.opacities, query.opacities + query.count);
    for (double& opacity : opacities) opacity /= raise;
    const Marks is_dense = in_dense_cells(query, extent, opacities);
    const Pairs pairs = touching_pairs(query, opacities, extent.radius, marked(is_dense, 0));
    const auto groups = groups_of(pairs, is_dense);
    const Marks is_detached = outside_bodies(opacities, pairs, is_dense, groups);
    const auto num_detached = static_cast<std::size_t>(std::ranges::count(is_detached, 1));
    if (num_detached == query.count) return found;
    if (num_detached > 0) found.gaps = gaps_of(query, extent.radius, is_detached, groups);
    const auto num_far = std::ranges::count_if(found.gaps, [](double gap) { return gap > kSureGap; });
    found.has_bodies = static_cast<double>(num_far) <= kMostRows * static_cast<double>(query.count);
    return found;
}

FloaterLevel level_of(const Detachment& found, double gap, bool is_haze, const std::vector<std::int64_t>& groups) {
    FloaterLevel level{Marks(groups.size()), 0, std::numeric_limits<double>::infinity(), false};
    double area = 0, total = 0;
    const auto is_far = [&](std::size_t i) { return found.has_bodies && found.gaps[i] > gap; };
    for (std::size_t i = 0; i < found.gaps.size(); ++i) {
        total += found.areas[i];
        if (is_far(i)) area += found.areas[i], level.nearest = std::min(level.nearest, found.gaps[i]);
    }
    for (std::size_t row = 0; row < groups.size(); ++row) level.rows[row] = is_far(index(groups[row])) ? 1 : 0;
    level.share = area / std::max(total, 1e-300);
    level.is_seen = area >= kVisible && !is_haze;
    return level;
}

}  // namespace

template <class T>
Floaters find_floaters(const FloaterQuery<T>& query, const std::vector<std::int64_t>& first,
                       const std::vector<std::int64_t>& groups) {
    const auto means = taken_from(query.means, 3, first), quats = taken_from(query.quats, 4, first);
    const auto scales = taken_from(query.scales, 3, first), opacities = taken_from(query.opacities, 1, first);
    const Detachment detached = measure_detachment<T>(
        {means.data(), quats.data(), scales.data(), opacities.data(), first.size(), query.num_threads});
    const bool is_haze = query.count > 0 && high_opacity(query.opacities, query.count) < kFaintScene;
    return {level_of(detached, kSureGap, is_haze, groups), level_of(detached, kStrongGap, is_haze, groups),
            detached.has_bodies, is_haze};
}

template Floaters find_floaters<float>(const FloaterQuery<float>&, const Rows&, const Rows&);
template Floaters find_floaters<double>(const FloaterQuery<double>&, const Rows&, const Rows&);

}  // namespace brushgs
