// Vectors of W scalars and the few operations on them that the kernels need, per instruction set.
//
// Arithmetic (+ - * /) works on `Real` directly: the compiler's vector types have it. What differs between
// instruction sets (masks, selection, conversion, gather) is a static function of `Lanes<T>`. Every operation
// rounds the same way everywhere, so pictures do not depend on the instruction set.
#pragma once

#include <cstdint>
#include <type_traits>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace brushgs::BRUSHGS_ISA {

#define BRUSHGS_INLINE [[gnu::always_inline]] static inline

// Any compiler with vector extensions, any scalar. A mask is an integer vector, all bits set where true.
template <class T, int W>
struct GenericLanes {
    static constexpr int width = W;
    using Word = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    using Real [[gnu::vector_size(W * sizeof(T))]] = T;
    using Int [[gnu::vector_size(W * sizeof(T))]] = Word;
    using Mask = Int;

    BRUSHGS_INLINE Real set(T x) { return x - Real{}; }
    BRUSHGS_INLINE Real load(const T* p) {
        Real x;
        __builtin_memcpy(&x, p, sizeof x);
        return x;
    }
    BRUSHGS_INLINE void store(T* p, Real x) { __builtin_memcpy(p, &x, sizeof x); }
    BRUSHGS_INLINE Mask less(Mask m, Real a, Real b) { return m & (a < b); }
    BRUSHGS_INLINE Mask at_least(Mask m, Real a, Real b) { return m & (a >= b); }
    BRUSHGS_INLINE Real select(Mask m, Real a, Real b) { return m ? a : b; }
    BRUSHGS_INLINE Real where(Mask m, Real a) { return m ? a : Real{}; }
    BRUSHGS_INLINE Real min(Real a, Real b) { return a < b ? a : b; }
    BRUSHGS_INLINE unsigned bits(Mask m) {
        unsigned result = 0;
        for (int i = 0; i < W; ++i) result |= (m[i] ? 1u : 0u) << i;
        return result;
    }
    BRUSHGS_INLINE Mask from_bits(unsigned bits) {
        Mask m{};
        for (int i = 0; i < W; ++i) m[i] = (bits >> i & 1u) ? -1 : 0;
        return m;
    }
    BRUSHGS_INLINE Int truncate(Real x) { return __builtin_convertvector(x, Int); }
    BRUSHGS_INLINE Real whole(Real x) { return __builtin_convertvector(truncate(x), Real); }
    // Four bytes from table[index] on, where m is set.
    BRUSHGS_INLINE Int gather(const std::uint16_t* table, Int index, Mask m) {
        Int result{};
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            std::uint32_t word;
            __builtin_memcpy(&word, table + index[i], sizeof word);
            result[i] = static_cast<Word>(word);
        }
        return result;
    }
    // The words table[index] and table[index + 1], where m is set; elsewhere any.
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords gather_two(const std::uint32_t* table, Int index, Mask m) {
        TwoWords result{};
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            result.first[i] = static_cast<Word>(table[index[i]]);
            result.second[i] = static_cast<Word>(table[index[i] + 1]);
        }
        return result;
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        return __builtin_convertvector((x >> (8 * k)) & 255, Real);
    }
    // 2^n for whole n in the range of normal numbers.
    BRUSHGS_INLINE Real exp2_of_whole(Real n) {
        constexpr Word bias = sizeof(T) == 4 ? 127 : 1023;
        constexpr int mantissa = sizeof(T) == 4 ? 23 : 52;
        const Int raised = (truncate(n) + bias) << mantissa;
        Real result;
        __builtin_memcpy(&result, &raised, sizeof result);
        return result;
    }
};

// The width of the generic lanes: 16 bytes is what every 64-bit processor has.
template <class T>
struct Lanes : GenericLanes<T, 16 / sizeof(T)> {};

#if defined(__AVX2__)

// The words table[index] and table[index + 1] of four indices, one pair after the other. By single loads: on an AMD
// EPYC two gathers of 8 pairs take 11 ns, these 7, and one gather of 16 words 8.
BRUSHGS_INLINE __m256i four_pairs(const std::uint32_t* table, __m128i index) {
    const auto two = [&](long long both) __attribute__((always_inline)) {
        const auto indices = static_cast<std::uint64_t>(both);
        long long first, second;
        __builtin_memcpy(&first, table + static_cast<std::uint32_t>(indices), sizeof first);
        __builtin_memcpy(&second, table + (indices >> 32), sizeof second);
        return _mm_insert_epi64(_mm_cvtsi64_si128(first), second, 1);
    };
    const __m128i low = two(_mm_cvtsi128_si64(index)), high = two(_mm_extract_epi64(index, 1));
    return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}

#endif

#if defined(__AVX512F__)

template <>
struct Lanes<float> {
    static constexpr int width = 16;
    using Real = __m512;
    using Int = __m512i;
    using Mask = __mmask16;

