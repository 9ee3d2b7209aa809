// The hot loops of the rasterizer, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/raster.hpp"

#include <cmath>
#include <limits>
#include <type_traits>

#include "brushgs/blend_lanes.hpp"
#include "brushgs/crowd_order.hpp"
#include "brushgs/depth_test.hpp"
#include "brushgs/glaze.hpp"
#include "brushgs/relief.hpp"
#include "brushgs/sampling.hpp"
#include "brushgs/soft_order.hpp"
#include "brushgs/streaks.hpp"
#include "brushgs/tile_state.hpp"
#include "brushgs/tints.hpp"
#include "brushgs/trig.hpp"
#include "brushgs/underpaint.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr double kMinExtent = 1e-12;  // pixels: anything thinner holds no pixel center

template <class T>
T clamped(T x, T low, T high) {
    return x < low ? low : (x > high ? high : x);
}

// Scale from pixels to the kernel's own unit (texels, standard deviations or half axes), along one axis.
struct AxisMap {
    double scale;   // units per pixel
    double middle;  // coordinate of the box center
    double reach;   // painted half length, in half extents
};

AxisMap image_axis(double half_extent, int texels, double reach) {
    const double last = texels - 1;
    return {0.5 * last / (reach * half_extent), 0.5 * last, reach};
}

// A Gaussian of little opacity falls under the skip threshold inside its box: paint no further than that.
double visible_sigmas(double opacity) {
    const double sigmas = std::sqrt(2 * std::log(opacity / kMinAlpha)) * (1 + 1e-6);
    return sigmas < kGaussianSigmas ? sigmas : kGaussianSigmas;
}

// The paint of a box, or its underpaint.
struct Filling {
    AxisMap u, v;
    double opacity;      // of the record
    double limit;        // as in `Record`
    std::int32_t level;  // of an image
};

struct HalfExtents {
    double u, v;  // pixels
};

Filling kernel_filling(Kernel kernel, HalfExtents half, double opacity) {
    if (kernel != Kernel::gaussian) return {{1 / half.u, 0, 1}, {1 / half.v, 0, 1}, opacity, 1, 0};
    const double limit = visible_sigmas(opacity);
    return {{kGaussianSigmas / half.u, 0, limit / kGaussianSigmas},
            {kGaussianSigmas / half.v, 0, limit / kGaussianSigmas},
            opacity,
            limit,
            0};
}

Filling image_filling(const RasterParams& params, std::size_t i, HalfExtents half, double opacity) {
    const std::int32_t row = params.level_of_box.empty() ? 0 : params.level_of_box[i];
    const Level& level = params.levels[static_cast<std::size_t>(row)];
    return {image_axis(half.u, level.columns, level.reach_u), image_axis(half.v, level.rows, level.reach_v),
            opacity / 255, 1, row};
}

