// The hot loops of the rasterizer's derivative, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/raster_backward.hpp"

#include <type_traits>

#include "brushgs/blend_lanes.hpp"
#include "brushgs/lane_sums.hpp"
#include "brushgs/sampling.hpp"
#include "brushgs/streaks.hpp"
#include "brushgs/tile_state.hpp"
#include "brushgs/tints.hpp"
#include "brushgs/underpaint.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

// The pixels of one tile: planes of 4 x 4 blocks. The picture is sum of w_i c_i with w_i = T_i a_i, and the loss
// changes like sum of w_i s_i, where s_i, the shade, combines a record with the gradients at a pixel: v_rgb . c_i +
// v_alpha + sum of v_layer (attribute_i - layer) / alpha.
template <class T, int channels>
struct GradientTile {
    alignas(64) T transmittance[kNumBlocks][kBlockPixels];
    alignas(64) T behind[kNumBlocks][kBlockPixels];  // sum of w_i s_i of what is still to come
    alignas(64) T v_color[3][kNumBlocks][kBlockPixels];
    alignas(64) T v_weight[kNumBlocks][kBlockPixels];  // by the weight of a record, whatever its color and attributes
    alignas(64) T v_sum[channels > 0 ? channels : 1][kNumBlocks][kBlockPixels];  // by the sums of weight x attribute
    std::uint16_t alive[kNumBlocks];                                             // pixels that still let light through
    std::uint32_t alive_blocks;
    T min_transmittance;  // as painted
};

// Four values, one every `stride`. By reference: the calling convention for vectors of 32 bytes depends on the
// instruction set.
template <class T, class Four>
[[gnu::always_inline]] inline void load_four(const T* values, std::size_t stride, Four& four) {
    if (stride == 1) {
        __builtin_memcpy(&four, values, sizeof four);
        return;
    }
    const T copy[4] = {values[0], values[stride], values[2 * stride], values[3 * stride]};
    __builtin_memcpy(&four, copy, sizeof four);
}

// Fills four pixels of block b, from p on, with four of the picture.
template <class T, int channels>
[[gnu::always_inline]] inline void read_four(const PictureGradients<T>& picture, std::size_t pixel, int b, int p,
                                             GradientTile<T, channels>& tile) {
    using Four = typename Colors<T>::Four;
    const auto store = [](T* plane, const Four& four) { __builtin_memcpy(plane, &four, sizeof four); };
    const Colors<T> color = deinterleave(picture.rgb + 3 * pixel), v = deinterleave(picture.v_rgb + 3 * pixel);
    Four alpha{}, v_weight{}, of_blue = v.blue * color.blue;
    if (channels > 0 || picture.v_alpha != nullptr) load_four(picture.alpha + pixel, 1, alpha);
    if (picture.v_alpha != nullptr) {
        load_four(picture.v_alpha + pixel, 1, v_weight);
        of_blue = of_blue + v_weight * alpha;
    }
    for (int c = 0; c < channels; ++c) {
        const Channel<const T> layer = picture.layers.channels[c], v_layer = picture.v_layers.channels[c];
        Four mean, v_mean;
        load_four(layer.values + pixel * layer.stride, layer.stride, mean);
        load_four(v_layer.values + pixel * v_layer.stride, v_layer.stride, v_mean);
        const Four v_sum = alpha > 0 ? v_mean / alpha : Four{};  // the layer is that sum over alpha
        v_weight = v_weight - v_sum * mean;
        store(tile.v_sum[c][b] + p, v_sum);
    }
    store(tile.behind[b] + p, (v.red * color.red + v.green * color.green) + of_blue);
    store(tile.v_color[0][b] + p, v.red);
    store(tile.v_color[1][b] + p, v.green);
    store(tile.v_color[2][b] + p, v.blue);
    store(tile.v_weight[b] + p, v_weight);
}

