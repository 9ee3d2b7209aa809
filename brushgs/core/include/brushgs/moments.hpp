// What merging Gaussians takes: their projected areas, covariances by group and the axes of these, and the light that
// the members of a group stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

// Half axes of ellipsoids as they are visible in pictures: where the middle one is below `finest`, the standard
// deviation of the finest line in them, an ellipsoid is at least as thick, a needle in both directions. Continuous as a
// disc narrows to a needle.
template <class T>
void seen_scales(const T* scales,  // [count, 3] half axes
                 std::size_t count, double finest, int num_threads,
                 double* seen);  // [count, 3]

// Mean projected area of ellipsoids over all directions, divided by pi, by Thomsen's formula for their surface: of
// `seen_scales`, which with a `finest` of 0 are the half axes themselves.
template <class T>
void projected_areas(const T* scales,  // [count, 3] half axes
                     std::size_t count, double finest, int num_threads,
                     double* areas);  // [count]

// [count] the paint of Gaussians: such an area times opacity.
template <class T>
std::vector<double> paint_of(const T* scales, const T* opacities, std::size_t count, int num_threads);

template <class T>
struct Covariances {
    const T* means;              // [num_rows, 3]
    const T* quats;              // [num_rows, 4] w, x, y, z; any length above zero
    const T* scales;             // [num_rows, 3]
    const double* shares;        // [num_rows] weights whose sum is 1 in every group
    const std::int32_t* rows;    // as `group_rows` writes them
    const std::int64_t* begins;  // [num_groups + 1]
    const double* centers;       // [num_groups, 3] weighted means of the groups
    std::size_t num_groups;
    int num_threads;
    double* within;   // [num_groups, 3, 3] weighted mean covariance of the members
    double* between;  // [num_groups, 3, 3] covariance of their means
};

// Sums in the order of the rows: they do not depend on `num_threads`, bit for bit.
template <class T>
void sum_covariances(const Covariances<T>& query);

// Standard deviations [count, 3], ascending, and axes [count, 3, 3] (columns, right-handed) of covariances
// [count, 3, 3]. Each is divided by its trace first, so that 1e-100 and 1e100 are treated alike; a variance that
// rounding made negative is zero. Of the two middle and long axes the largest component is positive.
void principal_axes(const double* covariances, std::size_t count, int num_threads, double* scales, double* axes);

template <class T>
struct Stopping {
    const T* opacities;          // [num_rows] 0 to 1
    const double* areas;         // [num_rows] of the members
    const double* footprints;    // [num_groups] areas in which they lie
    const std::int32_t* rows;    // as `group_rows` writes them
    const std::int64_t* begins;  // [num_groups + 1]
    std::size_t num_groups;
    int num_threads;
    double* stopped;  // [num_groups]
};

// The probability that a ray through each footprint is stopped by members at random places in it.
template <class T>
void stop_groups(const Stopping<T>& query);

}  // namespace brushgs
