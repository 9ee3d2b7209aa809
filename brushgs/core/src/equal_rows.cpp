#include "brushgs/equal_rows.hpp"

#include <bit>

#include "brushgs/key_order.hpp"

namespace brushgs {

namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;  // 2^64 / golden ratio: see brushgs/values/hashing.py

}  // namespace

void hash_rows(const float* columns, std::size_t count, std::size_t width, std::size_t place, std::uint64_t* hashes) {
    for (std::size_t i = 0; i < count; ++i) {
        std::uint64_t hash = hashes[i];
        for (std::size_t k = 0; k < width; ++k) {
            const std::uint64_t bits = std::bit_cast<std::uint32_t>(columns[width * i + k] + 0.0f);  // -0 is 0
            const std::uint64_t mixed = (bits + (place + k) * kGolden) * kGolden;
            hash = (hash ^ mixed ^ (mixed >> 29)) * kGolden;
            hash ^= hash >> 32;
        }
        hashes[i] = hash;
    }
}

double chance(std::uint64_t hash, std::uint64_t seed, std::uint64_t draw) {
    std::uint64_t bits = (hash ^ (seed * kGolden)) + (draw + 1) * kGolden;
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EB;
    return static_cast<double>((bits ^ (bits >> 31)) >> 11) * 0x1p-53;
}

EqualRows group_equal(const std::uint64_t* hashes, std::size_t count, int num_threads) {
    EqualRows found{{}, std::vector<std::int64_t>(count)};
    if (count == 0) return found;
    const auto order = rows_by_key(hashes, count, num_threads);
    std::vector<std::uint32_t> leaders(count);  // the first row that each is equal to
    for (std::size_t i = 0; i < count; ++i) {
        const bool is_new = i == 0 || hashes[order[i]] != hashes[order[i - 1]];
        leaders[order[i]] = is_new ? order[i] : leaders[order[i - 1]];
    }
    for (std::size_t row = 0; row < count; ++row) {
        if (leaders[row] == row) {
            found.groups[row] = static_cast<std::int64_t>(found.first.size());
            found.first.push_back(static_cast<std::int64_t>(row));
        } else {
            found.groups[row] = found.groups[leaders[row]];
        }
    }
    return found;
}

LateCopies late_copies(const std::vector<std::int64_t>& groups) {
    LateCopies found{std::vector<std::uint8_t>(groups.size())};
    std::vector<std::size_t> counts(groups.size());
    for (std::size_t row = 0; row < groups.size(); ++row) {
        if (++counts[static_cast<std::size_t>(groups[row])] <= kMostCopies) continue;
        found.rows[row] = 1;
        found.any = true;
    }
    return found;
}

}  // namespace brushgs
