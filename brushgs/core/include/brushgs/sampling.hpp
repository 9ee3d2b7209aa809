// The coverage of a tile's pixels by a record, common to painting and its derivative.
//
// A tile is read in blocks of 4 x 4 pixels. Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "brushgs/lanes.hpp"
#include "brushgs/raster.hpp"

namespace brushgs::BRUSHGS_ISA {

constexpr int kBlockSize = 4;  // pixels; a block has 4 x 4 of them
constexpr int kBlockPixels = kBlockSize * kBlockSize;
constexpr int kBlockColumns = kTileWidth / kBlockSize;  // 8
constexpr int kBlockRows = kTileHeight / kBlockSize;    // 4
constexpr int kNumBlocks = kBlockColumns * kBlockRows;  // 32: a tile's blocks fit a 32-bit mask
static_assert(kNumBlocks == 32);

// The pixels of a tile that lie in the picture, a bit each of the blocks of `alive`; returns the blocks with any.
inline std::uint32_t open_pixels(int num_columns, int num_rows, std::uint16_t (&alive)[kNumBlocks]) {
    __builtin_memset(alive, 0xFF, sizeof alive);
    if (num_columns >= kTileWidth && num_rows >= kTileHeight) return 0xFFFFFFFFu;
    std::uint32_t blocks = 0;
    for (int b = 0; b < kNumBlocks; ++b) {  // at the picture's edge
        unsigned pixels = 0;
        for (int p = 0; p < kBlockPixels; ++p) {
            const int x = b % kBlockColumns * kBlockSize + p % kBlockSize;
            const int y = b / kBlockColumns * kBlockSize + p / kBlockSize;
            if (x < num_columns && y < num_rows) pixels |= 1u << p;
        }
        alive[b] = static_cast<std::uint16_t>(pixels);
        blocks |= (pixels == 0 ? 0u : 1u) << b;
    }
    return blocks;
}

// Pixels of block b of a tile that let no more light through.
template <class Tile>
[[gnu::always_inline]] inline void finish_pixels(Tile& tile, int b, unsigned pixels) {
    const unsigned still_alive = tile.alive[b] & ~pixels;  // no branch: it would be taken often and known late
    tile.alive[b] = static_cast<std::uint16_t>(still_alive);
    tile.alive_blocks &= ~((still_alive == 0 ? 1u : 0u) << b);
}

// Blocks of the tile whose pixels overlap the record's pixel bounds. By vectors, without branches: the ends of boxes
// cannot be predicted (4 % less time for a picture of 150,000 strokes).
template <class T>
[[gnu::always_inline]] inline std::uint32_t blocks_in_bounds(const Record<T>& record, int x0, int y0) {
    static_assert(kBlockSize == 4 && kBlockColumns == 8 && kBlockRows == 4);
    using Shorts [[gnu::vector_size(8)]] = std::int16_t;
    using Ints [[gnu::vector_size(16)]] = std::int32_t;
    Shorts bounds;  // left, top, right, bottom
    static_assert(offsetof(Record<T>, bottom) == offsetof(Record<T>, left) + 6);
    __builtin_memcpy(&bounds, reinterpret_cast<const char*>(&record) + offsetof(Record<T>, left), sizeof bounds);
    const Ints from = {x0, y0, x0, y0};
    // A record outside the tile begins behind its last block, or ends before its first.
    const Ints least = {0, 0, -1, -1}, most = {kTileWidth, kTileHeight, kTileWidth - 1, kTileHeight - 1};
    Ints blocks = __builtin_convertvector(bounds, Ints) - from;
    blocks = blocks < least ? least : blocks;
    blocks = (blocks > most ? most : blocks) >> 2;
    constexpr std::uint64_t all = 0xFFFFFFFFu;
    const std::uint32_t row = 0xFFu << blocks[0] & 0xFFu >> (kBlockColumns - 1 - blocks[2]);
    const std::uint64_t rows = all << 8 * blocks[1] & all >> 8 * (kBlockRows - 1 - blocks[3]);
    return row * 0x01010101u & static_cast<std::uint32_t>(rows);
}

// 2^x for x <= 0, to the precision of T.
template <class T>
[[gnu::always_inline]] inline auto exp2_negative(typename Lanes<T>::Real x) {
    using L = Lanes<T>;
    constexpr int degree = sizeof(T) == 4 ? 6 : 13;  // Taylor on |f| <= 1/2: below 2e-7 and 1e-17
    constexpr double ln2 = 0.693147180559945309417;
    const auto n = L::whole(x - L::set(T(0.5)));
    const auto f = x - n;
    double coefficient[degree + 1];
    coefficient[0] = 1;
    for (int k = 1; k <= degree; ++k) coefficient[k] = coefficient[k - 1] * ln2 / k;
    auto sum = L::set(static_cast<T>(coefficient[degree]));
    for (int k = degree - 1; k >= 0; --k) sum = sum * f + L::set(static_cast<T>(coefficient[k]));
    return sum * L::exp2_of_whole(n);
}

// Constants of the tile loop: positions of the pixels of a block, and of the blocks of a tile (pixels).
template <class T>
struct Offsets {
    alignas(64) T pixel_x[kBlockPixels], pixel_y[kBlockPixels], block_x[kNumBlocks], block_y[kNumBlocks];

