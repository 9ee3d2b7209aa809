// The subject of a scene: the box that holds it, and samples of its rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace brushgs {

constexpr double kTail = 0.007;                   // share of the weight at each end of an axis that may be strays
constexpr std::size_t kMostSubjectRows = 20'000;  // for bounds: of larger scenes every n-th Gaussian is used

// The values at which the running sum of weights, by ascending value, reaches shares `at` of the whole.
std::vector<double> weighted_quantiles(std::span<const double> values, std::span<const double> weights,
                                       std::span<const double> at);

// At most `most` of `count` row numbers, ascending: one per equal part, at a random place in it.
std::vector<std::uint32_t> thinned(std::size_t count, std::size_t most);

// The part of space that holds the heaviest of several clumps of points [count, 3] that are so far apart that each is a
// dot seen from the other; all of it if there is only one. Splits at gaps along the axes until there is none.
struct Clump {
    double low[3], high[3];

    bool is_part() const;
    bool holds(const double* point) const;
};
Clump heaviest_clump(const double* points, std::span<const double> weights);

// See `subject` of brushgs/cameras/framing.py. If `is_whole`, scenes are taken to have no surroundings.
struct Subject {
    std::vector<std::uint32_t> rows;  // of the scene, at least one: those sampled that belong to the subject
    bool has_surroundings = false;
};
template <class T>
Subject find_subject(const T* means, const T* opacities, std::size_t count, bool is_whole);

}  // namespace brushgs