// Fills the record and the outline of box i, whose u axis is `axis`, or of its underpaint.
template <class T, class MakeFilling>
[[gnu::always_inline]] inline void make_record(const RasterParams& params, const BoxView<T>& boxes, std::size_t i,
                                               SinCos axis, HalfExtents half, double opacity,
                                               const MakeFilling& filling_of, Record<T>& record, Outline& outline) {
    record.left = record.top = outline.left = outline.top = 0;
    record.right = record.bottom = outline.right = outline.bottom = -1;
    for (std::size_t c = 0; c < 3; ++c) record.color[c] = boxes.colors[3 * i + c];  // also that of the underpaint
    if (!(half.u > kMinExtent && half.v > kMinExtent) || opacity < kMinAlpha) return;
    const Filling filling = filling_of(half, opacity);
    const AxisMap u = filling.u, v = filling.v;

    const double center_x = static_cast<double>(boxes.centers[2 * i]);
    const double center_y = static_cast<double>(boxes.centers[2 * i + 1]);
    const double reach_u = half.u * u.reach, reach_v = half.v * v.reach;
    const double reach_x = std::fabs(axis.cos) * reach_u + std::fabs(axis.sin) * reach_v;
    const double reach_y = std::fabs(axis.sin) * reach_u + std::fabs(axis.cos) * reach_v;
    const double left = std::ceil(clamped(center_x - reach_x - 0.5, static_cast<double>(params.left), 1e5));
    const double top = std::ceil(clamped(center_y - reach_y - 0.5, static_cast<double>(params.first_row), 1e5));
    const double right = std::floor(clamped(center_x + reach_x - 0.5, -1.0, params.right() - 1.0));
    const int end_row = params.end_row < params.height ? params.end_row : params.height;
    const double bottom = std::floor(clamped(center_y + reach_y - 0.5, -1.0, end_row - 1.0));
    if (!(left <= right && top <= bottom)) return;
    record.left = static_cast<std::int16_t>(left);
    record.top = static_cast<std::int16_t>(top);
    record.right = static_cast<std::int16_t>(right);
    record.bottom = static_cast<std::int16_t>(bottom);

    const double anchor_x = std::floor(clamped(center_x, 0.0, static_cast<double>(params.width))) + 0.5;
    const double anchor_y = std::floor(clamped(center_y, 0.0, static_cast<double>(params.height))) + 0.5;
    const double du_dx = axis.cos * u.scale, du_dy = axis.sin * u.scale;
    const double dv_dx = -axis.sin * v.scale, dv_dy = axis.cos * v.scale;
    record.anchor_x = static_cast<std::int16_t>(anchor_x);
    record.anchor_y = static_cast<std::int16_t>(anchor_y);
    record.offset_u = static_cast<T>(u.middle + du_dx * (anchor_x - center_x) + du_dy * (anchor_y - center_y));
    record.offset_v = static_cast<T>(v.middle + dv_dx * (anchor_x - center_x) + dv_dy * (anchor_y - center_y));
    record.du_dx = static_cast<T>(du_dx);
    record.du_dy = static_cast<T>(du_dy);
    record.dv_dx = static_cast<T>(dv_dx);
    record.dv_dy = static_cast<T>(dv_dy);
    record.opacity = static_cast<T>(filling.opacity);
    record.limit = static_cast<T>(filling.limit);
    record.level = filling.level;
    outline = {static_cast<float>(center_x),
               static_cast<float>(center_y),
               static_cast<float>(axis.cos),
               static_cast<float>(axis.sin),
               static_cast<float>(reach_u),
               static_cast<float>(reach_v),
               record.left,
               record.top,
               record.right,
               record.bottom};
}

// Extends an outline to contain another of the same center and direction.
void unite(Outline& outline, const Outline& other) {
    if (other.right < other.left) return;
    if (outline.right < outline.left) {
        outline = other;
        return;
    }
    const auto larger = [](auto x, auto y) { return x > y ? x : y; };
    const auto smaller = [](auto x, auto y) { return x < y ? x : y; };
    outline.reach_u = larger(outline.reach_u, other.reach_u);
    outline.reach_v = larger(outline.reach_v, other.reach_v);
    outline.left = smaller(outline.left, other.left);
    outline.top = smaller(outline.top, other.top);
    outline.right = larger(outline.right, other.right);
    outline.bottom = larger(outline.bottom, other.bottom);
}

template <class T>
void make_record(const RasterParams& params, const BoxView<T>& boxes, std::size_t i, SinCos axis, Record<T>* records,
                 Outline& outline) {
    const HalfExtents half{static_cast<double>(boxes.half_extents[2 * i]),
                           static_cast<double>(boxes.half_extents[2 * i + 1])};
    const double opacity = static_cast<double>(boxes.opacities[i]);
    const bool is_image = params.kernel == Kernel::bilinear || params.kernel == Kernel::nearest;
    const auto fill = [&](HalfExtents of, double how) {
        return is_image ? image_filling(params, i, of, how) : kernel_filling(params.kernel, of, how);
    };
    make_record(params, boxes, i, axis, half, opacity, fill, records[i], outline);
    const UnderpaintView<T>& under = boxes.underpaint;
    if (under.setbacks == nullptr) return;
    const double reach = under.reaches == nullptr ? under.reach : under.reaches[i];
    Outline other;
    make_record(
        params, boxes, i, axis, {reach * half.u, reach * half.v}, under.opacity * opacity,
        [](HalfExtents of, double how) { return kernel_filling(Kernel::gaussian, of, how); }, records[boxes.count + i],
        other);
    unite(outline, other);
}

}  // namespace

