#include "brushgs/cpu.hpp"

#include <cstdlib>
#include <string_view>

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

bool supports(Isa isa) {
    switch (isa) {
#ifdef BRUSHGS_HAS_AVX512
        case Isa::avx512:
            return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                   __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#endif
#ifdef BRUSHGS_HAS_AVX2
        case Isa::avx2:
            return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                   __builtin_cpu_supports("bmi2");
#endif
        default:
            return isa == Isa::baseline;
    }
}

Isa choose() {
    const char* wish = std::getenv("BRUSHGS_ISA");
    Isa best = Isa::baseline;
    for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512}) {
        if (!supports(isa)) continue;
        best = isa;
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

}  // namespace brushgs
