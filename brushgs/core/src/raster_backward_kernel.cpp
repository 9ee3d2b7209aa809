// The hot loops of the rasteriser's derivative, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/lanes.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

// The pixels of one tile: planes of 4 x 4 blocks. The picture is sum of w_i c_i with w_i = T_i a_i, and the loss
// changes like sum of w_i s_i, where s_i, the shade, is what the gradients at a pixel make of a record: v_rgb . c_i +
// v_alpha + v_depth (z_i - depth) / alpha.
template <class T>
struct GradientTile {
    alignas(64) T transmittance[kNumBlocks][kBlockPixels];
    alignas(64) T behind[kNumBlocks][kBlockPixels];  // sum of w_i s_i of what is still to come
    alignas(64) T v_red[kNumBlocks][kBlockPixels];
    alignas(64) T v_green[kNumBlocks][kBlockPixels];
    alignas(64) T v_blue[kNumBlocks][kBlockPixels];
    alignas(64) T v_any[kNumBlocks][kBlockPixels];    // by the weight of a record, whatever its colour
    alignas(64) T v_depth[kNumBlocks][kBlockPixels];  // by the sum of weight x depth
    std::uint16_t alive[kNumBlocks];                  // pixels that still let light through
    std::uint32_t alive_blocks;
};

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

// The rows of a picture's columns from one pixel on; null where the picture has none.
template <class T>
struct Pixels {
    const T *rgb, *alpha, *depth, *v_rgb, *v_alpha, *v_depth;
};

// Four pixels of a row of a block.
template <class T>
[[gnu::always_inline]] inline void read_four(const Pixels<T>& from, int b, int p, GradientTile<T>& tile) {
    using Four = typename Colors<T>::Four;
    const auto read = [](const T* values, Four& four) {
        if (values != nullptr) __builtin_memcpy(&four, values, sizeof four);
    };
    const Colors<T> color = deinterleave(from.rgb), v = deinterleave(from.v_rgb);
    Four alpha{}, depth{}, v_alpha{}, v_depth{};
    read(from.alpha, alpha), read(from.v_alpha, v_alpha);
    if (from.v_depth != nullptr) read(from.depth, depth), read(from.v_depth, v_depth);
    // By the sum of weight x depth: the depth of the picture is that sum over alpha.
    const Four v_sum = alpha > 0 ? v_depth / alpha : Four{};
    const Four v_any = v_alpha - v_sum * depth;
    const Four whole = (v.red * color.red + v.green * color.green) + (v.blue * color.blue + v_alpha * alpha);
    __builtin_memcpy(tile.behind[b] + p, &whole, sizeof whole);
    __builtin_memcpy(tile.v_red[b] + p, &v.red, sizeof v.red);
    __builtin_memcpy(tile.v_green[b] + p, &v.green, sizeof v.green);
    __builtin_memcpy(tile.v_blue[b] + p, &v.blue, sizeof v.blue);
    __builtin_memcpy(tile.v_any[b] + p, &v_any, sizeof v_any);
    __builtin_memcpy(tile.v_depth[b] + p, &v_sum, sizeof v_sum);
}

// `num_columns` pixels of row y of the tile.
template <class T>
void read_row(Pixels<T> from, int y, int num_columns, GradientTile<T>& tile) {
    const int first_block = y / kBlockSize * kBlockColumns, p = y % kBlockSize * kBlockSize;
    const auto advance = [](const T*& values, int step) { values = values == nullptr ? nullptr : values + step; };
    int x = 0;
    for (; x + kBlockSize <= num_columns; x += kBlockSize) {
        read_four(from, first_block + x / kBlockSize, p, tile);
        advance(from.rgb, 3 * kBlockSize), advance(from.v_rgb, 3 * kBlockSize);
        advance(from.alpha, kBlockSize), advance(from.v_alpha, kBlockSize);
        advance(from.depth, kBlockSize), advance(from.v_depth, kBlockSize);
    }
    if (x == num_columns) return;
    T copies[6][3 * kBlockSize] = {};  // the picture ends within a block
    const auto copy = [&](const T* values, int width, T* to) -> const T* {
        if (values == nullptr) return nullptr;
        for (int i = 0; i < (num_columns - x) * width; ++i) to[i] = values[i];
        return to;
    };
    const Pixels<T> rest{copy(from.rgb, 3, copies[0]),     copy(from.alpha, 1, copies[1]),
                         copy(from.depth, 1, copies[2]),   copy(from.v_rgb, 3, copies[3]),
                         copy(from.v_alpha, 1, copies[4]), copy(from.v_depth, 1, copies[5])};
    read_four(rest, first_block + x / kBlockSize, p, tile);
}

