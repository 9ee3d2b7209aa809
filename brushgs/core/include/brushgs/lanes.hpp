// Vectors of W scalars and the few operations on them that the kernels need, per instruction set.
//
// Arithmetic (+ - * /) works on `Real` directly, as a vector type of the compiler. Operations that differ between
// instruction sets (masks, selection, conversion, gather) are static functions of `Lanes<T>`. Every operation rounds
// the same way everywhere, so pictures do not depend on the instruction set.
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
    BRUSHGS_INLINE void store(Word* p, Int x) { __builtin_memcpy(p, &x, sizeof x); }
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
    // Four bytes from table[index] on, of each index in memory.
    BRUSHGS_INLINE Int words(const std::uint16_t* table, const Word* index) {
        Int result{};
        for (int i = 0; i < W; ++i) {
            std::uint32_t word;
            __builtin_memcpy(&word, table + index[i], sizeof word);
            result[i] = static_cast<Word>(word);
        }
        return result;
    }
    // The words table[index] and table[index + 1], of each index in memory.
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords two_words(const std::uint32_t* table, const Word* index) {
        TwoWords result{};
        for (int i = 0; i < W; ++i) {
            result.first[i] = static_cast<Word>(table[index[i]]);
            result.second[i] = static_cast<Word>(table[index[i] + 1]);
        }
        return result;
    }
    // Four bytes from table[index] on, where m is set; undefined elsewhere.
    BRUSHGS_INLINE Int gather(const std::uint16_t* table, Int index, Mask m) {
        alignas(sizeof(Int)) Word from[W];
        store(from, index & m);
        return words(table, from);
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        return __builtin_convertvector((x >> (8 * k)) & 255, Real);
    }
    // Byte k on top of `raise`. In the last places of that power of two a byte needs no conversion, and neither
    // the difference of two such numbers nor that to the power is rounded.
    static constexpr T raise = sizeof(T) == 4 ? T(0x1p23) : T(0x1p52);
    template <int k>
    BRUSHGS_INLINE Real raised_byte(Int x) {
        const Real power = set(raise);
        Int bits;
        __builtin_memcpy(&bits, &power, sizeof bits);
        bits |= (x >> (8 * k)) & 255;
        Real result;
        __builtin_memcpy(&result, &bits, sizeof result);
        return result;
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

// By single loads: on an AMD EPYC two gathers of 8 pairs of words take 11 ns, these 7. The indices are in memory,
// written by an earlier loop, so nothing waits for them. Four words take 13 % off a picture of 7000 strokes, see
// `sample_record`.

// Four bytes from table[index] on, of four indices.
BRUSHGS_INLINE __m128i four_words(const std::uint16_t* table, const std::int32_t* index) {
    const auto two = [&](const std::int32_t* from) __attribute__((always_inline)) {
        int first, second;
        __builtin_memcpy(&first, table + from[0], sizeof first);
        __builtin_memcpy(&second, table + from[1], sizeof second);
        return _mm_insert_epi32(_mm_cvtsi32_si128(first), second, 1);
    };
    return _mm_unpacklo_epi64(two(index), two(index + 2));
}

// The words table[index] and table[index + 1] of four indices, one pair after the other.
BRUSHGS_INLINE __m256i four_pairs(const std::uint32_t* table, const std::int32_t* index) {
    const auto two = [&](const std::int32_t* from) __attribute__((always_inline)) {
        long long first, second;
        __builtin_memcpy(&first, table + from[0], sizeof first);
        __builtin_memcpy(&second, table + from[1], sizeof second);
        return _mm_insert_epi64(_mm_cvtsi64_si128(first), second, 1);
    };
    return _mm256_inserti128_si256(_mm256_castsi128_si256(two(index)), two(index + 2), 1);
}

#endif

#if defined(__AVX512F__)

template <>
struct Lanes<float> {
    static constexpr int width = 16;
    using Word = std::int32_t;
    using Real = __m512;
    using Int = __m512i;
    using Mask = __mmask16;

    BRUSHGS_INLINE Real set(float x) { return _mm512_set1_ps(x); }
    BRUSHGS_INLINE Real load(const float* p) { return _mm512_loadu_ps(p); }
    BRUSHGS_INLINE void store(float* p, Real x) { _mm512_storeu_ps(p, x); }
    BRUSHGS_INLINE void store(Word* p, Int x) { _mm512_storeu_si512(p, x); }
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
    BRUSHGS_INLINE Int words(const std::uint16_t* table, const Word* index) {
        const auto eight = [&](const Word* from) __attribute__((always_inline)) {
            const __m256i first = _mm256_castsi128_si256(four_words(table, from));
            return _mm256_inserti128_si256(first, four_words(table, from + 4), 1);
        };
        return _mm512_inserti64x4(_mm512_castsi256_si512(eight(index)), eight(index + 8), 1);
    }
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords two_words(const std::uint32_t* table, const Word* index) {
        const auto eight = [&](const Word* from) __attribute__((always_inline)) {
            const __m512i first = _mm512_castsi256_si512(four_pairs(table, from));
            return _mm512_inserti64x4(first, four_pairs(table, from + 4), 1);
        };
        const Int low = eight(index), high = eight(index + 8);
        const Int even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        const Int odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        return {_mm512_permutex2var_epi32(low, even, high), _mm512_permutex2var_epi32(low, odd, high)};
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        return _mm512_cvtepi32_ps(_mm512_shuffle_epi8(x, _mm512_broadcast_i32x4(pick)));
    }
    static constexpr float raise = 0x1p23f;
    template <int k>
    BRUSHGS_INLINE Real raised_byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        constexpr __mmask64 lowest = 0x1111111111111111;
        return _mm512_castsi512_ps(
            _mm512_mask_shuffle_epi8(_mm512_castps_si512(set(raise)), lowest, x, _mm512_broadcast_i32x4(pick)));
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
    using Word = std::int32_t;
    using Real = __m256;
    using Int = __m256i;
    using Mask = __m256;

    BRUSHGS_INLINE Real set(float x) { return _mm256_set1_ps(x); }
    BRUSHGS_INLINE Real load(const float* p) { return _mm256_loadu_ps(p); }
    BRUSHGS_INLINE void store(float* p, Real x) { _mm256_storeu_ps(p, x); }
    BRUSHGS_INLINE void store(Word* p, Int x) { __builtin_memcpy(p, &x, sizeof x); }
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
    BRUSHGS_INLINE Int words(const std::uint16_t* table, const Word* index) {
        const __m256i first = _mm256_castsi128_si256(four_words(table, index));
        return _mm256_inserti128_si256(first, four_words(table, index + 4), 1);
    }
    struct TwoWords {
        Int first, second;
    };
    BRUSHGS_INLINE TwoWords two_words(const std::uint32_t* table, const Word* index) {
        const __m256 a = _mm256_castsi256_ps(four_pairs(table, index));
        const __m256 b = _mm256_castsi256_ps(four_pairs(table, index + 4));
        constexpr int even = 0x88, odd = 0xDD, in_order = 0xD8;
        return {_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, even)), in_order),
                _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, odd)), in_order)};
    }
    template <int k>
    BRUSHGS_INLINE Real byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        return _mm256_cvtepi32_ps(_mm256_shuffle_epi8(x, _mm256_broadcastsi128_si256(pick)));
    }
    static constexpr float raise = 0x1p23f;
    template <int k>
    BRUSHGS_INLINE Real raised_byte(Int x) {
        const __m128i pick = _mm_setr_epi8(k, -1, -1, -1, k + 4, -1, -1, -1, k + 8, -1, -1, -1, k + 12, -1, -1, -1);
        const Int low = _mm256_shuffle_epi8(x, _mm256_broadcastsi128_si256(pick));
        return _mm256_castsi256_ps(_mm256_or_si256(_mm256_castps_si256(set(raise)), low));
    }
    BRUSHGS_INLINE Real exp2_of_whole(Real n) {
        const Int biased = _mm256_add_epi32(_mm256_cvttps_epi32(n), _mm256_set1_epi32(127));
        return _mm256_castsi256_ps(_mm256_slli_epi32(biased, 23));
    }
};

#endif

#undef BRUSHGS_INLINE

}  // namespace brushgs::BRUSHGS_ISA