template <class T>
void make_records(const RasterParams& params, const BoxView<T>& boxes, std::size_t begin, std::size_t end,
                  Record<T>* records, Outline* outlines) {
    constexpr std::size_t group = 64;  // one pass of vector trigonometry, small enough for the stack
    for (std::size_t first = begin; first < end; first += group) {
        const std::size_t count = end - first < group ? end - first : group;
        double sines[group], cosines[group], angles[group] = {};
        for (std::size_t k = 0; k < count; ++k) angles[k] = within_reach(static_cast<double>(boxes.angles[first + k]));
        for (std::size_t k = 0; k < group; ++k) {
            const SinCos axis = sincos_of(angles[k]);
            sines[k] = axis.sin;
            cosines[k] = axis.cos;
        }
        for (std::size_t k = 0; k < count; ++k)
            make_record(params, boxes, first + k, {sines[k], cosines[k]}, records, outlines[first - begin + k]);
    }
}

namespace {

// Called by `sample_record` to fill `factors` with the streaks of box `id`: the factors of its color at the pixels of a
// tile; 0 outside its box.
template <class T>
[[gnu::always_inline]] inline auto streak_shader(const TileTask<T>& task, const Record<T>& record, std::uint32_t id,
                                                 T (&factors)[kNumBlocks][kBlockPixels]) {
    using L = Lanes<T>;
    const StreakView<T>& view = task.boxes.streaks;
    const Streaks<T> streaks(view, task.params.levels[static_cast<std::size_t>(record.level)], id);
    const typename Streaks<T>::Mix mix(1, view.weights + 2 * id);
    const Level& level = task.params.levels[static_cast<std::size_t>(record.level)];
    const FineBristles<T> fine(view, level, id, 1);
    return [ streaks, mix, fine, &factors ](int b, int lane, auto v, auto inside) __attribute__((always_inline)) {
        auto factor = streaks.at(v, inside).mixed(mix);
        if (fine.noise != nullptr) factor = factor + fine.at(v, inside);
        L::store(factors[b] + lane, L::where(inside, factor));
    };
}

// What `sample_record` calls for box `id`: streaks or tints, heights, both or neither.
template <class T, Kernel kernel, Shading shading, bool has_relief, class Shades, class Heights>
[[gnu::always_inline]] inline auto shader_of(const TileTask<T>& task, const Record<T>& record, std::uint32_t id,
                                             Shades& shades, Heights& heights) {
    if constexpr (has_relief && is_image<kernel>) {
        const auto other = shader_of<T, kernel, shading, false>(task, record, id, shades, heights);
        return HeightShader<T, Heights, std::remove_const_t<decltype(other)>>(task, record, id, heights, other);
    } else if constexpr (shading == Shading::tints) {
        return TintShader<T, Shades>{Tints<T>(task, record), shades};
    } else if constexpr (shading == Shading::streaks) {
        return streak_shader(task, record, id, shades[0]);
    } else {
        return NoShader{};
    }
}

// The pixels of a tile that still let light through: all that sampling reads of it.
struct AlivePixels {
    std::uint32_t alive_blocks;
    const std::uint16_t* alive;
};

// `sample_record`, sifted, as a function of its own: one for all painters that do not hang on it. Inlined into every
// painter, sampling takes most of the time that this file needs to compile.
template <class T, Kernel kernel, class Shader>
[[gnu::noinline]] std::uint32_t sample_apart(const RasterParams& params, const Record<T>& record, int x0, int y0,
                                             const AlivePixels alive, T (&alphas)[kNumBlocks][kBlockPixels],
                                             std::uint16_t* pixels, const Shader shader) {
    return sample_record<T, kernel, true>(params, record, x0, y0, alive, alphas, pixels, shader);
}

// The same with the kernel of the picture: `kernel` is bilinear for every image, so that what blends the samples is
// compiled once for all images.
template <class T, Kernel kernel, class Tile, class Shader>
[[gnu::always_inline]] inline std::uint32_t sample_sifted(const TileTask<T>& task, const Record<T>& record,
                                                          const Tile& tile, T (&alphas)[kNumBlocks][kBlockPixels],
                                                          std::uint16_t* pixels, const Shader& shader) {
    const AlivePixels alive{tile.alive_blocks, tile.alive};
    if (is_image<kernel> && task.params.kernel == Kernel::nearest)
        return sample_apart<T, Kernel::nearest>(task.params, record, task.x0, task.y0, alive, alphas, pixels, shader);
    return sample_apart<T, kernel>(task.params, record, task.x0, task.y0, alive, alphas, pixels, shader);
}

// Inlined where most pictures spend their time: a call costs Gaussians and underpaint up to 10 %, strokes 3 %.
template <class T, Kernel kernel, Shading shading, int channels>
constexpr bool is_inlined =
    sizeof(T) == sizeof(float) &&
    (kernel == Kernel::gaussian || (kernel == Kernel::bilinear && channels == 0 && shading != Shading::tints));

template <class T, Kernel kernel, Shading shading, int channels, class Tile, class Shader>
[[gnu::always_inline]] inline std::uint32_t sample_for_painter(const TileTask<T>& task, const Record<T>& record,
                                                               const Tile& tile, T (&alphas)[kNumBlocks][kBlockPixels],
                                                               const Shader& shader) {
    if constexpr (is_inlined<T, kernel, shading, channels>)
        if (!is_image<kernel> || task.params.kernel == Kernel::bilinear)
            return sample_record<T, kernel>(task.params, record, task.x0, task.y0, tile, alphas, nullptr, shader);
    std::uint16_t pixels[kNumBlocks];
    return sample_sifted<T, kernel>(task, record, tile, alphas, pixels, shader);
}

// Returns the blocks that the record paints on. `share` of the thickness is that of a record without a height of its
// own.
template <class T, Kernel kernel, Shading shading = Shading::none, int channels, bool has_relief>
[[gnu::always_inline]] inline std::uint32_t blend_record(const TileTask<T>& task, const Record<T>& record,
                                                         const Attributes<T, channels>& attributes, std::uint32_t id,
                                                         TileState<T, channels, has_relief>& tile, T share = 1) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width, num_values = 3 + channels;
    if (is_behind(task, id)) return 0;
    // Two passes over the blocks: then only the first waits for gathers, and it has few instructions.
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    alignas(64) T shades[shading == Shading::tints ? 3 : 1][kNumBlocks][kBlockPixels];
    alignas(64) T heights[kNumBlocks][kBlockPixels];
    const auto shader = shader_of<T, kernel, shading, has_relief>(task, record, id, shades, heights);
    std::uint32_t blocks = sample_for_painter<T, kernel, shading, channels>(task, record, tile, alphas, shader);
    if (task.limits != nullptr) fade_behind(task, id, blocks, alphas);
    Real values[num_values];
    for (int c = 0; c < 3; ++c) values[c] = L::set(record.color[c]);
    for (int c = 0; c < channels; ++c) values[3 + c] = L::set(attributes.of(id, c));
    const Real darkest = L::set(tile.min_transmittance);
    Real height = darkest;
    if constexpr (has_relief && !is_image<kernel>) height = L::set(thickness_of(task, id, share));

