// The directions of the surface at strokes, by the Gaussians that they were made of.
#pragma once

#include <vector>

#include "brushgs/stroke_form.hpp"

namespace brushgs {

struct SurfaceField {
    std::vector<Pair> color;   // along lines of equal color; weight 0 to 1, 1/2 for a step that is just visible
    std::vector<Pair> extent;  // along the extent of the surface; weight 0 to 1, 0 if it is as long as wide, or none
};

// Of at least one Gaussian.
template <class T>
SurfaceField surface_field(const std::vector<StrokePlane>& planes, const SurfaceQuery<T>& gaussians, int num_threads);

}  // namespace brushgs
