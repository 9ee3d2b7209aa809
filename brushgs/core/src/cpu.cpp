#include "brushgs/cpu.hpp"

#include <cstdlib>
#include <string_view>

#ifndef BRUSHGS_ALONE
#include <atomic>
#include <exception>
#include <thread>
#include <vector>
#endif

#if defined(BRUSHGS_HAS_AVX2) || defined(BRUSHGS_HAS_AVX512)
#include <cpuid.h>
#endif

#if defined(__MINGW32__) && !defined(__clang__)
#include <cxxabi.h>
#endif

namespace brushgs {

namespace {

#if defined(__MINGW32__) && !defined(__clang__)
// GCC emulates thread-local variables on Windows. At the end of a thread one key frees their memory, and another runs
// their destructors, in the order in which the keys were created. The first variable would create them in the wrong
// order, and destructors would read freed memory: an empty destructor creates the destructors' key first.
[[gnu::constructor(101)]] void make_key_of_destructors() {
    abi::__cxa_thread_atexit([](void*) {}, nullptr, nullptr);
}
#endif

#if defined(BRUSHGS_HAS_AVX2) || defined(BRUSHGS_HAS_AVX512)
// Of leaves 1 and 7 of cpuid, and of what the system saves of a thread (xgetbv). Compilers have a table of this, but
// Clang on Windows neither fills it nor, with Microsoft's libraries, links it. Source: Intel, Software Developer's
// Manual, volume 2, CPUID and volume 1, 14.3.
struct Features {
    unsigned first = 0, seventh = 0, saved = 0;
    Features() {
        unsigned a = 0, b = 0, c = 0, d = 0;
        if (__get_cpuid(1, &a, &b, &c, &d) != 0) first = c;
        if (__get_cpuid_count(7, 0, &a, &b, &c, &d) != 0) seventh = b;
        constexpr unsigned osxsave = 1U << 27;
        if ((first & osxsave) != 0) __asm__ volatile("xgetbv" : "=a"(saved), "=d"(d) : "c"(0));
    }
    bool has(unsigned of_first, unsigned of_seventh, unsigned of_saved) const {
        return (first & of_first) == of_first && (seventh & of_seventh) == of_seventh && (saved & of_saved) == of_saved;
    }
};
#endif

}  // namespace

bool has_isa(Isa isa) {
#if defined(BRUSHGS_HAS_AVX2) || defined(BRUSHGS_HAS_AVX512)
    static const Features features;
    [[maybe_unused]] constexpr unsigned fma = 1U << 12, avx = 1U << 28;
    [[maybe_unused]] constexpr unsigned bmi = 1U << 3, avx2 = 1U << 5, bmi2 = 1U << 8;
    [[maybe_unused]] constexpr unsigned f = 1U << 16, dq = 1U << 17, bw = 1U << 30, vl = 1U << 31;
    [[maybe_unused]] constexpr unsigned ymm = 0x6, zmm = 0xe6;
#endif
    switch (isa) {
#ifdef BRUSHGS_HAS_AVX512
        case Isa::avx512:
            return features.has(avx | fma, f | dq | bw | vl, zmm);
#endif
#ifdef BRUSHGS_HAS_AVX2
        case Isa::avx2:
            return features.has(avx | fma, avx2 | bmi | bmi2, ymm);
#endif
        default:
            return isa == Isa::baseline;
    }
}

namespace {

Isa choose() {
    const char* wish = std::getenv("BRUSHGS_ISA");
    Isa best = Isa::baseline;
    for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512}) {
        if (has_isa(isa)) best = isa;
        if (wish != nullptr && std::string_view(wish) == isa_name(isa)) break;
    }
    return best;
}

}  // namespace

const char* isa_name(Isa isa) {
    switch (isa) {
        case Isa::avx512:
            return "avx512";
        case Isa::avx2:
            return "avx2";
        default:
            return "baseline";
    }
}

Isa best_isa() {
    static const Isa chosen = choose();
    return chosen;
}

#ifndef BRUSHGS_ALONE

namespace {

// Threads that are joined, even if starting one of them fails. Not std::jthread, which older versions of libc++, the
// library of macOS, do not have.
struct JoinedThreads {
    std::vector<std::thread> threads;
    ~JoinedThreads() {
        for (std::thread& thread : threads) thread.join();
    }
};

}  // namespace

void run_in_parallel(std::size_t count, int num_threads, const void* work,
                     void (*run)(const void* work, std::size_t item)) {
    std::atomic<std::size_t> next{0};
    std::atomic_flag has_failed;
    std::exception_ptr failure;
    const auto drain = [&] {
        try {
            for (std::size_t item = next++; item < count; item = next++) run(work, item);
        } catch (...) {
            next = count;
            if (!has_failed.test_and_set()) failure = std::current_exception();
        }
    };
    const auto most = static_cast<std::size_t>(num_threads > 1 ? num_threads : 1);
    const std::size_t num_helpers = (most < count ? most : (count > 0 ? count : 1)) - 1;
    {
        JoinedThreads helpers;
        helpers.threads.reserve(num_helpers);
        for (std::size_t i = 0; i < num_helpers; ++i) helpers.threads.emplace_back(drain);
        drain();
    }
    if (failure) std::rethrow_exception(failure);
}

#endif

}  // namespace brushgs
