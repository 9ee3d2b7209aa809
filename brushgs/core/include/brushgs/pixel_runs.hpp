// The pixels of a picture, a run at a time.
#pragma once

#include <algorithm>
#include <cstddef>

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

}  // namespace brushgs