template <class T>
void start(const RasterParams& params, int x0, int y0, const PictureGradients<T>& picture, GradientTile<T>& tile) {
    const int columns_left = params.width - x0, rows_left = params.height - y0;
    const int num_columns = columns_left < kTileWidth ? columns_left : kTileWidth;
    const int num_rows = rows_left < kTileHeight ? rows_left : kTileHeight;
    // Beyond the picture nothing is read: zeros, which add nothing.
    if (num_columns < kTileWidth || num_rows < kTileHeight) __builtin_memset(&tile, 0, sizeof tile);
    tile.alive_blocks = open_pixels(columns_left, rows_left, tile.alive);
    T* all = tile.transmittance[0];
    for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
    for (int y = 0; y < num_rows; ++y) {
        const std::size_t first =
            static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(params.width) + static_cast<std::size_t>(x0);
        const auto at = [first](const T* values) { return values == nullptr ? nullptr : values + first; };
        read_row<T>({picture.rgb + 3 * first, at(picture.alpha), at(picture.depth), picture.v_rgb + 3 * first,
                     at(picture.v_alpha), at(picture.v_depth)},
                    y, num_columns, tile);
    }
}

// Adds up the sixteen lanes of each sum, in one order on every instruction set.
template <class T>
[[gnu::always_inline]] inline void add_lanes(const T (&lanes)[kNumSums][kBlockPixels], T* sums) {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    for (int k = 0; k < kNumSums; k += 4) {
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

// Adds to the gradient by the texels of the record's level what the pixels of some blocks give, whose gradients by
// alpha are `v_alphas`.
template <class T, Kernel kernel>
void add_texels(const RasterParams& params, const Record<T>& record, int x0, int y0, std::uint32_t blocks,
                const T (&v_alphas)[kNumBlocks][kBlockPixels], double* const* texels) {
    const auto index = static_cast<std::size_t>(record.level);
    const int columns = params.levels[index].columns, rows = params.levels[index].rows;
    const double opacity = 255.0 * static_cast<double>(record.opacity);
    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        for (int p = 0; p < kBlockPixels; ++p) {
            const double v = opacity * static_cast<double>(v_alphas[b][p]);
            if (v == 0) continue;
            const double dx = x0 + b % kBlockColumns * kBlockSize + p % kBlockSize - record.anchor_x;
            const double dy = y0 + b / kBlockColumns * kBlockSize + p / kBlockSize - record.anchor_y;
            const double at_u = static_cast<double>(record.offset_u) + static_cast<double>(record.du_dx) * dx +
                                static_cast<double>(record.du_dy) * dy;
            const double at_v = static_cast<double>(record.offset_v) + static_cast<double>(record.dv_dx) * dx +
                                static_cast<double>(record.dv_dy) * dy;
            const auto texel = [](double at, int count) {
                const int whole = static_cast<int>(at);
                return whole < 0 ? 0 : (whole > count - 2 ? count - 2 : whole);
            };
            const int column = texel(at_u, columns), row = texel(at_v, rows);
            double fu = at_u - column, fv = at_v - row;
            if constexpr (kernel == Kernel::nearest) fu = fu >= 0.5 ? 1 : 0, fv = fv >= 0.5 ? 1 : 0;
            double* const upper = texels[index] + static_cast<std::ptrdiff_t>(row) * columns + column;
            double* const lower = upper + columns;
            upper[0] += v * (1 - fv) * (1 - fu);
            upper[1] += v * (1 - fv) * fu;
            lower[0] += v * fv * (1 - fu);
            lower[1] += v * fv * fu;
        }
    }
}

template <class T, Kernel kernel, bool with_depth>
[[gnu::always_inline]] inline void differentiate_record(const RasterParams& params, T min_transmittance,
                                                        const Record<T>& record, int x0, int y0, GradientTile<T>& tile,
                                                        T* sums, double* const* texels) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width;
    constexpr bool has_slopes = kernel == Kernel::bilinear || kernel == Kernel::gaussian;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint16_t pixels[kNumBlocks];
    Slopes<T> slopes;
    const std::uint32_t blocks =
        sample_record<T, kernel, true, has_slopes>(params, record, x0, y0, tile, alphas, pixels, &slopes);
    if (blocks == 0) {
        __builtin_memset(sums, 0, kNumSums * sizeof *sums);
        return;
    }
    const auto all = L::from_bits(~0u);
    const Real red = L::set(record.red), green = L::set(record.green), blue = L::set(record.blue);
    const Real depth = L::set(record.depth), one = L::set(1), zero = L::set(0);
    alignas(64) T lanes[kNumSums][kBlockPixels];
    for (int lane = 0; lane < kBlockPixels; lane += W) {
        const Real pixel_x = L::load(offsets<T>.pixel_x + lane), pixel_y = L::load(offsets<T>.pixel_y + lane);
        Real u = zero, ux = zero, uy = zero, v = zero, vx = zero, vy = zero, a = zero;
        Real r = zero, g = zero, b_ = zero, z = zero;
        for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
            const int b = __builtin_ctz(rest);
            const Real alpha = L::load(alphas[b] + lane);
            const auto painted = L::at_least(all, alpha, L::set(static_cast<T>(kMinAlpha)));
            const Real before = L::load(tile.transmittance[b] + lane);
            const Real full = before * alpha;
            const Real after = before - full;
            const auto kept = L::at_least(painted, after, L::set(min_transmittance));
            const Real weight = L::where(kept, full);
            L::store(tile.transmittance[b] + lane, L::select(kept, after, before));
            finish_pixels(tile, b, (L::bits(painted) & ~L::bits(kept)) << lane);

            const Real v_red = L::load(tile.v_red[b] + lane), v_green = L::load(tile.v_green[b] + lane);
            const Real v_blue = L::load(tile.v_blue[b] + lane);
            Real shade = (v_red * red + v_green * green) + (v_blue * blue + L::load(tile.v_any[b] + lane));
            r = r + weight * v_red;
            g = g + weight * v_green;
            b_ = b_ + weight * v_blue;
            if constexpr (with_depth) {
                const Real v_depth = L::load(tile.v_depth[b] + lane);
                shade = shade + v_depth * depth;
                z = z + weight * v_depth;
            }
            const Real behind = L::load(tile.behind[b] + lane) - weight * shade;
            L::store(tile.behind[b] + lane, behind);
            // Alpha at its bound does not change.
            const auto is_free = L::less(kept, alpha, L::set(static_cast<T>(kMaxAlpha)));
            const Real v_alpha = L::where(is_free, before * shade - behind / (one - alpha));
            const Real v_log = v_alpha * alpha;
            a = a + v_log;
            if constexpr (has_slopes) {
                const Real x = pixel_x + L::set(static_cast<T>(x0 + b % kBlockColumns * kBlockSize - record.anchor_x));
                const Real y = pixel_y + L::set(static_cast<T>(y0 + b / kBlockColumns * kBlockSize - record.anchor_y));
                const Real v_coverage = kernel == Kernel::gaussian ? v_log : v_alpha;
                const Real v_u = v_coverage * L::load(slopes.u[b] + lane);
                const Real v_v = v_coverage * L::load(slopes.v[b] + lane);
                u = u + v_u;
                ux = ux + v_u * x;
                uy = uy + v_u * y;
                v = v + v_v;
                vx = vx + v_v * x;
                vy = vy + v_v * y;
            }
            if (texels != nullptr) L::store(alphas[b] + lane, v_alpha);
        }
        const auto put = [&](Sum sum, Real value) { L::store(lanes[sum] + lane, value); };
        put(kU, u), put(kUx, ux), put(kUy, uy), put(kV, v), put(kVx, vx), put(kVy, vy), put(kAlpha, a);
        put(kRed, r), put(kGreen, g), put(kBlue, b_), put(kDepth, z);
        L::store(lanes[kNumUsedSums] + lane, zero);
    }
    static_assert(kNumUsedSums + 1 == kNumSums);
    add_lanes(lanes, sums);
    if constexpr (kernel == Kernel::bilinear || kernel == Kernel::nearest)
        if (texels != nullptr) add_texels<T, kernel>(params, record, x0, y0, blocks, alphas, texels);
}

