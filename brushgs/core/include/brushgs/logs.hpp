// Powers and logarithms to base 2 without the C library: written so that the compiler can vectorise a loop over them,
// and rounding the same on every instruction set. In double those of the C library.
#pragma once

#include <cmath>
#include <cstdint>

namespace brushgs::BRUSHGS_ISA {

// 2^x for x in -126 to 126, in float to about 2e-7.
template <class T>
[[gnu::always_inline]] static inline T exp2_of(T x) {
    if constexpr (sizeof(T) == 8) {
        return std::exp2(x);
    } else {
        constexpr float rounder = 12582912.0f;  // 1.5 * 2^23: adding it rounds to a whole number
        const float n = (x + rounder) - rounder, f = x - n;
        const float power =
            1 + f * (0.693147181f +
                     f * (0.240226507f +
                          f * (0.0555041087f + f * (0.00961812911f + f * (0.00133335581f + f * 0.000154035304f)))));
        const std::int32_t bits = (static_cast<std::int32_t>(n) + 127) << 23;
        float whole;
        __builtin_memcpy(&whole, &bits, sizeof whole);
        return power * whole;
    }
}

// log2 of a normal number > 0, in float to about 1e-7 absolute or relative.
template <class T>
[[gnu::always_inline]] static inline T log2_of(T x) {
    if constexpr (sizeof(T) == 8) {
        return std::log2(x);
    } else {
        std::int32_t bits;
        __builtin_memcpy(&bits, &x, sizeof bits);
        const std::int32_t exponent = (bits - 0x3F3504F3) >> 23;  // so that the rest is in sqrt(1/2) to sqrt(2)
        bits -= exponent * (1 << 23);
        float m;
        __builtin_memcpy(&m, &bits, sizeof m);
        const float s = (m - 1) / (m + 1), ss = s * s;
        const float log = s * (2.88539008f + ss * (0.961796694f + ss * (0.577078016f + ss * (0.412198583f))));
        return static_cast<float>(exponent) + log;
    }
}

}  // namespace brushgs::BRUSHGS_ISA
