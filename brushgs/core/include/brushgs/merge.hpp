// Gaussians and a label for each -> one Gaussian for each label, which paints what its members painted, where they
// painted it: the rule "cover" of brushgs/passes/reduce/merge.py, which explains it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

template <class T>
struct MergeColumns {
    T* means;      // [count, 3] world units
    T* quats;      // [count, 4] w, x, y, z; any length above zero
    T* scales;     // [count, 3] standard deviations, world units
    T* opacities;  // [count] 0 to 1
    T* sh;         // [count, sh_terms, 3]
};

template <class T>
struct Cover {
    MergeColumns<const T> members;
    std::size_t num_members;
    std::size_t sh_terms;
    const double* areas;         // [num_members] as visible in pictures
    const double* visible;       // [num_members] share of directions from which each is visible, > 0
    const std::int32_t* labels;  // [num_members], each in [0, num_groups), each in use
    std::size_t num_groups;
    double overlap;    // factor on the variance between members
    bool closes_gaps;  // whether it grows where strokes would leave gaps, see gaps.hpp
    double finest;     // standard deviation of the finest line in pictures, world units
    int num_threads;
};

// Writes num_groups Gaussians; a single member is copied. Sums run in the order of the rows: they do not depend on
// `num_threads`, bit for bit.
template <class T>
void cover_members(const Cover<T>& query, const MergeColumns<T>& merged);

}  // namespace brushgs