    std::uint32_t painted_blocks = 0;
    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        unsigned finished = 0, all_painted = 0;
        for (int part = 0; part < kBlockPixels / W; ++part) {
            const int lane = part * W;
            const Blended<T> blended = blend_lanes(L::load(alphas[b] + lane), darkest, tile.light(b) + lane);
            const Real weight = blended.weight;
            Real of_color = weight;
            if constexpr (shading == Shading::streaks) of_color = weight * L::load(shades[0][b] + lane);
            for (int k = 0; k < num_values; ++k) {
                T* const plane = tile.plane(k, b) + lane;
                if constexpr (shading == Shading::tints) {
                    L::store(plane,
                             L::load(plane) + weight * (k < 3 ? L::load(shades[k < 3 ? k : 0][b] + lane) : values[k]));
                } else {
                    L::store(plane, L::load(plane) + (k < 3 ? of_color : weight) * values[k]);
                }
            }
            if constexpr (has_relief) {
                T* const plane = tile.plane(num_values, b) + lane;
                if constexpr (is_image<kernel>) height = L::load(heights[b] + lane);
                L::store(plane, L::load(plane) + weight * height);
            }
            all_painted |= L::bits(blended.painted);
            finished |= blended.finished() << lane;
        }
        painted_blocks |= (all_painted == 0 ? 0u : 1u) << b;
        finish_pixels(tile, b, finished);
    }
    return painted_blocks;
}

