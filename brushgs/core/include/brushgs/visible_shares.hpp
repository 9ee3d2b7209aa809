// Gaussians -> the share of directions from which others do not hide each.
#pragma once

#include <cstddef>

#include "brushgs/extent.hpp"

namespace brushgs {

template <class T>
struct VisibleShares {
    const T* means;       // [count, 3] world units
    const T* opacities;   // [count] 0 to 1
    const double* areas;  // [count] projected areas as visible in pictures, over pi, world units squared
    std::size_t count;    // below 2^32
    Extent extent;        // of the means
    int num_threads;
    double* shares;  // [count] 1e-6 to 1
};

// Along each of 7 lines the scene is divided into square columns. In a column every Gaussian attenuates light by the
// share of the cross-section it covers; the light that reaches a Gaussian through the nearest quarter of the scene's
// radius, from both ends, averaged over the lines, is its share. An estimate: Gaussians are assumed to cover their
// column evenly. Does not depend on `num_threads`, bit for bit.
template <class T>
void visible_shares(const VisibleShares<T>& query);

}  // namespace brushgs
