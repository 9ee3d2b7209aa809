// Gaussians of a scene -> strokes in space, without views of it, for a page that has no Python: those of an oil
// painting that is not guided by views. Each step is the function that Python calls too.
#pragma once

#include <cstddef>
#include <vector>

#include "brushgs/extent.hpp"
#include "brushgs/look_colors.hpp"
#include "brushgs/scene_rows.hpp"

namespace brushgs {

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
Reach reach_in(const PictureView& view, const std::vector<double>& points);

struct StrokeOptions {
    std::size_t num_strokes;   // at most
    double finest;             // standard deviation of the finest line in pictures, radii of the scene
    double color_weight;       // see FeatureQuery
    double num_steps, gain;    // see Lloyd
    double overlap;            // see Cover
    double keep;               // share of the Gaussians that strokes are made of, at least; see prune.hpp
    double solid;              // strength of solid paint, see solid.hpp
    double lightness, chroma;  // of broken color, see broken_color.hpp
    double follows;            // likewise
    Grading grading;
    std::size_t num_pigments;                       // 0: any color
    double pure;                                    // share of the way to a pigment
    const double *cones_from_rgb, *lab_from_roots;  // [3, 3] each, likewise
    const double* xyz_over_white;                   // [3, 3], see FormQuery
    const double* draws;                            // see Lloyd
};

// Drops floaters, and copies of rows that no picture shows.
void clean_scene(SceneColumns& scene);

// Of a clean scene and its extent: the Gaussians that contribute most, merged where there are more than strokes, those
// that are worth it, as solid paint along the form, graded, mixed of pigments and in broken color. `tell` is called
// with the share of the work that is done.
GaussianColumns strokes_of_scene(const SceneColumns& scene, const Extent& extent, const StrokeOptions& options,
                                 void (*tell)(double share));

}  // namespace brushgs