    constexpr Offsets() : pixel_x(), pixel_y(), block_x(), block_y() {
        for (int p = 0; p < kBlockPixels; ++p) {
            pixel_x[p] = static_cast<T>(p % kBlockSize);
            pixel_y[p] = static_cast<T>(p / kBlockSize);
        }
        for (int b = 0; b < kNumBlocks; ++b) {
            block_x[b] = static_cast<T>(b % kBlockColumns * kBlockSize);
            block_y[b] = static_cast<T>(b / kBlockColumns * kBlockSize);
        }
    }
};
template <class T>
constexpr Offsets<T> offsets{};

template <Kernel kernel>
constexpr bool is_image = kernel == Kernel::bilinear || kernel == Kernel::nearest;

// The coverage of one kernel at (u, v), and the limits of a box in these coordinates.
template <class T, Kernel kernel>
struct Sampler {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Real low_u, high_u, low_v, high_v;
    const std::uint16_t* pairs = nullptr;
    const std::uint32_t* pairs_with_height = nullptr;
    const std::uint32_t* tints = nullptr;
    int columns = 0;
    Real stride;

    [[gnu::always_inline]] inline Sampler(const RasterParams& params, const Record<T>& record) {
        if constexpr (is_image<kernel>) {
            const Level& level = params.levels[static_cast<std::size_t>(record.level)];
            low_u = low_v = L::set(0);
            high_u = L::set(static_cast<T>(level.columns - 1));
            high_v = L::set(static_cast<T>(level.rows - 1));
            pairs = level.pairs;
            pairs_with_height = level.pairs_with_height;
            tints = level.tints;
            columns = level.columns;
            stride = L::set(static_cast<T>(level.columns));
        } else {
            low_u = low_v = L::set(-record.limit);
            high_u = high_v = L::set(record.limit);
            stride = L::set(0);
        }
    }

    // Move the sides of the box outwards.
    [[gnu::always_inline]] inline void widen(Real along_u, Real along_v) {
        low_u = low_u - along_u;
        high_u = high_u + along_u;
        low_v = low_v - along_v;
        high_v = high_v + along_v;
    }

    // Those of `mask` that lie strictly inside the box.
    [[gnu::always_inline]] inline auto inside(typename L::Mask mask, Real u, Real v) const {
        mask = L::less(L::less(mask, low_u, u), u, high_u);
        return L::less(L::less(mask, low_v, v), v, high_v);
    }

    // Coverage at a point and its derivatives along u and v: for images 0 to 255 and the derivative by texels, for the
    // Gaussian 0 to 1 and the derivative of its logarithm. The slope is 0 where coverage is not smooth.
    struct Sample {
        Real coverage, slope_u, slope_v;
    };

    // Of an analytic kernel. Defined where `mask` is set.
    [[gnu::always_inline]] static inline Sample sample(Real u, Real v, typename L::Mask mask) {
        const Real zero = L::set(0);
        if constexpr (kernel == Kernel::gaussian) {
            constexpr double half_log2_e = 0.5 * 1.44269504088896340736;
            const Real value = exp2_negative<T>((u * u + v * v) * L::set(static_cast<T>(-half_log2_e)));
            return {value, zero - u, zero - v};
        } else {
            return {L::where(L::less(mask, u * u + v * v, L::set(1)), L::set(1)), zero, zero};
        }
    }

    // Positions of points among the texels of an image: memory index of the first texel, and the fractions beyond it.
    [[gnu::always_inline]] inline void place(Real u, Real v, typename L::Mask mask, typename L::Word* texel, T* fu,
                                             T* fv) const {
        const Real column = L::whole(u), row = L::whole(v);
        L::store(texel, L::truncate(L::where(mask, row * stride + column)));
        L::store(fu, fraction(u - column));
        L::store(fv, fraction(v - row));
    }

