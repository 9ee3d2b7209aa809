// Gaussians of a scene, by weight -> those to keep.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// The weights [count] times 1/4 to 4, varying along the Morton curve of the places [count, 3], so that among equal
// neighbors some stay: by weight alone whole patches would go.
void spread_weights(const double* weights, const double* places, std::size_t count, int num_threads, double* ranked);

// How many rows of the lowest rank [count] together hold at most 5 % of the weights [count], all >= 0. A few Gaussians
// as large as the sky must not make all others negligible: weights count up to their 90th percentile.
std::size_t count_spare(const double* weights, const double* ranked, std::size_t count, int num_threads);

// Writes 1 for the `num_kept` highest of the weights [count], 1 to `count`, 0 for others; ties go to earlier rows.
void mark_highest(const double* weights, std::size_t count, std::size_t num_kept, std::uint8_t* is_kept);

}  // namespace brushgs
