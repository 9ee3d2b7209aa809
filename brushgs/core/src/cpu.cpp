#include "brushgs/cpu.hpp"

#include <cstdlib>
#include <string_view>

namespace brushgs {

namespace {

Isa detect() {
#ifdef BRUSHGS_X86
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        return Isa::avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
        __builtin_cpu_supports("bmi2"))
        return Isa::avx2;
#endif
    return Isa::baseline;
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
    static const Isa chosen = [] {
        const Isa best = detect();
        const char* wish = std::getenv("BRUSHGS_ISA");
        if (wish == nullptr) return best;
        for (const Isa isa : {Isa::baseline, Isa::avx2})
            if (std::string_view(wish) == isa_name(isa) && isa < best) return isa;
        return best;
    }();
    return chosen;
}

}  // namespace brushgs