// By value: through a reference it would be reloaded after every store to the tile.
template <class T, Kernel kernel, int channels, bool has_relief>
void blend_all(const TileTask<T> task, TileState<T, channels, has_relief>& tile) {
    const Attributes<T, channels> attributes(task.boxes.layers);
    for (std::size_t i = 0; i < task.num_ids && tile.alive_blocks != 0; ++i) {
        prefetch(task, attributes, i);
        const std::uint32_t id = task.ids[i];
        const std::uint32_t blocks = blend_record<T, kernel>(task, task.records[id], attributes, id, tile);
        if (task.painted.strokes != nullptr) task.painted.strokes[i] = blocks;
    }
}

// Strokes with underpaint, with streaks, with tints or with relief. By value, as above.
template <class T, int channels, bool has_relief>
void blend_all_layers(const TileTask<T> task, TileState<T, channels, has_relief>& tile) {
    const Attributes<T, channels> attributes(task.boxes.layers);
    LayerOrder<T> order(task);
    for (Layer layer; tile.alive_blocks != 0 && order.next(layer);) {
        const std::uint32_t id = task.ids[layer.place];
        if (layer.is_underpaint) {
            const std::uint32_t blocks = blend_record<T, Kernel::gaussian>(task, task.underpaints[id], attributes, id,
                                                                           tile, static_cast<T>(kUnderpaintThickness));
            if (task.painted.underpaints != nullptr) task.painted.underpaints[layer.place] = blocks;
            continue;
        }
        prefetch(task, attributes, layer.place);
        const Record<T>& record = task.records[id];
        std::uint32_t blocks;
        if (task.params.has_tints && has_tints(task, record))
            blocks = blend_record<T, Kernel::bilinear, Shading::tints>(task, record, attributes, id, tile);
        else if (shows_streaks(task, record, id))
            blocks = blend_record<T, Kernel::bilinear, Shading::streaks>(task, record, attributes, id, tile);
        else
            blocks = blend_record<T, Kernel::bilinear>(task, record, attributes, id, tile);
        if (task.painted.strokes != nullptr) task.painted.strokes[layer.place] = blocks;
    }
}

// `share` as for `blend_record`. `kernel` is gaussian for underpaint and bilinear for every image: that of the picture
// is chosen here, so that what blends the samples is compiled once for both.
template <class T, Kernel kernel, Shading shading = Shading::none, Shading kept>
[[gnu::always_inline]] inline void sample_softly(const TileTask<T>& task, const Record<T>& record,
                                                 const SoftTile<T>& tile, bool has_relief,
                                                 SoftSamples<T, kept>& samples, T share = 1) {
    const std::uint32_t id = samples.record.id;
    const auto sample = [&]<bool raises>() {
        const auto shader = shader_of<T, kernel, shading, raises>(task, record, id, samples.shades, samples.heights);
        samples.blocks = sample_sifted<T, kernel>(task, record, tile, samples.alphas, samples.pixels, shader);
    };
    is_image<kernel>&& has_relief ? sample.template operator()<true>() : sample.template operator()<false>();
    if (task.limits != nullptr) samples.blocks = sift_behind(task, id, samples.blocks, samples.alphas, samples.pixels);
    const auto fill = [](auto& planes, T value) {
        for (T& pixel : planes[0]) pixel = value;
    };
    samples.has_one_shade = shading == Shading::none;
    if constexpr (kept == Shading::streaks && shading == Shading::none) fill(samples.shades[0], 1);
    if constexpr (kept == Shading::tints && shading == Shading::none)
        for (int c = 0; c < 3; ++c) fill(samples.shades[c], record.color[c]);
    if constexpr (kept == Shading::tints && shading == Shading::streaks)
        for (std::uint32_t blocks = samples.blocks; blocks != 0; blocks &= blocks - 1)
            for (int p = 0, b = __builtin_ctz(blocks); p < kBlockPixels; ++p)
                for (int c = 2; c >= 0; --c) samples.shades[c][b][p] = samples.shades[0][b][p] * record.color[c];
    samples.has_one_height = !is_image<kernel>;
    if (has_relief && !is_image<kernel>) fill(samples.heights, thickness_of(task, id, share));
}

