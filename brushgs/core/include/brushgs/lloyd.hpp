// Weighted points -> clusters, by k-means: points to the nearest center, centers to the mean of their points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace brushgs {

struct WeightedPoints {
    const float* points;         // [num_points, num_dimensions], finite; the first three are positions in space
    const double* weights;       // [num_points] > 0
    std::size_t num_points;      // 1 to 2^31 - 1
    std::size_t num_dimensions;  // 1 to kMostDimensions of nearest.hpp
};

// How many random numbers `start_centers` may use.
std::size_t most_draws(std::size_t num_clusters);

// First centers, [k, num_dimensions], k at most `num_clusters`: fewer only if there are fewer distinct points.
//
// They are taken in rounds, by systematic sampling along the points, which should lie along a space-filling curve. The
// first round samples by weight, later ones by weight x squared distance to the nearest center so far. Compared with
// one round the inertia after equal steps is 1 to 40 % lower.
// Source: Bahmani et al. 2012, Scalable k-means++ (rounds; there the samples are random).
std::vector<double> start_centers(const WeightedPoints& points, std::size_t num_clusters,
                                  const double* draws,  // [most_draws(num_clusters)] 0 to below 1
                                  int num_threads);

struct Lloyd {
    std::size_t num_clusters;  // 1 to num_points
    const double* draws;       // [most_draws(num_clusters)] 0 to below 1
    int num_steps;             // at most
    double gain;               // a step that reduces the inertia by less than this share is the last
    int num_threads;
};

struct Clusters {
    std::unique_ptr<std::int32_t[]> labels;  // [num_points] 0 to num_clusters - 1, each in use
    std::size_t num_clusters;
    int num_steps;
    double inertia;  // sum of weight x squared distance to the nearest of the final centers
};

// Every step is exact. A center without points restarts at the point with the largest weighted squared distance to its
// center. Does not depend on `num_threads`, bit for bit.
Clusters find_clusters(const WeightedPoints& points, const Lloyd& lloyd);

}  // namespace brushgs
