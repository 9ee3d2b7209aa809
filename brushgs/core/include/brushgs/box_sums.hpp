// The sums of a box over the tiles that it reaches.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "brushgs/record_sums.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

// The total over the tiles for one record of box i: `sums` are those of all entries of the tile lists.
template <int width, class T>
struct BoxSums {
    double values[width] = {};
    bool is_seen = false;  // in any tile

    BoxSums(const BoxVisits& visits, std::size_t i, const RecordSums<T>& sums) {
        constexpr std::uint32_t ahead = 16;  // the entries of a box lie in tiles far from each other
        const std::uint32_t last = visits.starts.back() - 1;
        for (std::uint32_t k = visits.starts[i]; k < visits.starts[i + 1]; ++k) {
            const std::uint32_t entry = visits.entries[k], soon = visits.entries[std::min(k + ahead, last)];
            const T* const of_soon = values_of(sums, sums.is_seen[soon] ? soon : entry);
            __builtin_prefetch(of_soon);
            __builtin_prefetch(of_soon + width - 1);  // they may lie across two lines
            if (!sums.is_seen[entry]) continue;
            is_seen = true;
            const T* const of_tile = values_of(sums, entry);
            for (std::size_t s = 0; s < width; ++s) values[s] += static_cast<double>(of_tile[s]);
        }
    }

private:
    static const T* values_of(const RecordSums<T>& sums, std::uint32_t entry) {
        return sums.values + static_cast<std::size_t>(width) * entry;
    }
};

// Calls `work(i)` for every box, in as many threads as pay.
template <class Work>
void for_boxes(std::size_t count, int num_threads, const Work& work) {
    const int useful = count < kParallelFrom ? 1 : num_threads;
    const std::size_t num_parts = useful > 1 ? static_cast<std::size_t>(4 * useful) : 1;
    parallel_for(num_parts, useful, [&](std::size_t part) {
        for (std::size_t i = count * part / num_parts; i < count * (part + 1) / num_parts; ++i) work(i);
    });
}

}  // namespace brushgs
