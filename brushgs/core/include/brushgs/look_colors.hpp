// Colors of strokes in a look: graded, and mixed of few pigments. brushgs/passes/color/tone.py and
// brushgs/passes/color/pigments.py say why.
#pragma once

#include <array>
#include <cstddef>

#include "brushgs/stroke_relief.hpp"

namespace brushgs {

// In OKLab; the usual values change nothing.
struct Grading {
    double chroma = 1, contrast = 1, pivot = 0.6;
    std::array<double, 2> shadows{}, lights{};  // shifts of a and b in dark and in light colors
};

// Shifts the base colors in `sh` [count, sh_terms, 3].
template <class T>
void grade(const Grading& grading, const double* cones_from_rgb, const double* lab_from_roots, std::size_t count,
           std::size_t sh_terms, T* sh);

struct Pigments {
    std::size_t num_pigments;  // at least 1
    double share;              // of the way to the pigment, 0 to 1
    const double* draws;       // the others as in `Lloyd`
    int num_steps;
    double gain;
    int num_threads;
};

// Writes the display-encoded colors [count, 3] of strokes, each near one of the pigments.
template <class T>
void mix_pigments(const PaintedStrokes<T>& strokes, const Pigments& pigments, double* rgb);

}  // namespace brushgs
