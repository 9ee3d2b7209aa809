// How fast directions of strokes turn as the view moves.
#pragma once

#include <cstddef>

namespace brushgs {

struct TurnRates {
    const float* toward;   // [3, num_views, num_strokes] unit vectors from the strokes to the cameras
    const float* weights;  // [num_views, num_strokes]
    const double* facing;  // [num_candidates, 3, num_strokes] unit vectors
    std::size_t num_views, num_strokes, num_candidates;
    double most;  // the largest rate of a view
    int num_threads;
    double* rates;  // [num_candidates, num_strokes]
};

// Writes weighted sums over the views of (1 - c) / (1 + c), with c the cosine between view and candidate.
void turn_rates(const TurnRates& query);

}  // namespace brushgs