// The blocks of a tile that the box of a stroke image meets.
template <class T>
[[gnu::always_inline]] inline std::uint32_t blocks_of_image(const TileTask<T>& task, const Record<T>& record) {
    const std::uint32_t blocks = blocks_in_bounds(record, task.x0, task.y0);
    if (blocks == 0) return 0;
    const Sampler<T, Kernel::bilinear> sampler(task.params, record);
    return BlockCoordinates<T>().find(record, sampler, task.x0, task.y0, blocks);
}

// The bound on each stroke of a tile and all behind it; that of nothing at the end. For underpaint also in each block:
// then strokes that meet no block do not count, as the same tile in a part of the picture may not list them, and when
// fragments are final sets the order in which they are summed up.
template <class T>
void find_behind(const TileTask<T>& task, SoftQueues<T>& queues) {
    using L = Lanes<T>;
    const bool has_underpaint = task.underpaints != nullptr;
    make_behind(queues, task.num_ids + 1);
    SoftBehind<T> bound = queues.behind[task.num_ids] = {0, std::numeric_limits<T>::max()};
    T* begins = queues.begins + kNumBlocks * task.num_ids;
    for (int b = 0; b < kNumBlocks; ++b) begins[b] = bound.begin;
    for (std::size_t i = task.num_ids; i > 0; --i) {
        const std::uint32_t id = task.ids[i - 1];
        const std::uint32_t blocks = has_underpaint ? blocks_of_image(task, task.records[id]) : ~0u;
        const T softness = task.boxes.softness[id], squared = softness * softness;
        const T begin = task.boxes.depths[id] - softness;
        if (blocks != 0 && bound.squared_softness < squared) bound.squared_softness = squared;
        if (blocks != 0 && begin < bound.begin) bound.begin = begin;
        queues.behind[i - 1] = bound;
        if (!has_underpaint) continue;
        begins -= kNumBlocks;
        for (int b = 0; b < kNumBlocks; b += L::width) {
            const auto behind = L::load(begins + kNumBlocks + b);
            L::store(begins + b, L::select(L::from_bits(blocks >> b), L::min(behind, L::set(begin)), behind));
        }
    }
}

// By value, as above. `next` samples a record into its argument, or returns false at the end. Where too many fragments
// wait this notes that the tile is a crowd and ends; the tile has to be begun anew.
template <class T, Shading kept, class Next>
[[gnu::always_inline]] inline void blend_softly(const TileTask<T>& task, SoftQueues<T>& queues, SoftTile<T>& tile,
                                                const Next& next) {
    SoftState<T> soft;
    SoftBlender<T, kept> blender(task, queues, soft, tile);
    CrowdBlender<T, kept> crowd(task, queues.crowd, soft, tile);
    const bool is_crowd = queues.is_crowd;
    if (is_crowd) clear(queues.crowd, num_shades(kept), queues.keeps_heights);
    for (SoftSamples<T, kept> own; tile.alive_blocks != 0 && next(own);) {
        if (is_crowd) {
            crowd.add(own);
            continue;
        }
        if (own.blocks == 0) continue;
        blender.begin(own.record);
        const auto fragments_in = [&](int b) __attribute__((always_inline)) {
            return BlockFragments<T>{b, own.alphas[b], own.shades_of(b), own.heights_of(b), own.pixels[b]};
        };
        const std::uint32_t plain = blender.plain_blocks(own.blocks);
        for (std::uint32_t blocks = plain; blocks != 0; blocks &= blocks - 1)
            blender.blend_plainly(fragments_in(__builtin_ctz(blocks)));
        for (std::uint32_t blocks = own.blocks & ~plain; blocks != 0; blocks &= blocks - 1) {
            if (!blender.blend(fragments_in(__builtin_ctz(blocks)))) {
                queues.is_crowd = true;
                return;
            }
        }
    }
    if (is_crowd) crowd.finish();
    blender.finish();
}