// The same at the border of the picture: the first `count` of the four pixels, then zeros.
template <class T, int channels>
void read_some(const PictureGradients<T>& picture, std::size_t pixel, std::size_t count, int b, int p,
               GradientTile<T, channels>& tile) {
    T rgb[12] = {}, v_rgb[12] = {}, alpha[4] = {}, v_alpha[4] = {};
    T layers[channels > 0 ? channels : 1][4] = {}, v_layers[channels > 0 ? channels : 1][4] = {};
    const auto copy = [count](const T* from, std::size_t stride, T* to) {
        for (std::size_t i = 0; i < count; ++i) to[i] = from[i * stride];
    };
    for (std::size_t i = 0; i < 3 * count; ++i) rgb[i] = picture.rgb[3 * pixel + i];
    for (std::size_t i = 0; i < 3 * count; ++i) v_rgb[i] = picture.v_rgb[3 * pixel + i];
    copy(picture.alpha + pixel, 1, alpha);
    if (picture.v_alpha != nullptr) copy(picture.v_alpha + pixel, 1, v_alpha);
    PictureGradients<T> four{rgb, alpha, {}, v_rgb, v_alpha, {}};
    for (int c = 0; c < channels; ++c) {
        const Channel<const T> layer = picture.layers.channels[c], v_layer = picture.v_layers.channels[c];
        copy(layer.values + pixel * layer.stride, layer.stride, layers[c]);
        copy(v_layer.values + pixel * v_layer.stride, v_layer.stride, v_layers[c]);
        four.layers.channels[c] = {layers[c], 1};
        four.v_layers.channels[c] = {v_layers[c], 1};
    }
    read_four(four, 0, b, p, tile);
}

// The picture by value: through a reference it would be reloaded after every store to the tile.
template <class T, int channels>
void start(const TileTask<T>& task, const PictureGradients<T> picture, GradientTile<T, channels>& tile) {
    const int columns_left = task.params.width - task.x0, rows_left = task.params.height - task.y0;
    const int num_columns = columns_left < kTileWidth ? columns_left : kTileWidth;
    const int num_rows = rows_left < kTileHeight ? rows_left : kTileHeight;
    // Beyond the picture zeros are used, which add nothing.
    if (num_columns < kTileWidth || num_rows < kTileHeight) __builtin_memset(&tile, 0, sizeof tile);
    tile.alive_blocks = open_pixels(columns_left, rows_left, tile.alive);
    tile.min_transmittance = static_cast<T>(task.params.min_transmittance);
    T* all = tile.transmittance[0];
    for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
    // Block by block: a cache line of each plane is filled at once, which is 1.3 times as fast as row by row.
    for (int b = 0; b < kNumBlocks; ++b) {
        const int x = b % kBlockColumns * kBlockSize;
        for (int row = 0; row < kBlockSize; ++row) {
            const int y = b / kBlockColumns * kBlockSize + row;
            if (x >= num_columns || y >= num_rows) break;
            const std::size_t pixel =
                static_cast<std::size_t>(task.y0 + y) * static_cast<std::size_t>(task.params.width) +
                static_cast<std::size_t>(task.x0 + x);
            if (x + kBlockSize <= num_columns)
                read_four(picture, pixel, b, row * kBlockSize, tile);
            else
                read_some(PictureGradients<T>(picture), pixel, static_cast<std::size_t>(num_columns - x), b,
                          row * kBlockSize, tile);
        }
    }
}

