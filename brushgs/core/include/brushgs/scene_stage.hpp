// The stage of a scene's strokes, for a page that has no Python: `find_site`, `open_stage` and `painted_stage` of
// brushgs/passes/add/stage.py for one camera, with the usual lamp. Each step is the function of stage.hpp that Python
// calls too; only the random numbers are others.
#pragma once

#include "brushgs/colors.hpp"
#include "brushgs/scene_strokes.hpp"

namespace brushgs {

// The mean color of Gaussians by their paint, OKLab.
std::array<double, 3> mean_lab(const GaussianColumns& gaussians, const Oklab& oklab);

struct StageOptions {
    PictureView view;                               // that the scene is first seen in
    const double* level;                            // [3, 3] rows right, down and away of that view, made level
    double size, aspect;                            // of strokes: 1 for the usual size; length over width
    double lightness, chroma;                       // standard deviations from stroke to stroke, OKLab
    double shadow;                                  // strength of shadow, contact and reflected color, 0 to 1
    double values;                                  // see ToneChoice
    const double *cones_from_rgb, *lab_from_roots;  // [3, 3]
};

struct StagedStrokes {
    GaussianColumns stage;             // none where the scene fills its picture, or is flat
    std::vector<float> opacities, sh;  // of the strokes on it: what lies under the table is gone, and a ground
                                       // dissolves into it toward its border
};

// `scene` is clean, `strokes` are made of it; centers of both in world units.
StagedStrokes staged_strokes(const SceneColumns& scene, const GaussianColumns& strokes, const StageOptions& options);

}  // namespace brushgs
