// Points -> the nearest of some centres, exactly: by a k-d tree of the centres.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace brushgs {

constexpr std::size_t kMostDimensions = 16;

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
    std::unique_ptr<std::int32_t[]> rows;  // [num_points]; of equally near centres the first
};

// Fastest where points that follow each other lie near each other. Does not depend on `num_threads`, bit for bit.
Nearest find_nearest(const NearestQuery& query);

}  // namespace brushgs
