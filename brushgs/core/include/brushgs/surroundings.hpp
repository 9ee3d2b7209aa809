// Strokes -> what is around each: its nearest others, and the light that these stop.
//
// A stroke is viewed along its thinnest axis, perpendicular to its surface. Only its nearest neighbors count, so deep
// stacks of faint strokes are underestimated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

template <class T>
struct StrokeQuery {
    const T* means;      // [count, 3] world units
    const T* quats;      // [count, 4] w, x, y, z; any length above zero
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    std::size_t count;   // below 2^31
    double finest;       // standard deviation of the finest line in pictures, world units
    int num_threads;     // of which no result depends
};

struct Surroundings {
    static constexpr std::size_t kNeighbors = 16;

    std::vector<double> means;            // [count, 3]
    std::vector<double> scales;           // [count, 3] ascending, as visible in pictures
    std::vector<double> axes;             // [count, 3, 3] as columns, in the order of the scales
    std::vector<double> sizes;            // [count] root of the product of the two largest scales, world units
    std::vector<std::int32_t> neighbors;  // [count, num_neighbors] rows, nearest first
    std::size_t count, num_neighbors;     // kNeighbors, or count - 1 if that is less
    int num_threads;

    // Transmittance of the neighbors at the centers of these rows, by the opacity [count] of each as a neighbor; more
    // than kNeighbors of them need another search.
    std::vector<double> passed(const std::vector<double>& opacities, const std::vector<std::int64_t>& rows,
                               std::size_t num_others = kNeighbors) const;
};

template <class T>
Surroundings surroundings_of(const StrokeQuery<T>& strokes);

}  // namespace brushgs
