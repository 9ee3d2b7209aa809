// Nearest centers of points whose nearest center of a moment ago is known.
//
// If a point lies at a distance u from a center a, then any nearer center lies within 2 u of a. So the centers around
// each a are listed once for all points of its group, and each point is compared with the first few.
// Source: Newling and Fleuret 2016, Fast k-means with accurate bounds ("exponion"; there the lists are annuli).
#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"
#include "brushgs/kd_tree.hpp"
#include "brushgs/nearest.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kMostListed = 32;         // points that need more search the tree
constexpr std::size_t kLanes = 4;               // listed centers that are compared at once
constexpr std::size_t kFewPoints = 8;           // in a group of so many each searches the tree: a list costs more
constexpr std::size_t kSearchedPerItem = 4096;  // work handed to a thread at a time, about
constexpr double kRoundOff = 1e-9;              // relative, of distances: far more than they can have

// The centers around another, nearest first, within a radius: `kMostListed` at most.
struct Around {
    Around(std::int32_t own, double most) : squared(most), self(own) {}

    void offer(double other, std::int32_t at) {
        if (at == self || other > squared || (other == squared && count == kMostListed)) return;
        std::size_t i = count < kMostListed ? count++ : count - 1;
        for (; i > 0 && other < distances[i - 1]; --i) distances[i] = distances[i - 1], rows[i] = rows[i - 1];
        distances[i] = other, rows[i] = at;
        if (count == kMostListed) squared = distances[count - 1];
    }

    // Takes the roots, and copies the coordinates: [num_dimensions, kMostListed].
    void finish(const double* centers, std::size_t num_dimensions) {
        reach = std::sqrt(squared);
        for (std::size_t i = 0; i < (count + kLanes - 1) / kLanes * kLanes; ++i) {
            const std::size_t from = std::min(i, count - 1);  // the last one again
            if (i < count) distances[i] = std::sqrt(distances[i]);
            const double* place = centers + static_cast<std::size_t>(rows[from]) * num_dimensions;
            for (std::size_t k = 0; k < num_dimensions; ++k) places[k * kMostListed + i] = place[k];
        }
    }

    // Offers the centers that may be nearer to a point at a distance `own` from the middle center; returns whether the
    // list is complete for it.
    bool compare(const double* point, double own, std::size_t num_dimensions, Best& best) const;

    double squared;  // what a center must not exceed to be of interest
    std::int32_t self;
    std::size_t count = 0;
    double reach = 0;  // no center within it is missing
    double distances[kMostListed];
    std::int32_t rows[kMostListed];
    double places[kMostDimensions * kMostListed];
};

// Squared distances to `kLanes` listed centers, each summed as `sum_of_squares` does.
inline void squared_to_lanes(const double* point, const double* places, std::size_t num_dimensions, double* squared) {
    double sums[4][kLanes] = {};
    std::size_t k = 0;
    for (; k + 4 <= num_dimensions; k += 4)
        for (std::size_t part = 0; part < 4; ++part)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const double away = point[k + part] - places[(k + part) * kMostListed + lane];
                sums[part][lane] += away * away;
            }
    for (std::size_t lane = 0; lane < kLanes; ++lane)
        squared[lane] = sums[0][lane] + sums[1][lane] + sums[2][lane] + sums[3][lane];
    for (; k < num_dimensions; ++k)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const double away = point[k] - places[k * kMostListed + lane];
            squared[lane] += away * away;
        }
}

bool Around::compare(const double* point, double own, std::size_t num_dimensions, Best& best) const {
    double limit = 2 * own * (1 + kRoundOff);  // nothing nearer lies farther from the middle
    for (std::size_t i = 0; i < count; i += kLanes) {
        if (distances[i] > limit) return true;
        double others[kLanes];
        squared_to_lanes(point, places + i, num_dimensions, others);
        bool is_nearer = false;
        for (std::size_t lane = 0; lane < kLanes; ++lane) is_nearer |= others[lane] <= best.squared;
        if (!is_nearer) continue;
        for (std::size_t lane = 0; lane < kLanes && i + lane < count; ++lane) best.offer(others[lane], rows[i + lane]);
        limit = (own + std::sqrt(best.squared)) * (1 + kRoundOff);
    }
    return count < kMostListed || limit < reach;
}