// Adds the pixels of some blocks, with gradients `v_alphas` by alpha, to the gradient by the texels of the record's
// level.
template <class T, Kernel kernel>
void add_texels(const TileTask<T>& task, const Record<T>& record, std::uint32_t blocks,
                const T (&v_alphas)[kNumBlocks][kBlockPixels], double* const* texels) {
    const auto index = static_cast<std::size_t>(record.level);
    const int columns = task.params.levels[index].columns, rows = task.params.levels[index].rows;
    const double opacity = 255.0 * static_cast<double>(record.opacity);
    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        for (int p = 0; p < kBlockPixels; ++p) {
            const double v = opacity * static_cast<double>(v_alphas[b][p]);
            if (v == 0) continue;
            const double dx = task.x0 + b % kBlockColumns * kBlockSize + p % kBlockSize - record.anchor_x;
            const double dy = task.y0 + b / kBlockColumns * kBlockSize + p / kBlockSize - record.anchor_y;
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

// The factors of a record's color at the pixels of a tile, and their derivatives by texels along v and by the half
// extent along v as far as streaks fade with it; 0 outside its box.
template <class T>
struct Shades {
    alignas(64) T factor[kNumBlocks][kBlockPixels];
    alignas(64) T by_v[kNumBlocks][kBlockPixels];
    alignas(64) T by_extent[kNumBlocks][kBlockPixels];
};

// Called by `sample_record` to fill `shades` with the streaks of box `id`.
template <class T>
[[gnu::always_inline]] inline auto streak_shader(const TileTask<T>& task, const Record<T>& record, std::uint32_t id,
                                                 Shades<T>& shades) {
    using L = Lanes<T>;
    const StreakView<T>& view = task.boxes.streaks;
    const Streaks<T> streaks(view, task.params.levels[static_cast<std::size_t>(record.level)], id);
    const typename Streaks<T>::Mix mix(1, view.weights + 2 * id), mix_slope(0, view.slopes + 2 * id);
    return [ streaks, mix, mix_slope, &shades ](int b, int lane, auto v, auto inside) __attribute__((always_inline)) {
        const auto noise = streaks.at(v, inside);
        L::store(shades.factor[b] + lane, L::where(inside, noise.mixed(mix)));
        L::store(shades.by_v[b] + lane, L::where(inside, noise.slope(mix) * streaks.scale));
        L::store(shades.by_extent[b] + lane, L::where(inside, noise.mixed(mix_slope)));
    };
}

// The colors of a record at the pixels of a tile and their derivatives by texels along u and v; 0 where a channel is
// held at 0, and outside its box.
template <class T>
struct TintedColors {
    alignas(64) T color[3][kNumBlocks][kBlockPixels];
    alignas(64) T by_u[3][kNumBlocks][kBlockPixels];
    alignas(64) T by_v[3][kNumBlocks][kBlockPixels];
};

// What `sample_record` calls to fill them.
template <class T>
struct TintSlopeShader {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Tints<T> tints;
    TintedColors<T>& colors;

    [[gnu::always_inline]] inline void operator()(int, int, Real, typename L::Mask) const {}
    template <class Sampler>
    [[gnu::always_inline]] inline void tint(int b, int lane, const Sampler& sampler, const typename L::Word* texel,
                                            const T* fu, const T* fv, typename L::Mask inside) const {
        const auto samples = sampler.tints_at(texel, fu, fv);
        for (int c = 0; c < 3; ++c) {
            const Real color = tints.base[c] + tints.step * samples[c].coverage;
            const auto is_free = L::less(inside, L::set(0), color);
            L::store(colors.color[c][b] + lane, L::where(is_free, color));
            L::store(colors.by_u[c][b] + lane, L::where(is_free, tints.step * samples[c].slope_u));
            L::store(colors.by_v[c][b] + lane, L::where(is_free, tints.step * samples[c].slope_v));
        }
    }
};

// The blocks of the tile that the record of entry `place` of its list may paint on: as painted, if that was kept.
template <class T>
[[gnu::always_inline]] inline std::uint32_t blocks_to_read(const std::uint32_t* painted, std::size_t place,
                                                           const TileTask<T>& task, const Record<T>& record) {
    return painted != nullptr ? painted[place] : blocks_in_bounds(record, task.x0, task.y0);
}

// Returns whether the record paints on these blocks of the tile; only then are there sums.
template <class T, Kernel kernel, Shading shading = Shading::none, int channels>
[[gnu::always_inline]] inline bool differentiate_record(std::uint32_t blocks, const TileTask<T>& task,
                                                        const Record<T>& record,
                                                        const Attributes<T, channels>& attributes, std::uint32_t id,
                                                        GradientTile<T, channels>& tile, T* sums,
                                                        double* const* texels) {
    if (blocks == 0) return false;
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width, num_planes = 3 + channels;
    constexpr bool has_slopes = kernel == Kernel::bilinear || kernel == Kernel::gaussian;
    constexpr bool has_streaks = shading == Shading::streaks, is_tinted = shading == Shading::tints;
    const int x0 = task.x0, y0 = task.y0;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint16_t pixels[kNumBlocks];
    Slopes<T> slopes;
    Shades<T> shades;
    std::conditional_t<is_tinted, TintedColors<T>, char> tinted;
    if constexpr (is_tinted)
        blocks =
            sample_blocks<T, kernel, true, has_slopes>(blocks, task.params, record, x0, y0, tile, alphas, pixels,
                                                       &slopes, TintSlopeShader<T>{Tints<T>(task, record), tinted});
    else if constexpr (has_streaks)
        blocks = sample_blocks<T, kernel, true, has_slopes>(blocks, task.params, record, x0, y0, tile, alphas, pixels,
                                                            &slopes, streak_shader(task, record, id, shades));
    else
        blocks = sample_blocks<T, kernel, true, has_slopes>(blocks, task.params, record, x0, y0, tile, alphas, pixels,
                                                            &slopes);
    if (blocks == 0) return false;
    const Real darkest = L::set(tile.min_transmittance);
    const Real one = L::set(1), zero = L::set(0);
    const Real per_opacity = L::set(1 / record.opacity);  // the sums of an image are multiplied by it in the end
    Real values[num_planes];
    for (int c = 0; c < 3; ++c) values[c] = L::set(record.color[c]);
    for (int c = 0; c < channels; ++c) values[3 + c] = L::set(attributes.of(id, c));
    const Real from_x = L::set(static_cast<T>(x0 - record.anchor_x)),
               from_y = L::set(static_cast<T>(y0 - record.anchor_y));
    alignas(64) T lanes[num_sums(channels)][kBlockPixels];
    for (int lane = 0; lane < kBlockPixels; lane += W) {
        const Real pixel_x = L::load(offsets<T>.pixel_x + lane) + from_x;
        const Real pixel_y = L::load(offsets<T>.pixel_y + lane) + from_y;
        Real u = zero, ux = zero, uy = zero, v = zero, vx = zero, vy = zero, a = zero, extent = zero;
        Real v_values[num_planes];
        for (int k = 0; k < num_planes; ++k) v_values[k] = zero;
        for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
            const int b = __builtin_ctz(rest);
            const Real alpha = L::load(alphas[b] + lane);
            const Blended<T> blended = blend_lanes(alpha, darkest, tile.transmittance[b] + lane);
            const Real weight = blended.weight;
            finish_pixels(tile, b, blended.finished() << lane);

            Real v_color[3];
            for (int c = 0; c < 3; ++c) v_color[c] = L::load(tile.v_color[c][b] + lane);
            Real shade, of_color = weight, v_factor = zero;
            if constexpr (is_tinted) {
                shade = L::load(tile.v_weight[b] + lane);
                for (int c = 0; c < 3; ++c) shade = shade + v_color[c] * L::load(tinted.color[c][b] + lane);
            } else if constexpr (has_streaks) {
                const Real factor = L::load(shades.factor[b] + lane);
                const Real whole = (v_color[0] * values[0] + v_color[1] * values[1]) + v_color[2] * values[2];
                shade = whole * factor + L::load(tile.v_weight[b] + lane);
                of_color = weight * factor;
                v_factor = weight * whole;
                extent = extent + v_factor * L::load(shades.by_extent[b] + lane);
            } else {
                shade = (v_color[0] * values[0] + v_color[1] * values[1]) +
                        (v_color[2] * values[2] + L::load(tile.v_weight[b] + lane));
            }
            for (int c = 0; c < 3; ++c) {
                if constexpr (is_tinted) {
                    const auto is_free = L::less(L::from_bits(~0u), zero, L::load(tinted.color[c][b] + lane));
                    v_values[c] = v_values[c] + L::where(is_free, weight * v_color[c]);
                } else {
                    v_values[c] = v_values[c] + of_color * v_color[c];
                }
            }
            for (int c = 0; c < channels; ++c) {
                const Real v_sum = L::load(tile.v_sum[c][b] + lane);
                shade = shade + v_sum * values[3 + c];
                v_values[3 + c] = v_values[3 + c] + weight * v_sum;
            }
            const Real behind = L::load(tile.behind[b] + lane) - weight * shade;
            L::store(tile.behind[b] + lane, behind);
            // Alpha at its bound does not change.
            const auto is_free = L::less(blended.kept, alpha, L::set(static_cast<T>(kMaxAlpha)));
            const Real v_alpha = L::where(is_free, blended.before * shade - behind / (one - alpha));
            const Real v_log = v_alpha * alpha;
            a = a + v_log;
            if constexpr (has_slopes || has_streaks) {
                const Real x = pixel_x + L::set(offsets<T>.block_x[b]), y = pixel_y + L::set(offsets<T>.block_y[b]);
                const Real v_coverage = kernel == Kernel::gaussian ? v_log : v_alpha;
                Real v_v = zero;
                if constexpr (has_slopes) {
                    Real v_u = v_coverage * L::load(slopes.u[b] + lane);
                    v_v = v_coverage * L::load(slopes.v[b] + lane);
                    if constexpr (is_tinted) {
                        const Real scaled = weight * per_opacity;
                        for (int c = 0; c < 3; ++c) {
                            const Real v_c = scaled * v_color[c];
                            v_u = v_u + v_c * L::load(tinted.by_u[c][b] + lane);
                            v_v = v_v + v_c * L::load(tinted.by_v[c][b] + lane);
                        }
                    }
                    u = u + v_u;
                    ux = ux + v_u * x;
                    uy = uy + v_u * y;
                }
                if constexpr (has_streaks) v_v = v_v + v_factor * L::load(shades.by_v[b] + lane) * per_opacity;
                v = v + v_v;
                vx = vx + v_v * x;
                vy = vy + v_v * y;
            }
            if (texels != nullptr) L::store(alphas[b] + lane, v_alpha);
        }
        const auto put = [&](int sum, Real value) { L::store(lanes[sum] + lane, value); };
        put(kU, u), put(kUx, ux), put(kUy, uy), put(kV, v), put(kVx, vx), put(kVy, vy), put(kAlpha, a);
        for (int k = 0; k < num_planes; ++k) put(kRed + k, v_values[k]);
        put(kRed + num_planes, extent);
        for (int k = kRed + num_planes + 1; k < num_sums(channels); ++k) put(k, zero);
    }
    add_lanes(lanes, sums);
    if constexpr (kernel == Kernel::bilinear || kernel == Kernel::nearest)
        if (texels != nullptr) add_texels<T, kernel>(task, record, blocks, alphas, texels);
    return true;
}

// By value: through a reference it would be reloaded after every store to the tile.
template <class T, Kernel kernel, int channels>
void differentiate_all(const TileTask<T> task, GradientTile<T, channels>& tile, const RecordSums<T> sums,
                       double* const* texels) {
    constexpr std::size_t width = num_sums(channels);
    const Attributes<T, channels> attributes(task.boxes.layers);
    std::size_t i = 0;
    for (; i < task.num_ids && tile.alive_blocks != 0; ++i) {
        prefetch(task, attributes, i);
        const std::uint32_t id = task.ids[i];
        const Record<T>& record = task.records[id];
        const std::uint32_t blocks = blocks_to_read(task.painted.strokes, i, task, record);
        sums.is_seen[i] = differentiate_record<T, kernel>(blocks, task, record, attributes, id, tile,
                                                          sums.values + width * i, texels);
    }
    __builtin_memset(sums.is_seen + i, 0, task.num_ids - i);
}

// Strokes with underpaint, with streaks, or with both. By value, as above.
template <class T, Kernel kernel, int channels>
void differentiate_all_layers(const TileTask<T> task, GradientTile<T, channels>& tile, const TileSums<T> sums,
                              double* const* texels) {
    constexpr std::size_t width = num_sums(channels);
    const Attributes<T, channels> attributes(task.boxes.layers);
    __builtin_memset(sums.strokes.is_seen, 0, task.num_ids);
    if (task.underpaints != nullptr) __builtin_memset(sums.underpaints.is_seen, 0, task.num_ids);
    LayerOrder<T> order(task);
    for (Layer layer; tile.alive_blocks != 0 && order.next(layer);) {
        const std::uint32_t id = task.ids[layer.place];
        if (layer.is_underpaint) {
            const Record<T>& record = task.underpaints[id];
            const std::uint32_t blocks = blocks_to_read(task.painted.underpaints, layer.place, task, record);
            sums.underpaints.is_seen[layer.place] = differentiate_record<T, Kernel::gaussian>(
                blocks, task, record, attributes, id, tile, sums.underpaints.values + width * layer.place, nullptr);
            continue;
        }
        prefetch(task, attributes, layer.place);
        const Record<T>& record = task.records[id];
        T* const own = sums.strokes.values + width * layer.place;
        const std::uint32_t blocks = blocks_to_read(task.painted.strokes, layer.place, task, record);
        if (task.params.has_tints && has_tints(task, record))
            sums.strokes.is_seen[layer.place] = differentiate_record<T, kernel, Shading::tints>(
                blocks, task, record, attributes, id, tile, own, texels);
        else if (shows_streaks(task, record, id))
            sums.strokes.is_seen[layer.place] = differentiate_record<T, kernel, Shading::streaks>(
                blocks, task, record, attributes, id, tile, own, texels);
        else
            sums.strokes.is_seen[layer.place] =
                differentiate_record<T, kernel>(blocks, task, record, attributes, id, tile, own, texels);
    }
}

template <class T, Kernel kernel, int channels>
void differentiate_image(const TileTask<T>& task, GradientTile<T, channels>& tile, const TileSums<T>& sums,
                         double* const* texels) {
    if (task.underpaints != nullptr || task.boxes.streaks.noise != nullptr || task.params.has_tints)
        differentiate_all_layers<T, kernel>(task, tile, sums, texels);
    else
        differentiate_all<T, kernel>(task, tile, sums.strokes, texels);
}

}  // namespace

