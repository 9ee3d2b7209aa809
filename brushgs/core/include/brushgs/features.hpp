// Gaussians -> points in nine dimensions, of which near ones share a stroke, and their weights in k-means.
#pragma once

#include <cstddef>

#include "brushgs/extent.hpp"

namespace brushgs {

constexpr std::size_t kFeatures = 9;
constexpr double kContributionPower = 0.375;  // of weights: 1/4 costs the skull 0.1 dB, 1/2 the still life 0.6

template <class T>
struct FeatureQuery {
    const T* means;   // [count, 3] world units
    const T* scales;  // [count, 3] standard deviations, world units
    const T* sh;      // [count, sh_terms, 3]
    std::size_t count;
    std::size_t sh_terms;
    Extent extent;        // of the scene
    double color_weight;  // the difference from black to white, radii
    int num_threads;
};

// Contracted position and scales, radii of the scene, and weighted base color of each, [count, kFeatures].
template <class T>
void cluster_features(const FeatureQuery<T>& query, float* points);

// Contracted positions [count, 3], and the factors [count] on lengths there.
template <class T>
void contract_all(const T* means, std::size_t count, const Extent& extent, int num_threads, double* places,
                  double* factors);

// Half axes [count, 3, 3] of Gaussians, as columns, by quaternions [count, 4] of any length above zero, and half axes
// at columns 3 to 5 of their features [count, width].
template <class T>
void feature_spans(const T* quats, const float* points, std::size_t count, std::size_t width, int num_threads,
                   float* spans);

// Standard deviation of base colors among neighbors, [count], 0 to about 0.9: groups of 16 that follow each other on
// the Morton curve of the positions [count, 3]; the last one holds the rest too.
template <class T>
void color_detail(const T* sh, std::size_t sh_terms, const double* places, std::size_t count, int num_threads,
                  double* detail);

// Weights in k-means, [count], above 0 to 1: contribution^(3/8) x color detail, relative to the largest.
//
// Linear weights would spend all clusters on the few largest Gaussians, equal weights on the many hidden ones. Large
// Gaussians of one color, such as a wall, need few strokes: detail (at most 0.1, plus 0.01) moves them to areas with
// more. In trained scenes nearly all areas reach that maximum.
void cluster_weights(const double* contributions, const double* detail, std::size_t count, double* weights);

}  // namespace brushgs
