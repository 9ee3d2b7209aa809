// The hot loops of the rasteriser, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/raster.hpp"

#include <cmath>

#include "brushgs/sampling.hpp"
#include "brushgs/soft_order.hpp"
#include "brushgs/tile_state.hpp"
#include "brushgs/trig.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr double kMinExtent = 1e-12;  // pixels: anything thinner holds no pixel centre

template <class T>
T clamped(T x, T low, T high) {
    return x < low ? low : (x > high ? high : x);
}

// Scale from pixels to the kernel's own unit (texels, standard deviations or half axes), along one axis.
struct AxisMap {
    double scale;   // units per pixel
    double middle;  // coordinate of the box centre
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

template <class T>
void make_record(const RasterParams& params, const BoxView<T>& boxes, std::size_t i, SinCos axis, Record<T>& record,
                 Outline& outline) {
    record.left = record.top = 0;
    record.right = record.bottom = -1;
    const double half_u = static_cast<double>(boxes.half_extents[2 * i]);
    const double half_v = static_cast<double>(boxes.half_extents[2 * i + 1]);
    const double opacity = static_cast<double>(boxes.opacities[i]);
    if (!(half_u > kMinExtent && half_v > kMinExtent) || opacity < kMinAlpha) return;

    const bool is_image = params.kernel == Kernel::bilinear || params.kernel == Kernel::nearest;
    AxisMap u, v;
    double limit = 1;
    record.level = 0;
    if (is_image) {
        record.level = params.level_of_box.empty() ? 0 : params.level_of_box[i];
        const Level& level = params.levels[static_cast<std::size_t>(record.level)];
        u = image_axis(half_u, level.columns, level.reach_u);
        v = image_axis(half_v, level.rows, level.reach_v);
    } else if (params.kernel == Kernel::gaussian) {
        limit = visible_sigmas(opacity);
        u = {kGaussianSigmas / half_u, 0, limit / kGaussianSigmas};
        v = {kGaussianSigmas / half_v, 0, limit / kGaussianSigmas};
    } else {
        u = {1 / half_u, 0, 1};
        v = {1 / half_v, 0, 1};
    }

    const double center_x = static_cast<double>(boxes.centers[2 * i]);
    const double center_y = static_cast<double>(boxes.centers[2 * i + 1]);
    const double reach_u = half_u * u.reach, reach_v = half_v * v.reach;
    const double reach_x = std::fabs(axis.cos) * reach_u + std::fabs(axis.sin) * reach_v;
    const double reach_y = std::fabs(axis.sin) * reach_u + std::fabs(axis.cos) * reach_v;
    const double left = std::ceil(clamped(center_x - reach_x - 0.5, 0.0, 1e5));
    const double top = std::ceil(clamped(center_y - reach_y - 0.5, static_cast<double>(params.first_row), 1e5));
    const double right = std::floor(clamped(center_x + reach_x - 0.5, -1.0, params.width - 1.0));
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
    for (std::size_t c = 0; c < 3; ++c) record.color[c] = boxes.colors[3 * i + c];
    record.opacity = static_cast<T>(is_image ? opacity / 255 : opacity);
    record.limit = static_cast<T>(limit);
    outline = {static_cast<float>(center_x), static_cast<float>(center_y), static_cast<float>(axis.cos),
               static_cast<float>(axis.sin), static_cast<float>(reach_u),  static_cast<float>(reach_v)};
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
            make_record(params, boxes, first + k, {sines[k], cosines[k]}, records[first + k],
                        outlines[first - begin + k]);
    }
}

namespace {

template <class T, Kernel kernel, int channels>
[[gnu::always_inline]] inline void blend_record(const TileTask<T>& task, const Attributes<T, channels>& attributes,
                                                std::uint32_t id, TileState<T, channels>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width, num_planes = TileState<T, channels>::num_planes;
    const Record<T>& record = task.records[id];
    // Two passes over the blocks: what a gather makes wait is then only the first, and that has few instructions.
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint32_t blocks = sample_record<T, kernel>(task.params, record, task.x0, task.y0, tile, alphas);
    Real values[num_planes];
    for (int c = 0; c < 3; ++c) values[c] = L::set(record.color[c]);
    for (int c = 0; c < channels; ++c) values[3 + c] = L::set(attributes.of(id, c));
    const Real darkest = L::set(tile.min_transmittance);

    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        unsigned finished = 0;
        for (int part = 0; part < kBlockPixels / W; ++part) {
            const int lane = part * W;
            const Real alpha = L::load(alphas[b] + lane);
            const auto painted = L::at_least(L::from_bits(~0u), alpha, L::set(static_cast<T>(kMinAlpha)));
            const Real before = L::load(tile.transmittance[b] + lane);
            const Real full = before * alpha;
            const Real after = before - full;
            const auto kept = L::at_least(painted, after, darkest);
            const Real weight = L::where(kept, full);
            L::store(tile.transmittance[b] + lane, L::select(kept, after, before));
            for (int k = 0; k < num_planes; ++k) {
                T* const plane = tile.planes[k][b] + lane;
                L::store(plane, L::load(plane) + weight * values[k]);
            }
            finished |= (L::bits(painted) & ~L::bits(kept)) << lane;
        }
        finish_pixels(tile, b, finished);
    }
}

