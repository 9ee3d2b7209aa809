// The pixels of a picture, a run at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "brushgs/cpu.hpp"

namespace brushgs {

inline constexpr std::size_t kPixelsPerItem = 1 << 14;  // work handed to a thread at a time

// Calls `work(first, end)` for all pixels, in threads.
template <class Work>
void for_pixels(std::size_t num_pixels, int num_threads, const Work& work) {
    parallel_for((num_pixels + kPixelsPerItem - 1) / kPixelsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t first = item * kPixelsPerItem;
        work(first, std::min(first + kPixelsPerItem, num_pixels));
    });
}

// Turns the number of entries of each pixel, `counts`, into their starts in a list of all; one more start than pixels.
// Returns the length of the list.
inline std::size_t starts_of_counts(std::int64_t* counts, std::size_t num_pixels) {
    std::int64_t total = 0;
    for (std::size_t pixel = 0; pixel < num_pixels; ++pixel) {
        const std::int64_t count = counts[pixel];
        counts[pixel] = total;
        total += count;
    }
    counts[num_pixels] = total;
    return static_cast<std::size_t>(total);
}

}  // namespace brushgs