    // Asks for the texels of a colored brush at places before they are read. A painting in the marks of a style has 10
    // to 20 MB of them, each read a few times, and a block has too many instructions for the processor to find the
    // loads of the next one meanwhile: without this its colored strokes take 1.4 times as long.
    template <bool with_height>
    [[gnu::always_inline]] inline void fetch(const typename L::Word* texel) const {
        for (int i = 0; i < L::width; ++i) {
            if constexpr (with_height)
                __builtin_prefetch(pairs_with_height + texel[i]);
            else
                __builtin_prefetch(pairs + texel[i]);
            __builtin_prefetch(tints + texel[i]);
        }
    }

    // Of an image, at places in memory.
    [[gnu::always_inline]] inline Sample sample_at(const typename L::Word* texel, const T* fu, const T* fv) const {
        const auto quads = L::words(pairs, texel);
        return between(L::load(fu), L::load(fv), L::template raised_byte<0>(quads), L::template raised_byte<1>(quads),
                       L::template raised_byte<2>(quads), L::template raised_byte<3>(quads));
    }

    // The same, and the height of an image there, 0 to 255: one load for both.
    [[gnu::always_inline]] inline Sample sample_with_height(const typename L::Word* texel, const T* fu, const T* fv,
                                                            Real& height) const {
        const auto quads = L::two_words(pairs_with_height, texel);
        const Real at_u = L::load(fu), at_v = L::load(fv);
        height = between(at_u, at_v, L::template raised_byte<2>(quads.first), L::template raised_byte<3>(quads.first),
                         L::template raised_byte<2>(quads.second), L::template raised_byte<3>(quads.second))
                     .coverage;
        return between(at_u, at_v, L::template raised_byte<0>(quads.first), L::template raised_byte<1>(quads.first),
                       L::template raised_byte<0>(quads.second), L::template raised_byte<1>(quads.second));
    }

    struct ThreeSamples {
        Sample of[3];
        [[gnu::always_inline]] inline const Sample& operator[](int c) const { return of[c]; }
    };

    // Red, green and blue of a colored brush there, 0 to 255.
    [[gnu::always_inline]] inline ThreeSamples tints_at(const typename L::Word* texel, const T* fu, const T* fv) const {
        const auto upper = L::two_words(tints, texel), lower = L::two_words(tints + columns, texel);
        const Real at_u = L::load(fu), at_v = L::load(fv);
        const auto channel = [&]<int c>() __attribute__((always_inline)) {
            return between(at_u, at_v, L::template raised_byte<c>(upper.first), L::template raised_byte<c>(lower.first),
                           L::template raised_byte<c>(upper.second), L::template raised_byte<c>(lower.second));
        };
        return {
            {channel.template operator()<0>(), channel.template operator()<1>(), channel.template operator()<2>()}
        };
    }

private:
    // Between four texels, raised: (0, 0), (1, 0), (0, 1) and (1, 1) as row and column.
    [[gnu::always_inline]] static inline Sample between(Real fu, Real fv, Real c00, Real c10, Real c01, Real c11) {
        const Real raise = L::set(L::raise);
        const Real step_upper = c01 - c00, step_lower = c11 - c10;
        const Real upper = (c00 - raise) + fu * step_upper;
        const Real lower = (c10 - raise) + fu * step_lower;
        const Real slope_v = lower - upper, value = upper + fv * slope_v;
        if constexpr (kernel == Kernel::nearest) return {value, L::set(0), L::set(0)};
        return {value, step_upper + fv * (step_lower - step_upper), slope_v};
    }

    // The fraction of a point beyond a texel, for nearest sampling: 0 if it rounds down, 1 if it rounds up.
    [[gnu::always_inline]] static inline Real fraction(Real beyond) {
        if constexpr (kernel != Kernel::nearest) return beyond;
        return L::where(L::at_least(L::from_bits(~0u), beyond, L::set(T(0.5))), L::set(1));
    }
};

// Texel coordinates at the first pixel of each block of a tile, and which of the blocks meet the box.
template <class T>
struct BlockCoordinates {
    using L = Lanes<T>;
    using Real = typename L::Real;
    alignas(64) T u[kNumBlocks];
    alignas(64) T v[kNumBlocks];

