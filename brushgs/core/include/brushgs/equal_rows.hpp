// Rows that are equal in all their columns, by a 64-bit hash of their bits; and that hash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

// Adds columns [count, width] to the hashes [count] of rows, which begin as zeros; 0 and -0 are the same. `place` is 1
// plus the number of values in each row before these.
void hash_rows(const float* columns, std::size_t count, std::size_t width, std::size_t place, std::uint64_t* hashes);

// A uniform random number in [0, 1) for a row of this hash; independent for other seeds and draws.
// Source: the finaliser of splitmix64 (Steele, Lea and Flood 2014, Fast splittable pseudorandom number generators).
double chance(std::uint64_t hash, std::uint64_t seed, std::uint64_t draw);

struct EqualRows {
    std::vector<std::int64_t> first;   // the first row of each group of equal ones, ascending
    std::vector<std::int64_t> groups;  // [count] the index of the group of each row
};

// Different rows share a hash once in some 1e19 pairs: not in any scene that fits on a disk. Below 2^32 rows.
EqualRows group_equal(const std::uint64_t* hashes, std::size_t count, int num_threads);

// Each of several equal Gaussians stops at least 1/255 of the light of a pixel, and a pixel is finished at 1e-4: copies
// after the first of these are never visible.
constexpr std::size_t kMostCopies = 2345;

// Marks [count] of rows after the first `kMostCopies` of their group, and whether there are any.
struct LateCopies {
    std::vector<std::uint8_t> rows;
    bool any = false;
};
LateCopies late_copies(const std::vector<std::int64_t>& groups);

}  // namespace brushgs
