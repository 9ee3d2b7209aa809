// Which instruction set the kernels run on, and the threads they run in.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace brushgs {

enum class Isa { baseline, avx2, avx512 };

// The best instruction set of this processor, unless the environment variable BRUSHGS_ISA
// (baseline, avx2 or avx512) names a lesser one. Read once.
Isa best_isa();

const char* isa_name(Isa isa);

// Calls `work(item)` once for every item in [0, count), spread over `num_threads` threads; items are
// taken one by one, so uneven items balance. What `work` writes must depend on the item alone: then results
// do not depend on the number of threads. If it throws, no more items are started and the first exception
// is rethrown here.
// Threads are made per call (some 20 us each): a pool that waits would break on fork, and one that
// spins slows everything else on a busy machine.
template <class Work>
void parallel_for(std::size_t count, int num_threads, const Work& work) {
    std::atomic<std::size_t> next{0};
    std::atomic_flag has_failed;
    std::exception_ptr failure;
    const auto drain = [&] {
        try {
            for (std::size_t item = next++; item < count; item = next++) work(item);
        } catch (...) {
            next = count;
            if (!has_failed.test_and_set()) failure = std::current_exception();
        }
    };
    const auto most = static_cast<std::size_t>(num_threads > 1 ? num_threads : 1);
    const std::size_t num_helpers = (most < count ? most : (count > 0 ? count : 1)) - 1;
    {
        std::vector<std::jthread> helpers;
        helpers.reserve(num_helpers);
        for (std::size_t i = 0; i < num_helpers; ++i) helpers.emplace_back(drain);
        drain();
    }
    if (failure) std::rethrow_exception(failure);
}

}  // namespace brushgs