    template <class Sampler>
    [[gnu::always_inline]] inline std::uint32_t find(const Record<T>& record, const Sampler& sampler, int x0, int y0,
                                                     std::uint32_t blocks) {
        const T dx = static_cast<T>(x0 - record.anchor_x), dy = static_cast<T>(y0 - record.anchor_y);
        const T tile_u = record.offset_u + (record.du_dx * dx + record.du_dy * dy);
        const T tile_v = record.offset_v + (record.dv_dx * dx + record.dv_dy * dy);
        // Separating axes: a block lies beside the box when its pixel centers all lie beyond one of its sides.
        constexpr T to_middle = (kBlockSize - 1) / T(2);
        const Real middle_u = L::set(to_middle * (record.du_dx + record.du_dy));
        const Real middle_v = L::set(to_middle * (record.dv_dx + record.dv_dy));
        // Rounding must not miss a block with a pixel that is inside by its own coordinates.
        constexpr T rounding = (sizeof(T) == 4 ? T(0x1p-23) : T(0x1p-52)) * 8;
        constexpr T reach = to_middle + rounding * kTileWidth;
        Sampler widened = sampler;
        widened.widen((sampler.high_u - sampler.low_u) * L::set(rounding),
                      (sampler.high_v - sampler.low_v) * L::set(rounding));
        widened.widen(L::set(reach * (std::fabs(record.du_dx) + std::fabs(record.du_dy))),
                      L::set(reach * (std::fabs(record.dv_dx) + std::fabs(record.dv_dy))));
        const Real du_dx = L::set(record.du_dx), du_dy = L::set(record.du_dy);
        const Real dv_dx = L::set(record.dv_dx), dv_dy = L::set(record.dv_dy);
        std::uint32_t overlapping = 0;
        for (int first = 0; first < kNumBlocks; first += L::width) {
            const Real bx = L::load(offsets<T>.block_x + first), by = L::load(offsets<T>.block_y + first);
            const Real block_u = L::set(tile_u) + (du_dx * bx + du_dy * by);
            const Real block_v = L::set(tile_v) + (dv_dx * bx + dv_dy * by);
            L::store(u + first, block_u);
            L::store(v + first, block_v);
            const auto meets = widened.inside(L::from_bits(blocks >> first), block_u + middle_u, block_v + middle_v);
            overlapping |= L::bits(meets) << first;
        }
        return overlapping;
    }
};

// The slopes of the coverage of a record at the pixels of a tile, see Sampler::Sample.
template <class T>
struct Slopes {
    alignas(64) T u[kNumBlocks][kBlockPixels];
    alignas(64) T v[kNumBlocks][kBlockPixels];
};

// Does nothing with a sample.
struct NoShader {
    template <class Real, class Mask>
    [[gnu::always_inline]] inline void operator()(int, int, Real, Mask) const {}
};

// Where the pixels of a tile lie among the texels of an image, and which of them lie inside the box.
template <class T>
struct Places {
    alignas(64) typename Lanes<T>::Word texel[kNumBlocks][kBlockPixels];
    alignas(64) T fu[kNumBlocks][kBlockPixels];
    alignas(64) T fv[kNumBlocks][kBlockPixels];
    std::uint16_t inside[kNumBlocks];
};

// The alpha of a record at those pixels of some blocks of a tile that still let light through, 0 outside its box;
// returns the blocks that it may touch, of which alone `alphas`, and `slopes` unless null, are written. Sifted:
// alphas too faint to count are 0, only blocks with others are returned, and `pixels` says which pixels of a block
// these are. `shader` is called with block, lane, the coordinates v of the lanes and those of them inside the box; of
// one with `needs_height`, `raise` is called with block, lane, the brush's height there and those inside the box; of
// one that has it, `tint` with block, lane, the sampler, the places among the texels and those inside the box.
template <class T, Kernel kernel, bool is_sifted = false, bool with_slopes = false, class Tile, class Shader = NoShader>
[[gnu::always_inline]] inline std::uint32_t sample_blocks(std::uint32_t blocks, const RasterParams& params,
                                                          const Record<T>& record, int x0, int y0, const Tile& tile,
                                                          T (&alphas)[kNumBlocks][kBlockPixels],
                                                          std::uint16_t* pixels = nullptr, Slopes<T>* slopes = nullptr,
                                                          const Shader& shader = {}) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width;
    blocks &= tile.alive_blocks;
    if (blocks == 0) return 0;
    const Sampler<T, kernel> sampler(params, record);
    BlockCoordinates<T> block;
    blocks = block.find(record, sampler, x0, y0, blocks);

