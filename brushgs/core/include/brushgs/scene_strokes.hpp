// Gaussians of a scene -> strokes in space, without views of it: what `brushgs.cluster(gaussians, num_strokes)` makes,
// for a page that has no Python. Each step is the function that Python calls too.
#pragma once

#include <cstddef>
#include <vector>

#include "brushgs/extent.hpp"

namespace brushgs {

struct SceneGaussians {
    const float* means;      // [count, 3] world units
    const float* quats;      // [count, 4] w, x, y, z; any length above zero
    const float* scales;     // [count, 3] standard deviations, world units
    const float* opacities;  // [count] 0 to 1
    const float* sh;         // [count, sh_terms, 3]
    std::size_t count;       // 1 to 2^31 - 1
    std::size_t sh_terms;
    bool is_antialiased;  // then none is thicker in pictures than it is
};

// How far nearly all points are from the middle of a picture, to the sides and up and down, pixels: `reach_in` of
// brushgs/outlets/page/view.py. Zeros if it holds but few of them.
struct PictureView {
    double viewmat[12];  // camera from world, the first three rows of [4, 4]
    double fx, fy;       // pixels
    double width, height;
    double near;
};
struct Reach {
    double across = 0, down = 0;
};
Reach reach_in(const PictureView& view, const float* means, std::size_t count);

struct SceneStrokes {
    std::vector<float> means, quats, scales, opacities, sh;  // as in SceneGaussians
    std::size_t count = 0;
    std::size_t sh_terms = 1;
};

struct StrokeOptions {
    std::size_t num_strokes;  // at most
    double finest;            // standard deviation of the finest line in pictures, radii of the scene
    double color_weight;      // see FeatureQuery
    double num_steps, gain;   // see Lloyd
    double overlap;           // see Cover
    const double* draws;      // see Lloyd
};

// The Gaussians themselves if there are not more than strokes. `tell` is called with the share of the work that is
// done.
SceneStrokes strokes_of_scene(const SceneGaussians& gaussians, const Extent& extent, const StrokeOptions& options,
                              void (*tell)(double share));

}  // namespace brushgs
