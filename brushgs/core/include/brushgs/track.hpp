// Gaussians, still or moving, and the views along a camera path -> the direction of each stroke in each view.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/memory.hpp"
#include "brushgs/project.hpp"

namespace brushgs {

// The storage type of a direction: units of 2^-16 turns, 0.0055 degrees, with the right wraparound.
using Turn = std::int16_t;

struct TrackParams {
    const View* views;      // [count] knots of the path, `step` apart
    std::size_t num_views;  // >= 1
    bool is_closed;         // the last view is the first again
    bool is_coarse;         // the knots are the frames, and far apart: what one frame may turn is limited
    double step;            // change of view from one knot to the next, in units of 1.5 degrees
    double most_turn;       // radians from knot to knot: more would spin from frame to frame
    double growth;          // of the area of a box, at most, from knot to knot, for being off its axis; > 1
    double low_pass;        // added to the projected covariance, pixels squared
    // If the Gaussians move, their columns hold `count` rows for each view, one view after the other: then this is
    // `count`. 0: all views have the same rows.
    std::size_t rows_per_view;
    // [num_views, count] or null: rotation in the picture of the object that each Gaussian paints, by its own motion,
    // radians, -pi to pi. Directions are chosen, limited and given relative to it.
    const float* carried;
    // [num_views, count] or null: not 0 if the object jumps from the previous view. There a stroke may spin at the same
    // cost as between distant frames. On a closed path the first view equals the last.
    const std::uint8_t* jumps;
    // [num_views, count] or null: where each Gaussian should point, and how strongly, 0 to 255. An arrow the other way
    // round costs up to what a box 1.5 times as large does. Null: directions are chosen as lines, and the arrow then.
    const Turn* targets;
    const std::uint8_t* pulls;  // null if and only if `targets` is
    int num_threads;
};

// The area of a box, in areas of the smallest box around its ellipse, is stored as 2^(value / kAreaScaleSteps).
// Coarser steps show: at 32 to an octave the side of a box of 200 pixels moves by more than one.
using AreaScale = std::uint16_t;
constexpr int kAreaScaleSteps = 2048;

struct Tracks {
    Buffer<Turn> turns;             // [num_views, count]
    Buffer<AreaScale> area_scales;  // [num_views, count]
    bool has_area_scales = false;   // whether any area_scale is not 0
};

// Moving Gaussians that are too faint to paint are tracked as if outside the picture. The result does not depend on
// `num_threads`, bit for bit.
template <class T>
Tracks track_directions(const GaussianColumns<T>& gaussians, const TrackParams& params);

}  // namespace brushgs
