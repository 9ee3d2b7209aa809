// Arithmetic of directions without sign, see stroke_form.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "brushgs/stroke_form.hpp"

namespace brushgs {

inline double length_of(const Pair& pair) { return std::sqrt(pair.x * pair.x + pair.y * pair.y); }

// A pair of weight 1, and its former weight; (0, 0) stays.
struct UnitPair {
    explicit UnitPair(const Pair& pair) : pair(pair), weight(length_of(pair)) {
        if (weight > 0) this->pair = {pair.x / weight, pair.y / weight};
    }
    Pair pair;
    double weight;
};

// The direction of the larger eigenvalue of a symmetric matrix, times the difference of both.
inline Pair pair_of(double xx, double xy, double yy) { return {xx - yy, 2 * xy}; }

// 0 up to `low`, 1 from `high` on, linear in between.
inline double ramp(double value, double low, double high) { return std::clamp((value - low) / (high - low), 0.0, 1.0); }

inline double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace brushgs
