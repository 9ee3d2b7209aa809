// Center and radius of a scene, robust against outliers, and positions in them.
#pragma once

#include <cstddef>
#include <vector>

namespace brushgs {

// The value below which that share of some values lies, interpolated linearly between two; the values change places.
// `lower` is a smaller share, or the same, that was asked for just before: values below it are not looked at again.
double percentile(std::vector<double>& values, double share, double lower = 0);

struct Extent {
    double center[3];  // world units
    double radius;     // > 0
};

// The middle and half the diagonal of the box that holds 98 % of the points [count, 3] along each axis; of the box of
// all points if that has no size, and a radius of 1 if that has none either.
template <class T>
Extent robust_extent(const T* points, std::size_t count, int num_threads);

// A position in radii of the scene from its center, contracted beyond one radius to less than two; returns the factor
// on lengths there. Source: Barron et al. 2022, Mip-NeRF 360, eq. 10.
template <class T>
double contract(const T* point, const Extent& extent, double* place);

}  // namespace brushgs
