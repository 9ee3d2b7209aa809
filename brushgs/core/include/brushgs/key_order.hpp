// 64-bit keys -> their rows in ascending order; and points in space -> their rows along the Morton curve.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/memory.hpp"

namespace brushgs {

// The rows by ascending key, equal keys by row; below 2^32 rows.
Buffer<std::uint32_t> rows_by_key(const std::uint64_t* keys, std::size_t count, int num_threads);

// Keys in the order of numbers >= 0: their bits.
void keys_of(const double* values, std::size_t count, std::uint64_t* keys);

// Keys of points [count, 3] along the Morton curve: (point - low) * step, cut to whole numbers of 21 bits, their
// bits interleaved.
template <class T>
void morton_keys(const T* points, std::size_t count, const double* low, double step, int num_threads,
                 std::uint64_t* keys);

// The rows of points [count, num_dimensions] along the Morton curve of their first three numbers, ties by row. All axes
// have the same 2^21 steps over the largest extent.
template <class T>
Buffer<std::uint32_t> rows_along_curve(const T* points, std::size_t count, std::size_t num_dimensions, int num_threads);

}  // namespace brushgs