template <class T, Kernel kernel, bool with_depth>
void differentiate_all(const RasterParams& params, T min_transmittance, const Record<T>* records,
                       const std::uint32_t* ids, std::size_t num_ids, int x0, int y0, GradientTile<T>& tile, T* sums,
                       double* const* texels) {
    constexpr std::size_t ahead = 4;  // records lie in depth order: those of a tile are far apart in memory
    std::size_t i = 0;
    for (; i < num_ids && tile.alive_blocks != 0; ++i) {
        __builtin_prefetch(&records[ids[i + ahead < num_ids ? i + ahead : i]]);
        differentiate_record<T, kernel, with_depth>(params, min_transmittance, records[ids[i]], x0, y0, tile,
                                                    sums + kNumSums * i, texels);
    }
    __builtin_memset(sums + kNumSums * i, 0, (num_ids - i) * kNumSums * sizeof *sums);
}

template <class T, Kernel kernel, class... Arguments>
void differentiate_with(bool with_depth, Arguments&&... arguments) {
    if (with_depth)
        differentiate_all<T, kernel, true>(arguments...);
    else
        differentiate_all<T, kernel, false>(arguments...);
}

}  // namespace

template <class T>
void differentiate_tile(const RasterParams& params, T min_transmittance, const Record<T>* records,
                        const std::uint32_t* ids, std::size_t num_ids, int tile_x, int tile_y,
                        const PictureGradients<T>& picture, T* sums, double* const* texels) {
    if (num_ids == 0) return;
    const int x0 = tile_x * kTileWidth, y0 = tile_y * kTileHeight;
    GradientTile<T> tile;
    start(params, x0, y0, picture, tile);
    const auto with = [&]<Kernel kernel>() {
        differentiate_with<T, kernel>(picture.v_depth != nullptr, params, min_transmittance, records, ids, num_ids, x0,
                                      y0, tile, sums, texels);
    };
    switch (params.kernel) {
        case Kernel::bilinear:
            with.template operator()<Kernel::bilinear>();
            break;
        case Kernel::nearest:
            with.template operator()<Kernel::nearest>();
            break;
        case Kernel::gaussian:
            with.template operator()<Kernel::gaussian>();
            break;
        case Kernel::ellipse:
            with.template operator()<Kernel::ellipse>();
            break;
    }
}

template void differentiate_tile<float>(const RasterParams&, float, const Record<float>*, const std::uint32_t*,
                                        std::size_t, int, int, const PictureGradients<float>&, float*, double* const*);
template void differentiate_tile<double>(const RasterParams&, double, const Record<double>*, const std::uint32_t*,
                                         std::size_t, int, int, const PictureGradients<double>&, double*,
                                         double* const*);

}  // namespace brushgs::BRUSHGS_ISA
