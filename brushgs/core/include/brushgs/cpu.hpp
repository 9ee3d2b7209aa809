// The instruction set and the threads of the kernels.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <type_traits>

namespace brushgs {

enum class Isa { baseline, avx2, avx512 };

// Whether this processor has an instruction set and the kernels are compiled for it.
bool has_isa(Isa isa);

// The best of these sets, unless the environment variable BRUSHGS_ISA (baseline, avx2 or avx512) names a lesser one:
// then the best up to that. Read once.
Isa best_isa();

const char* isa_name(Isa isa);

// The namespaces of the kernels; `best_isa` never names a set that they are not compiled for.
#ifdef BRUSHGS_HAS_AVX2
#define BRUSHGS_AVX2 avx2
#else
#define BRUSHGS_AVX2 baseline
#endif
#ifdef BRUSHGS_HAS_AVX512
#define BRUSHGS_AVX512 avx512
#else
#define BRUSHGS_AVX512 baseline
#endif

template <class Kernel>
Kernel* pick_kernel(Kernel* baseline, Kernel* avx2, Kernel* avx512) {
    switch (best_isa()) {
        case Isa::avx512:
            return avx512;
        case Isa::avx2:
            return avx2;
        default:
            return baseline;
    }
}

// The function template of that name for a scalar type T and the instruction set in use. Versions in double, used for
// gradient checks and never for a picture of a scene file, are compiled once, for the baseline and with little
// optimisation: it saves a third of all compile time, and results are the same.
#define BRUSHGS_KERNEL(name, T)                                                                       \
    [] {                                                                                              \
        if constexpr (std::is_same_v<T, double>)                                                      \
            return &in_double::name<T>;                                                               \
        else                                                                                          \
            return pick_kernel(&baseline::name<T>, &BRUSHGS_AVX2::name<T>, &BRUSHGS_AVX512::name<T>); \
    }()

// BRUSHGS_ALONE builds the kernels for a page in a browser: WebAssembly with one thread and without exceptions. Memory
// that runs out then ends the program, which the page reports.
[[noreturn]] inline void out_of_memory() {
#ifdef BRUSHGS_ALONE
    std::abort();
#else
    throw std::bad_alloc();
#endif
}

#ifdef BRUSHGS_ALONE

template <class Work>
void parallel_for(std::size_t count, int, const Work& work) {
    for (std::size_t item = 0; item < count; ++item) work(item);
}

#else

// `parallel_for`, which is compiled once: its threads and exceptions would take long to compile for every `work`.
void run_in_parallel(std::size_t count, int num_threads, const void* work,
                     void (*run)(const void* work, std::size_t item));

// Calls `work(item)` once for every item in [0, count), spread over `num_threads` threads; items are taken one by one,
// so uneven items balance. The output of `work` must depend only on the item: then results do not depend on the number
// of threads. If it throws, no more items are started and the first exception is rethrown here. Threads are made per
// call (some 20 us each): a pool that waits would break on fork, and one that spins slows everything else on a busy
// machine.
template <class Work>
void parallel_for(std::size_t count, int num_threads, const Work& work) {
    run_in_parallel(count, num_threads, &work,
                    [](const void* own, std::size_t item) { (*static_cast<const Work*>(own))(item); });
}

#endif

}  // namespace brushgs
