// Groups of points -> two halves of each, by 2-means that starts across the widest direction.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

inline constexpr std::size_t kMostFeatures = 16;  // of a point

template <class T>
struct Halving {
    const T* points;             // [num_rows, num_features], the first three are positions
    std::size_t num_features;    // 3 to kMostFeatures
    const double* weights;       // [num_rows] > 0
    const T* spans;              // [num_rows, 3, 3] half axes of the points as columns, or null
    const std::int32_t* rows;    // as `group_rows` writes them
    const std::int64_t* begins;  // [num_groups + 1]
    std::size_t num_groups;
    double least_span;  // in any direction, of the mean square distance in a group
    int num_steps;      // of 2-means
    int num_threads;
    std::uint8_t* is_second;  // [begins[num_groups]], in the order of `rows`: 0 for the half of a group's first row
};

// With spans, distances count less along the length of members: overlapping members stay together rather than members
// side by side. Does not depend on `num_threads`, bit for bit.
template <class T>
void halve_groups(const Halving<T>& halving);

}  // namespace brushgs
