// Values of pixels in vectors: read from a picture, and added up over the pixels of a block.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

template <class T>
struct Colors {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    Four red, green, blue;
};

// Twelve interleaved values become three runs of four.
template <class T>
[[gnu::always_inline]] inline Colors<T> deinterleave(const T* rgb) {
    using Four = typename Colors<T>::Four;
    Four a, b, c;
    __builtin_memcpy(&a, rgb, sizeof a);
    __builtin_memcpy(&b, rgb + 4, sizeof b);
    __builtin_memcpy(&c, rgb + 8, sizeof c);
    return {__builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5),
            __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6),
            __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 5, 5), c, 0, 1, 4, 7)};
}

// Adds up the sixteen lanes of each sum, in one order on every instruction set.
template <class T, int count>
[[gnu::always_inline]] inline void add_lanes(const T (&lanes)[count][kBlockPixels], T* sums) {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    for (int k = 0; k < count; k += 4) {
        Four part[4];
        for (int i = 0; i < 4; ++i) {
            Four quarter[4];
            __builtin_memcpy(quarter, lanes[k + i], sizeof quarter);
            part[i] = (quarter[0] + quarter[1]) + (quarter[2] + quarter[3]);
        }
        const Four low01 = __builtin_shufflevector(part[0], part[1], 0, 4, 1, 5);
        const Four high01 = __builtin_shufflevector(part[0], part[1], 2, 6, 3, 7);
        const Four low23 = __builtin_shufflevector(part[2], part[3], 0, 4, 1, 5);
        const Four high23 = __builtin_shufflevector(part[2], part[3], 2, 6, 3, 7);
        const Four first = __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
        const Four second = __builtin_shufflevector(low01, low23, 2, 3, 6, 7);
        const Four third = __builtin_shufflevector(high01, high23, 0, 1, 4, 5);
        const Four fourth = __builtin_shufflevector(high01, high23, 2, 3, 6, 7);
        const Four sum = (first + second) + (third + fourth);
        __builtin_memcpy(sums + k, &sum, sizeof sum);
    }
}

}  // namespace brushgs::BRUSHGS_ISA