// Calls `work(group)` for all groups, spread over threads.
template <class Work>
void for_groups(const PointGroups& groups, int num_threads, const Work& work) {
    const std::size_t groups_per_item = kSearchedPerItem / (groups.num_points / groups.num_groups + 1) + 1;
    parallel_for((groups.num_groups + groups_per_item - 1) / groups_per_item, num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * groups_per_item, groups.num_groups);
        for (std::size_t group = item * groups_per_item; group < end; ++group) work(group);
    });
}

// For each point of a group: `begin(row, point)` gives the best so far, which the search improves for `end(row, best)`.
// `tree` holds `others`; `self` is the row of the group's center among them, or -1.
template <class Begin, class End>
void search_group(const PointGroups& groups, std::size_t group, const KdTree& tree, const double* others,
                  std::int32_t self, double farthest, const Begin& begin, const End& end) {
    const std::size_t dimensions = groups.num_dimensions;
    const std::int32_t* row = groups.rows + groups.begins[group];
    const std::int32_t* const last = groups.rows + groups.begins[group + 1];
    Around around(self, 4 * farthest * farthest * (1 + kRoundOff));
    const bool is_listed = last - row > static_cast<std::ptrdiff_t>(kFewPoints);
    if (is_listed) tree.search(groups.centers + group * dimensions, around);
    if (is_listed && around.count > 0) around.finish(others, dimensions);
    for (double point[kMostDimensions]; row < last; ++row) {
        std::copy_n(groups.points + static_cast<std::size_t>(*row) * dimensions, dimensions, point);
        Best best = begin(*row);
        if (!is_listed || !around.compare(point, std::sqrt(best.squared), dimensions, best)) tree.search(point, best);
        end(*row, best);
    }
}

}  // namespace

Nearest find_nearest_again(const PointGroups& groups, int num_threads) {
    Nearest found{std::make_unique_for_overwrite<double[]>(groups.num_points),
                  std::make_unique_for_overwrite<std::int32_t[]>(groups.num_points)};
    const KdTree tree(groups.centers, groups.num_groups, groups.num_dimensions, num_threads);
    for_groups(groups, num_threads, [&](std::size_t group) {
        const double* center = groups.centers + group * groups.num_dimensions;
        const auto own = static_cast<std::int32_t>(group);
        double farthest = 0;
        for (std::int64_t i = groups.begins[group]; i < groups.begins[group + 1]; ++i) {
            const auto row = static_cast<std::size_t>(groups.rows[i]);
            const float* point = groups.points + row * groups.num_dimensions;
            const double squared = sum_of_squares(
                groups.num_dimensions, [=](std::size_t k) { return static_cast<double>(point[k]) - center[k]; });
            found.distances[row] = squared;
            farthest = std::max(farthest, squared);
        }
        search_group(
            groups, group, tree, groups.centers, own, std::sqrt(farthest),
            [&](std::int32_t row) { return Best{found.distances[static_cast<std::size_t>(row)], own}; },
            [&](std::int32_t row, const Best& best) {
                found.distances[static_cast<std::size_t>(row)] = std::sqrt(best.squared);
                found.rows[static_cast<std::size_t>(row)] = best.row;
            });
    });
    return found;
}

void find_nearer(const PointGroups& groups, const NearerQuery& query) {
    const KdTree tree(query.others, query.num_others, groups.num_dimensions, query.num_threads);
    for_groups(groups, query.num_threads, [&](std::size_t group) {
        double farthest = 0;
        for (std::int64_t i = groups.begins[group]; i < groups.begins[group + 1]; ++i)
            farthest = std::max(farthest, query.distances[groups.rows[i]]);
        search_group(
            groups, group, tree, query.others, -1, farthest,
            [&](std::int32_t row) {
                const double known = query.distances[row];
                return Best{known * known * (1 + kRoundOff), -1};
            },
            [&](std::int32_t row, const Best& best) {
                const double distance = std::sqrt(best.squared);
                if (best.row >= 0 && distance < query.distances[row])
                    query.distances[row] = distance, query.labels[row] = query.first + best.row;
            });
    });
}

}  // namespace brushgs
