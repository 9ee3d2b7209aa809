// Strokes and their neighbors -> the light that passes the neighbors of each, and how many it touches.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// A stroke is viewed along its thinnest axis, perpendicular to its surface.
struct Coverage {
    const double* means;            // [num_strokes, 3]
    const double* scales;           // [num_strokes, 3] ascending
    const double* axes;             // [num_strokes, 3, 3] as columns, in the order of the scales
    const double* opacities;        // [num_strokes] of each as a neighbor
    const std::int64_t* rows;       // [num_rows] of the strokes that are asked for
    const std::int32_t* neighbors;  // [num_rows, num_neighbors]; a stroke is not its own neighbor
    std::size_t num_rows;
    std::size_t num_neighbors;
    std::size_t num_touching;  // so many first neighbors count for `touching` and `parallel`
    double touch;              // squared Mahalanobis distance below which a neighbor touches
    int num_threads;
    double* passed;    // [num_rows] transmittance of the neighbors at the center
    double* touching;  // [num_rows] how many of the first neighbors touch
    double* parallel;  // [num_rows] sum of the cosines between the normals of these and the own, each 0 to 1
};

// Does not depend on `num_threads`, bit for bit.
void cover(const Coverage& query);

}  // namespace brushgs
