// Nearest centres of points whose nearest centre of a moment ago is known.
//
// If a point lies at a distance u from a centre a, then a centre that is nearer lies within 2 u of a. So for each a
// its nearest fellows are listed, once for all points of its group, and each point is compared with the first few.
// Source: Newling and Fleuret 2016, Fast k-means with accurate bounds ("exponion"; there the lists are annuli).
#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/cpu.hpp"
#include "brushgs/kd_tree.hpp"
#include "brushgs/nearest.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kMostFellows = 32;      // of a list; points that need more search the tree
constexpr std::size_t kLanes = 4;             // fellows that are compared at once
constexpr std::size_t kFewPoints = 8;         // in a group of so many each searches the tree: a list costs more
constexpr std::size_t kPointsPerItem = 4096;  // work handed to a thread at a time, about
constexpr double kRoundOff = 1e-9;            // relative, of distances: far more than they can have

// The centres around another, nearest first, within a radius: `kMostFellows` at most.
struct Fellows {
    Fellows(std::int32_t own, double most) : squared(most), self(own) {}

    void offer(double other, std::int32_t at) {
        if (at == self || other > squared || (other == squared && count == kMostFellows)) return;
        std::size_t i = count < kMostFellows ? count++ : count - 1;
        for (; i > 0 && other < distances[i - 1]; --i) distances[i] = distances[i - 1], rows[i] = rows[i - 1];
        distances[i] = other, rows[i] = at;
        if (count == kMostFellows) squared = distances[count - 1];
    }

    // Takes the roots, and copies the coordinates: [num_dimensions, kMostFellows].
    void finish(const double* centers, std::size_t num_dimensions) {
        reach = std::sqrt(squared);
        const std::size_t padded = (count + kLanes - 1) / kLanes * kLanes;
        for (std::size_t i = 0; i < padded; ++i) {
            const std::size_t from = std::min(i, count - 1);  // the last one again
            if (i < count) distances[i] = std::sqrt(distances[i]);
            const double* place = centers + static_cast<std::size_t>(rows[from]) * num_dimensions;
            for (std::size_t k = 0; k < num_dimensions; ++k) places[k * kMostFellows + i] = place[k];
        }
    }

    double squared;  // what a centre must not exceed to be of interest
    std::int32_t self;
    std::size_t count = 0;
    double reach = 0;  // no centre within it is missing
    double distances[kMostFellows];
    std::int32_t rows[kMostFellows];
    double places[kMostDimensions * kMostFellows];
};

// Squared distances to `kLanes` fellows, each summed as `sum_of_squares` does.
inline void squared_to_fellows(const double* point, const double* places, std::size_t num_dimensions, double* squared) {
    double sums[4][kLanes] = {};
    std::size_t k = 0;
    for (; k + 4 <= num_dimensions; k += 4)
        for (std::size_t part = 0; part < 4; ++part)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const double away = point[k + part] - places[(k + part) * kMostFellows + lane];
                sums[part][lane] += away * away;
            }
    for (std::size_t lane = 0; lane < kLanes; ++lane)
        squared[lane] = sums[0][lane] + sums[1][lane] + sums[2][lane] + sums[3][lane];
    for (; k < num_dimensions; ++k)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const double away = point[k] - places[k * kMostFellows + lane];
            squared[lane] += away * away;
        }
}

class Regrouping {
public:
    Regrouping(const RegroupQuery& query, Nearest& found)
        : query_(query), found_(found), tree_(query.centers, query.num_centers, query.num_dimensions) {}

    void regroup(std::size_t group) const {
        const std::int32_t* begin = query_.rows + query_.begins[group];
        const std::int32_t* end = query_.rows + query_.begins[group + 1];
        const auto own = static_cast<std::int32_t>(group);
        const double* center = query_.centers + group * query_.num_dimensions;
        double farthest = 0;
        for (const std::int32_t* row = begin; row < end; ++row) {
            const float* point = query_.points + static_cast<std::size_t>(*row) * query_.num_dimensions;
            const double squared = sum_of_squares(
                query_.num_dimensions, [=](std::size_t k) { return static_cast<double>(point[k]) - center[k]; });
            found_.distances[*row] = squared;
            farthest = std::max(farthest, squared);
        }
        const bool is_listed = static_cast<std::size_t>(end - begin) > kFewPoints;
        Fellows fellows(own, is_listed ? 4 * farthest * (1 + kRoundOff) : 0);
        if (is_listed) tree_.search(center, fellows);
        if (is_listed && fellows.count > 0) fellows.finish(query_.centers, query_.num_dimensions);
        double point[kMostDimensions];
        for (const std::int32_t* row = begin; row < end; ++row) {
            std::copy_n(query_.points + static_cast<std::size_t>(*row) * query_.num_dimensions, query_.num_dimensions,
                        point);
            Best best{found_.distances[*row], own};
            if (!is_listed || !compare(point, fellows, best)) tree_.search(point, best);
            found_.distances[*row] = std::sqrt(best.squared);
            found_.rows[*row] = best.row;
        }
    }

private:
    // Whether the list was long enough.
    bool compare(const double* point, const Fellows& fellows, Best& best) const {
        const double own = std::sqrt(best.squared);
        double limit = 2 * own * (1 + kRoundOff);  // no nearer centre lies farther from the own one
        for (std::size_t i = 0; i < fellows.count; i += kLanes) {
            if (fellows.distances[i] > limit) return true;
            double squared[kLanes];
            squared_to_fellows(point, fellows.places + i, query_.num_dimensions, squared);
            bool is_nearer = false;
            for (std::size_t lane = 0; lane < kLanes; ++lane) is_nearer |= squared[lane] <= best.squared;
            if (!is_nearer) continue;
            for (std::size_t lane = 0; lane < kLanes && i + lane < fellows.count; ++lane)
                best.offer(squared[lane], fellows.rows[i + lane]);
            limit = (own + std::sqrt(best.squared)) * (1 + kRoundOff);
        }
        return fellows.count < kMostFellows || limit < fellows.reach;
    }

    const RegroupQuery& query_;
    Nearest& found_;
    KdTree tree_;
};

}  // namespace

Nearest find_nearest_again(const RegroupQuery& query) {
    Nearest found{std::make_unique_for_overwrite<double[]>(query.num_points),
                  std::make_unique_for_overwrite<std::int32_t[]>(query.num_points)};
    const Regrouping regrouping(query, found);
    const std::size_t per_group = query.num_points / query.num_centers + 1;
    const std::size_t groups_per_item = kPointsPerItem / per_group + 1;
    parallel_for((query.num_centers + groups_per_item - 1) / groups_per_item, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * groups_per_item, end = std::min(begin + groups_per_item, query.num_centers);
        for (std::size_t group = begin; group < end; ++group) regrouping.regroup(group);
    });
    return found;
}

}  // namespace brushgs