// By value: what lies behind a reference would be read anew after every store to the tile.
template <class T, Kernel kernel, int channels>
void blend_all(const TileTask<T> task, TileState<T, channels>& tile) {
    const Attributes<T, channels> attributes(task.boxes.layers);
    for (std::size_t i = 0; i < task.num_ids && tile.alive_blocks != 0; ++i) {
        prefetch(task, attributes, i);
        blend_record<T, kernel>(task, attributes, task.ids[i], tile);
    }
}

template <class T, Kernel kernel, int channels>
void blend_all_softly(const TileTask<T> task, SoftQueues<T>& queues, TileState<T, channels>& tile) {
    const T* const softness = task.boxes.softness;
    const T* const depths = task.boxes.depths;
    clear(queues);
    make_reaches(queues, task.num_ids);
    T* const reaches = queues.reaches;
    T largest = 0;
    for (std::size_t i = task.num_ids; i > 0; --i) {
        const T squared = softness[task.ids[i - 1]] * softness[task.ids[i - 1]];
        reaches[i - 1] = largest = squared > largest ? squared : largest;
    }
    // A record is sampled before the one in front of it is blended: what blending does next hangs on the samples.
    struct Samples {
        alignas(64) T alphas[kNumBlocks][kBlockPixels];
        std::uint16_t pixels[kNumBlocks];
        std::uint32_t blocks;
    } samples[2];
    const Attributes<T, channels> attributes(task.boxes.layers);
    SoftState<T> soft;
    SoftBlender<T, channels> blender(task, queues, soft, tile);
    for (std::size_t i = 0; i <= task.num_ids && tile.alive_blocks != 0; ++i) {
        if (i < task.num_ids) {
            prefetch(task, attributes, i);
            Samples& next = samples[i % 2];
            next.blocks = sample_record<T, kernel, true>(task.params, task.records[task.ids[i]], task.x0, task.y0, tile,
                                                         next.alphas, next.pixels);
        }
        if (i == 0) continue;
        const std::uint32_t id = task.ids[i - 1];
        const Samples& own = samples[(i - 1) % 2];
        const SoftRecord<T> record{id, depths[id], softness[id] * softness[id], reaches[i - 1]};
        for (std::uint32_t blocks = own.blocks; blocks != 0; blocks &= blocks - 1) {
            const int b = __builtin_ctz(blocks);
            blender.blend(record, {b, own.alphas[b], own.pixels[b]});
        }
    }
    blender.finish();
}

}  // namespace

template <class T>
void paint_tile(const TileTask<T>& task, const Picture<T>& picture) {
    with_channels(picture.layers.count, [&]<int channels>() {
        TileState<T, channels> tile(task);
        switch (task.params.kernel) {
            case Kernel::bilinear:
                blend_all<T, Kernel::bilinear>(task, tile);
                break;
            case Kernel::nearest:
                blend_all<T, Kernel::nearest>(task, tile);
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
    with_channels(picture.layers.count, [&]<int channels>() {
        TileState<T, channels> tile(task);
        if (task.params.kernel == Kernel::bilinear)
            blend_all_softly<T, Kernel::bilinear>(task, queues, tile);
        else
            blend_all_softly<T, Kernel::nearest>(task, queues, tile);
        write_tile(task, tile, picture);
    });
}

#define BRUSHGS_INSTANTIATE(T)                                                                                  \
    template void make_records<T>(const RasterParams&, const BoxView<T>&, std::size_t, std::size_t, Record<T>*, \
                                  Outline*);                                                                    \
    template void paint_tile<T>(const TileTask<T>&, const Picture<T>&);                                         \
    template void paint_tile_softly<T>(const TileTask<T>&, SoftQueues<T>&, const Picture<T>&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs::BRUSHGS_ISA
