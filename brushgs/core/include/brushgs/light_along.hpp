// Positions along a line -> the logarithm of the light that reaches each from both ends.
#pragma once

#include <cstddef>

namespace brushgs {

struct LightAlong {
    const double* places;  // [count] >= 0; what lies in different columns is more than `reach` apart
    const double* depths;  // [count] optical depths, >= 0
    std::size_t count;     // below 2^32
    double reach;          // farther away nothing counts
    double* from_above;    // [count] minus the sum of the depths above, within reach
    double* from_below;    // [count] the same below; what lies at the same place does not count
};

void light_along(const LightAlong& query);

}  // namespace brushgs