template <class T>
[[gnu::always_inline]] inline SoftRecord<T> stroke_record(const BoxView<T>& boxes, std::uint32_t id,
                                                          const SoftBehind<T>& behind) {
    const T depth = boxes.depths[id], softness = boxes.softness[id];
    return {id, depth, softness * softness, depth + softness, behind, nullptr};
}

template <class T>
void blend_all_softly(const TileTask<T> task, SoftQueues<T>& queues, SoftTile<T>& tile) {
    clear(queues);
    find_behind(task, queues);
    const Attributes<T, kMostChannels> attributes(task.boxes.layers);
    std::size_t i = 0;
    blend_softly<T, Shading::none>(
        task, queues, tile, [&](SoftSamples<T, Shading::none> & samples) __attribute__((always_inline)) {
            if (i == task.num_ids) return false;
            prefetch(task, attributes, i);
            const std::uint32_t id = task.ids[i];
            samples.record = stroke_record(task.boxes, id, queues.behind[i]);
            sample_softly<T, Kernel::bilinear>(task, task.records[id], tile, false, samples);
            ++i;
            return true;
        });
}

// Strokes with underpaint, with streaks, with tints or with relief.
template <class T, Shading kept>
void blend_all_layers_softly(const TileTask<T> task, SoftQueues<T>& queues, SoftTile<T>& tile) {
    clear(queues);
    find_behind(task, queues);
    const Attributes<T, kMostChannels> attributes(task.boxes.layers);
    const bool has_relief = queues.keeps_heights;
    constexpr T largest = std::numeric_limits<T>::max();  // infinite depths would have no gap between them
    LayerOrder<T> order(task);
    blend_softly<T, kept>(
        task, queues, tile, [&](SoftSamples<T, kept> & samples) __attribute__((always_inline)) {
            Layer layer;
            if (!order.next(layer)) return false;
            const std::uint32_t id = task.ids[layer.place];
            if (layer.is_underpaint) {  // has no softness of its own
                const double exact = underpaint_depth(task.boxes, id);
                const T depth = exact < static_cast<double>(largest) ? static_cast<T>(exact) : largest;
                const std::size_t next = order.next_place();
                SoftBehind<T> rest = queues.behind[next];
                if (depth < rest.begin) rest.begin = depth;  // more underpaint may follow, here or behind
                samples.record = {id, depth, 0, depth, rest, queues.begins + kNumBlocks * next};
                sample_softly<T, Kernel::gaussian>(task, task.underpaints[id], tile, has_relief, samples,
                                                   static_cast<T>(kUnderpaintThickness));
                return true;
            }
            samples.record = stroke_record(task.boxes, id, queues.behind[layer.place]);
            prefetch(task, attributes, layer.place);
            const Record<T>& record = task.records[id];
            if constexpr (kept == Shading::tints) {
                if (has_tints(task, record)) {
                    sample_softly<T, Kernel::bilinear, Shading::tints>(task, record, tile, has_relief, samples);
                    return true;
                }
            }
            if (shows_streaks(task, record, id))
                sample_softly<T, Kernel::bilinear, Shading::streaks>(task, record, tile, has_relief, samples);
            else
                sample_softly<T, Kernel::bilinear>(task, record, tile, has_relief, samples);
            return true;
        });
}