    BRUSHGS_INLINE Real set(float x) { return _mm512_set1_ps(x); }
    BRUSHGS_INLINE Real load(const float* p) { return _mm512_loadu_ps(p); }
    BRUSHGS_INLINE void store(float* p, Real x) { _mm512_storeu_ps(p, x); }
    BRUSHGS_INLINE Mask less(Mask m, Real a, Real b) { return _mm512_mask_cmp_ps_mask(m, a, b, _CMP_LT_OQ); }
    BRUSHGS_INLINE Mask at_least(Mask m, Real a, Real b) { return _mm512_mask_cmp_ps_mask(m, a, b, _CMP_GE_OQ); }
    BRUSHGS_INLINE Real select(Mask m, Real a, Real b) { return _mm512_mask_blend_ps(m, b, a); }
    BRUSHGS_INLINE Real where(Mask m, Real a) { return _mm512_maskz_mov_ps(m, a); }
    BRUSHGS_INLINE Real min(Real a, Real b) { return _mm512_min_ps(a, b); }
    BRUSHGS_INLINE unsigned bits(Mask m) { return _cvtmask16_u32(m); }
    BRUSHGS_INLINE Mask from_bits(unsigned bits) { return _cvtu32_mask16(bits); }
    BRUSHGS_INLINE Int truncate(Real x) { return _mm512_cvttps_epi32(x); }
    BRUSHGS_INLINE Real whole(Real x) { return _mm512_roundscale_ps(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
    BRUSHGS_INLINE Int gather(const std::uint16_t* table, Int index, Mask m) {
        return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, index, table, 2);
    }
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords gather_two(const std::uint32_t* table, Int index, Mask m) {
        const Int from = _mm512_maskz_mov_epi32(m, index);
        const auto eight = [&](__m256i of) __attribute__((always_inline)) {
            const __m256i first = four_pairs(table, _mm256_castsi256_si128(of));
            return _mm512_inserti64x4(_mm512_castsi256_si512(first), four_pairs(table, _mm256_extracti128_si256(of, 1)),
                                      1);
        };
        const Int low = eight(_mm512_castsi512_si256(from)), high = eight(_mm512_extracti64x4_epi64(from, 1));
        const Int even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        const Int odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        return {_mm512_permutex2var_epi32(low, even, high), _mm512_permutex2var_epi32(low, odd, high)};
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        return _mm512_cvtepi32_ps(_mm512_shuffle_epi8(x, _mm512_broadcast_i32x4(pick)));
    }
    BRUSHGS_INLINE Real exp2_of_whole(Real n) {
        const Int biased = _mm512_add_epi32(_mm512_cvttps_epi32(n), _mm512_set1_epi32(127));
        return _mm512_castsi512_ps(_mm512_slli_epi32(biased, 23));
    }
};

#elif defined(__AVX2__)

template <>
struct Lanes<float> {
    static constexpr int width = 8;
    using Real = __m256;
    using Int = __m256i;
    using Mask = __m256;

    BRUSHGS_INLINE Real set(float x) { return _mm256_set1_ps(x); }
    BRUSHGS_INLINE Real load(const float* p) { return _mm256_loadu_ps(p); }
    BRUSHGS_INLINE void store(float* p, Real x) { _mm256_storeu_ps(p, x); }
    BRUSHGS_INLINE Mask less(Mask m, Real a, Real b) { return _mm256_and_ps(m, _mm256_cmp_ps(a, b, _CMP_LT_OQ)); }
    BRUSHGS_INLINE Mask at_least(Mask m, Real a, Real b) { return _mm256_and_ps(m, _mm256_cmp_ps(a, b, _CMP_GE_OQ)); }
    BRUSHGS_INLINE Real select(Mask m, Real a, Real b) { return _mm256_blendv_ps(b, a, m); }
    BRUSHGS_INLINE Real where(Mask m, Real a) { return _mm256_and_ps(m, a); }
    BRUSHGS_INLINE Real min(Real a, Real b) { return _mm256_min_ps(a, b); }
    BRUSHGS_INLINE unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
    BRUSHGS_INLINE Mask from_bits(unsigned bits) {
        const Int bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        const Int spread = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), bit);
        return _mm256_castsi256_ps(_mm256_cmpeq_epi32(spread, bit));
    }
    BRUSHGS_INLINE Int truncate(Real x) { return _mm256_cvttps_epi32(x); }
    BRUSHGS_INLINE Real whole(Real x) { return _mm256_round_ps(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
    BRUSHGS_INLINE Int gather(const std::uint16_t* table, Int index, Mask m) {
        return _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), reinterpret_cast<const int*>(table), index,
                                           _mm256_castps_si256(m), 2);
    }
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords gather_two(const std::uint32_t* table, Int index, Mask m) {
        const Int from = _mm256_and_si256(index, _mm256_castps_si256(m));
        const __m256 a = _mm256_castsi256_ps(four_pairs(table, _mm256_castsi256_si128(from)));
        const __m256 b = _mm256_castsi256_ps(four_pairs(table, _mm256_extracti128_si256(from, 1)));
        constexpr int even = 0x88, odd = 0xDD, in_order = 0xD8;
        return {_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, even)), in_order),
                _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, odd)), in_order)};
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        return _mm256_cvtepi32_ps(_mm256_shuffle_epi8(x, _mm256_broadcastsi128_si256(pick)));
    }
    BRUSHGS_INLINE Real exp2_of_whole(Real n) {
        const Int biased = _mm256_add_epi32(_mm256_cvttps_epi32(n), _mm256_set1_epi32(127));
        return _mm256_castsi256_ps(_mm256_slli_epi32(biased, 23));
    }
};

#endif

#undef BRUSHGS_INLINE

}  // namespace brushgs::BRUSHGS_ISA
