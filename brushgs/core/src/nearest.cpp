// Searches of a k-d tree for every point, in threads.
#include "brushgs/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/cpu.hpp"
#include "brushgs/kd_tree.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kPointsPerItem = 2048;  // work handed to a thread at a time, some 1 ms
constexpr std::size_t kQueriesPerItem = 256;  // the same, of queries for several
constexpr std::int32_t kNoRow = -1;

// The `count` nearest so far, nearest first, ties by row; without row `own`, the point itself, unless that is kNoRow.
struct Several {
    Several(std::size_t most, std::int32_t own) : count(most), self(own) {
        std::fill_n(distances, count, squared);
        std::fill_n(rows, count, std::numeric_limits<std::int32_t>::max());
    }

    void offer(double other, std::int32_t at) {
        if (at == self || !is_before(other, at, count - 1)) return;
        std::size_t i = count - 1;
        for (; i > 0 && is_before(other, at, i - 1); --i) distances[i] = distances[i - 1], rows[i] = rows[i - 1];
        distances[i] = other, rows[i] = at;
        squared = distances[count - 1];
    }

    bool is_before(double other, std::int32_t at, std::size_t i) const {
        return other < distances[i] || (other == distances[i] && at < rows[i]);
    }

    std::size_t count;
    std::int32_t self;
    double squared = std::numeric_limits<double>::infinity();
    double distances[kMostNeighbors];
    std::int32_t rows[kMostNeighbors];
};

}  // namespace

Nearest find_nearest(const NearestQuery& query) {
    Nearest found{std::make_unique_for_overwrite<double[]>(query.num_points),
                  std::make_unique_for_overwrite<std::int32_t[]>(query.num_points)};
    const KdTree tree(query.centers, query.num_centers, query.num_dimensions, query.num_threads);
    const std::size_t num_items = (query.num_points + kPointsPerItem - 1) / kPointsPerItem;
    parallel_for(num_items, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kPointsPerItem, end = std::min(begin + kPointsPerItem, query.num_points);
        double point[kMostDimensions];
        std::int32_t row = 0;  // begins with what is nearest to the point before
        for (std::size_t i = begin; i < end; ++i) {
            std::copy_n(query.points + i * query.num_dimensions, query.num_dimensions, point);
            const double* place = query.centers + static_cast<std::size_t>(row) * query.num_dimensions;
            Best best{sum_of_squares(query.num_dimensions, [&](std::size_t k) { return point[k] - place[k]; }), row};
            tree.search(point, best);
            found.distances[i] = std::sqrt(best.squared);
            found.rows[i] = row = best.row;
        }
    });
    return found;
}

void find_neighbors(const NeighborQuery& query, std::int32_t* neighbors) {
    if (query.num_points == 0 || query.num_neighbors == 0) return;
    const KdTree tree(query.points, query.num_points, query.num_dimensions, query.num_threads);
    const std::size_t num_items = (query.num_points + kPointsPerItem - 1) / kPointsPerItem;
    parallel_for(num_items, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kPointsPerItem, end = std::min(begin + kPointsPerItem, query.num_points);
        for (std::size_t i = begin; i < end; ++i) {  // in the order of the tree, where neighbors follow each other
            const std::int32_t row = tree.rows()[i];
            Several found(query.num_neighbors, row);
            tree.search(query.points + static_cast<std::size_t>(row) * query.num_dimensions, found);
            std::copy_n(found.rows, query.num_neighbors,
                        neighbors + static_cast<std::size_t>(row) * query.num_neighbors);
        }
    });
}

void find_several(const SeveralQuery& query, double* distances, std::int32_t* rows) {
    if (query.num_queries == 0 || query.num_nearest == 0) return;
    const KdTree tree(query.points, query.num_points, query.num_dimensions, query.num_threads);
    const std::size_t num_items = (query.num_queries + kQueriesPerItem - 1) / kQueriesPerItem;
    parallel_for(num_items, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kQueriesPerItem, end = std::min(begin + kQueriesPerItem, query.num_queries);
        for (std::size_t i = begin; i < end; ++i) {
            Several found(query.num_nearest, kNoRow);
            tree.search(query.queries + i * query.num_dimensions, found);
            std::transform(found.distances, found.distances + query.num_nearest, distances + i * query.num_nearest,
                           [](double squared) { return std::sqrt(squared); });
            std::copy_n(found.rows, query.num_nearest, rows + i * query.num_nearest);
        }
    });
}

}  // namespace brushgs