// Whether strokes are more than their image.
template <class T>
bool has_layers(const TileTask<T>& task) {
    return task.underpaints != nullptr || task.boxes.streaks.noise != nullptr || task.params.has_tints;
}

template <class T, int channels, bool has_relief>
void blend_image(const TileTask<T>& task, TileState<T, channels, has_relief>& tile) {
    if constexpr (!has_relief) {
        if (!has_layers(task)) return blend_all<T, Kernel::bilinear>(task, tile);
    }
    blend_all_layers<T>(task, tile);
}

template <class T>
void blend_image_softly(const TileTask<T>& task, SoftQueues<T>& queues, SoftTile<T>& tile) {
    if (!queues.keeps_heights && !has_layers(task)) return blend_all_softly<T>(task, queues, tile);
    if (task.params.has_tints) return blend_all_layers_softly<T, Shading::tints>(task, queues, tile);
    blend_all_layers_softly<T, Shading::streaks>(task, queues, tile);
}

// Calls `work.operator()<channels, has_relief>()` with those of the picture.
template <class T, class Work>
void with_planes(const Picture<T>& picture, const Work& work) {
    with_channels(picture.layers.count, [&]<int channels>() {
        picture.height == nullptr ? work.template operator()<channels, false>()
                                  : work.template operator()<channels, true>();
    });
}

}  // namespace

template <class T>
void paint_tile(const TileTask<T>& task, const Picture<T>& picture) {
    if (task.num_ids == 0) return clear_tile(task, picture);
    with_planes(picture, [&]<int channels, bool has_relief>() {
        TileState<T, channels, has_relief> tile(task);
        switch (task.params.kernel) {
            case Kernel::bilinear:
            case Kernel::nearest:
                blend_image<T>(task, tile);
                break;
            case Kernel::gaussian:
                blend_all<T, Kernel::gaussian>(task, tile);
                break;
            case Kernel::ellipse:
                blend_all<T, Kernel::ellipse>(task, tile);
                break;
        }
        write_tile(task, tile, picture);
    });
}

template <class T>
void paint_tile_softly(const TileTask<T>& task, SoftQueues<T>& queues, const Picture<T>& picture) {
    if (task.num_ids == 0) return clear_tile(task, picture);
    SoftTile<T> tile(task, num_soft_planes(task, queues));
    queues.is_crowd = false;
    blend_image_softly<T>(task, queues, tile);
    if (queues.is_crowd) {
        tile = SoftTile<T>(task);  // a crowd reads all planes
        blend_image_softly<T>(task, queues, tile);
    }
    write_tile(task, tile, picture);
}

template <class T>
void glaze_tile(const TileTask<T>& task, const Picture<T>& picture) {
    TileState<T, 0> tile(task);
    switch (task.params.kernel) {
        case Kernel::bilinear:
            glaze_all<T, Kernel::bilinear>(task, tile);
            break;
        case Kernel::nearest:
            glaze_all<T, Kernel::nearest>(task, tile);
            break;
        case Kernel::gaussian:
            glaze_all<T, Kernel::gaussian>(task, tile);
            break;
        case Kernel::ellipse:
            glaze_all<T, Kernel::ellipse>(task, tile);
            break;
    }
    finish_tints(tile);
    write_tile(task, tile, picture);
}

#define BRUSHGS_INSTANTIATE(T)                                                                                  \
    template void make_records<T>(const RasterParams&, const BoxView<T>&, std::size_t, std::size_t, Record<T>*, \
                                  Outline*);                                                                    \
    template void paint_tile<T>(const TileTask<T>&, const Picture<T>&);                                         \
    template void paint_tile_softly<T>(const TileTask<T>&, SoftQueues<T>&, const Picture<T>&);                  \
    template void glaze_tile<T>(const TileTask<T>&, const Picture<T>&);
#ifdef BRUSHGS_IN_DOUBLE
BRUSHGS_INSTANTIATE(double)
#else
BRUSHGS_INSTANTIATE(float)
#endif
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs::BRUSHGS_ISA