template <class T>
void differentiate_tile(const TileTask<T>& task, const PictureGradients<T>& picture, const TileSums<T>& sums,
                        double* const* texels) {
    if (task.num_ids == 0) return;
    with_channels(picture.v_layers.count, [&]<int channels>() {
        GradientTile<T, channels> tile;
        start(task, picture, tile);
        switch (task.params.kernel) {
            case Kernel::bilinear:
                differentiate_image<T, Kernel::bilinear>(task, tile, sums, texels);
                break;
            case Kernel::nearest:
                differentiate_image<T, Kernel::nearest>(task, tile, sums, texels);
                break;
            case Kernel::gaussian:
                differentiate_all<T, Kernel::gaussian>(task, tile, sums.strokes, texels);
                break;
            case Kernel::ellipse:
                differentiate_all<T, Kernel::ellipse>(task, tile, sums.strokes, texels);
                break;
        }
    });
}

#ifdef BRUSHGS_IN_DOUBLE
template void differentiate_tile<double>(const TileTask<double>&, const PictureGradients<double>&,
                                         const TileSums<double>&, double* const*);
#else
template void differentiate_tile<float>(const TileTask<float>&, const PictureGradients<float>&, const TileSums<float>&,
                                        double* const*);
#endif

}  // namespace brushgs::BRUSHGS_ISA
