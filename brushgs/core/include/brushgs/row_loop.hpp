// Work on rows, in threads.
#pragma once

#include <algorithm>
#include <cstddef>

#include "brushgs/cpu.hpp"

namespace brushgs {

// Calls `work(i)` for every i in [0, count), `per_item` at a time.
template <class Work>
void for_each_row(std::size_t count, std::size_t per_item, int num_threads, const Work& work) {
    parallel_for((count + per_item - 1) / per_item, num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * per_item, count);
        for (std::size_t i = item * per_item; i < end; ++i) work(i);
    });
}

}  // namespace brushgs