    Real lane_u[kBlockPixels / W], lane_v[kBlockPixels / W];
    for (int part = 0; part < kBlockPixels / W; ++part) {
        const Real px = L::load(offsets<T>.pixel_x + part * W), py = L::load(offsets<T>.pixel_y + part * W);
        lane_u[part] = L::set(record.du_dx) * px + L::set(record.du_dy) * py;
        lane_v[part] = L::set(record.dv_dx) * px + L::set(record.dv_dy) * py;
    }
    const auto find_inside = [&](int b, int part, Real& u, Real& v) __attribute__((always_inline)) {
        u = L::set(block.u[b]) + lane_u[part];
        v = L::set(block.v[b]) + lane_v[part];
        return sampler.inside(L::from_bits(static_cast<unsigned>(tile.alive[b]) >> (part * W)), u, v);
    };
    // Images in two passes: then the inputs of the texel loads are ready, and the loads do not wait for each other.
    // With single loads instead of gathers this takes 13 % less time for a picture of 7000 strokes.
    [[maybe_unused]] Places<T> places;
    constexpr bool has_height = requires { Shader::needs_height; };
    constexpr bool is_tinted =
        requires(const T* at) { shader.tint(0, 0, sampler, places.texel[0], at, at, L::from_bits(0)); };
    if constexpr (is_image<kernel>) {
        for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
            const int b = __builtin_ctz(rest);
            unsigned all_inside = 0;
            for (int part = 0; part < kBlockPixels / W; ++part) {
                const int lane = part * W;
                Real u, v;
                const auto inside = find_inside(b, part, u, v);
                sampler.place(u, v, inside, places.texel[b] + lane, places.fu[b] + lane, places.fv[b] + lane);
                if constexpr (is_tinted) sampler.template fetch<has_height>(places.texel[b] + lane);
                all_inside |= L::bits(inside) << lane;
            }
            places.inside[b] = static_cast<std::uint16_t>(all_inside);
        }
    }
    const Real opacity = L::set(record.opacity);
    for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
        const int b = __builtin_ctz(rest);
        unsigned seen = 0;
        for (int part = 0; part < kBlockPixels / W; ++part) {
            const int lane = part * W;
            typename Sampler<T, kernel>::Sample sample;
            typename L::Mask inside;
            Real v;
            if constexpr (is_image<kernel>) {
                v = L::set(block.v[b]) + lane_v[part];
                inside = L::from_bits(static_cast<unsigned>(places.inside[b]) >> lane);
                const auto* const texel = places.texel[b] + lane;
                const T *const fu = places.fu[b] + lane, *const fv = places.fv[b] + lane;
                if constexpr (has_height) {
                    Real height;
                    sample = sampler.sample_with_height(texel, fu, fv, height);
                    shader.raise(b, lane, height, inside);
                } else {
                    sample = sampler.sample_at(texel, fu, fv);
                }
                if constexpr (is_tinted) shader.tint(b, lane, sampler, texel, fu, fv, inside);
            } else {
                Real u;
                inside = find_inside(b, part, u, v);
                sample = sampler.sample(u, v, inside);
            }
            const Real alpha = L::min(opacity * sample.coverage, L::set(static_cast<T>(kMaxAlpha)));
            shader(b, lane, v, inside);
            if constexpr (with_slopes) {
                L::store(slopes->u[b] + lane, sample.slope_u);
                L::store(slopes->v[b] + lane, sample.slope_v);
            }
            if constexpr (is_sifted) {
                const auto painted = L::at_least(inside, alpha, L::set(static_cast<T>(kMinAlpha)));
                L::store(alphas[b] + lane, L::where(painted, alpha));
                seen |= L::bits(painted) << lane;
            } else {
                L::store(alphas[b] + lane, L::where(inside, alpha));
            }
        }
        if constexpr (is_sifted) {
            pixels[b] = static_cast<std::uint16_t>(seen);
            blocks &= ~((seen == 0 ? 1u : 0u) << b);
        }
    }
    return blocks;
}

// The same, of all blocks of the tile.
template <class T, Kernel kernel, bool is_sifted = false, class Tile, class Shader = NoShader>
[[gnu::always_inline]] inline std::uint32_t sample_record(const RasterParams& params, const Record<T>& record, int x0,
                                                          int y0, const Tile& tile,
                                                          T (&alphas)[kNumBlocks][kBlockPixels],
                                                          std::uint16_t* pixels = nullptr, const Shader& shader = {}) {
    return sample_blocks<T, kernel, is_sifted>(blocks_in_bounds(record, x0, y0), params, record, x0, y0, tile, alphas,
                                               pixels, nullptr, shader);
}

}  // namespace brushgs::BRUSHGS_ISA
