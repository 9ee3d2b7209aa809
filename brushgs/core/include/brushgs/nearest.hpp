// Points -> the nearest of some centers, or of each other, one or several, exactly: by a k-d tree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace brushgs {

constexpr std::size_t kMostDimensions = 16;
constexpr std::size_t kMostNeighbors = 256;

struct NearestQuery {
    const float* points;    // [num_points, num_dimensions]
    const double* centers;  // [num_centers, num_dimensions]
    std::size_t num_points;
    std::size_t num_centers;     // 1 to 2^31 - 1
    std::size_t num_dimensions;  // 1 to kMostDimensions
    int num_threads;
};

struct Nearest {
    std::unique_ptr<double[]> distances;   // [num_points]
    std::unique_ptr<std::int32_t[]> rows;  // [num_points]; of equally near centers the first
};

// Fastest if consecutive points are near each other. Does not depend on `num_threads`, bit for bit.
Nearest find_nearest(const NearestQuery& query);

// Points, grouped by their previous nearest center.
struct PointGroups {
    const float* points;         // [num_points, num_dimensions]
    const double* centers;       // [num_groups, num_dimensions]
    const std::int32_t* rows;    // [num_points] of the points, group by group
    const std::int64_t* begins;  // [num_groups + 1] where the groups begin among them
    std::size_t num_points;
    std::size_t num_groups;      // 1 to 2^31 - 1
    std::size_t num_dimensions;  // 1 to kMostDimensions
};

// The result of `find_nearest` for moved centers, bit for bit, but several times faster if most points stay in their
// groups.
Nearest find_nearest_again(const PointGroups& groups, int num_threads);

// Centers that are added to those of the groups.
struct NearerQuery {
    const double* others;  // [num_others, num_dimensions]
    std::size_t num_others;
    std::int32_t first;  // the label of the first of them
    int num_threads;
    double* distances;     // [num_points] to the nearest so far, brought up to date
    std::int32_t* labels;  // [num_points] likewise; of equally near ones the first
};

void find_nearer(const PointGroups& groups, const NearerQuery& query);

struct NeighborQuery {
    const double* points;        // [num_points, num_dimensions], finite
    std::size_t num_points;      // below 2^31
    std::size_t num_neighbors;   // of each, below num_points, at most kMostNeighbors
    std::size_t num_dimensions;  // 1 to kMostDimensions
    int num_threads;
};

// Writes the rows of the other points nearest to each, [num_points, num_neighbors], nearest first, ties by row.
// Does not depend on `num_threads`.
void find_neighbors(const NeighborQuery& query, std::int32_t* neighbors);

struct SeveralQuery {
    const double* points;    // [num_points, num_dimensions], finite
    const double* queries;   // [num_queries, num_dimensions], finite
    std::size_t num_points;  // below 2^31
    std::size_t num_queries;
    std::size_t num_nearest;     // for each query, at most num_points and kMostNeighbors
    std::size_t num_dimensions;  // 1 to kMostDimensions
    int num_threads;
};

// Writes for each query the points nearest to it, distances and rows, both [num_queries, num_nearest], nearest first,
// ties by row. Does not depend on `num_threads`, bit for bit.
void find_several(const SeveralQuery& query, double* distances, std::int32_t* rows);

}  // namespace brushgs
