// The order of work of the rasteriser's derivative: records and tile lists as for painting, tiles, boxes.
#include "brushgs/raster_backward.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "brushgs/memory.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

namespace {

// Tiles add to texels in so many groups, each into memory of its own, so that sums do not depend on the threads.
constexpr std::size_t kTexelGroups = 8;

template <class T>
struct BackwardKernels {
    decltype(&baseline::make_records<T>) make_records = &baseline::make_records<T>;
    decltype(&baseline::differentiate_tile<T>) differentiate_tile = &baseline::differentiate_tile<T>;

    BackwardKernels() {
#ifdef BRUSHGS_X86
        if (best_isa() == Isa::avx512) {
            make_records = &avx512::make_records<T>;
            differentiate_tile = &avx512::differentiate_tile<T>;
        } else if (best_isa() == Isa::avx2) {
            make_records = &avx2::make_records<T>;
            differentiate_tile = &avx2::differentiate_tile<T>;
        }
#endif
    }
};

// The gradients by box i from what its tiles summed.
template <class T>
void write_gradients(const RasterParams& params, const BoxView<T>& boxes, const Record<T>& record, std::size_t i,
                     const double* sums, const BoxGradients<T>& gradients) {
    const bool is_image = params.kernel == Kernel::bilinear || params.kernel == Kernel::nearest;
    double middle_u = 0, middle_v = 0;
    if (is_image) {
        const Level& level = params.levels[static_cast<std::size_t>(record.level)];
        middle_u = 0.5 * (level.columns - 1), middle_v = 0.5 * (level.rows - 1);
    }
    const auto value = [](T x) { return static_cast<double>(x); };
    const double du_dx = value(record.du_dx), du_dy = value(record.du_dy);
    const double dv_dx = value(record.dv_dx), dv_dy = value(record.dv_dy);
    const double u = value(record.offset_u) - middle_u, v = value(record.offset_v) - middle_v;  // at the anchor
    const double factor = is_image ? value(record.opacity) : 1.0;
    const double v_u = factor * sums[kU], v_v = factor * sums[kV];
    // Sums of the derivative by u (and by v) times u and v from the centre of the box.
    const double u_by_u = u * v_u + factor * (du_dx * sums[kUx] + du_dy * sums[kUy]);
    const double v_by_u = v * v_u + factor * (dv_dx * sums[kUx] + dv_dy * sums[kUy]);
    const double u_by_v = u * v_v + factor * (du_dx * sums[kVx] + du_dy * sums[kVy]);
    const double v_by_v = v * v_v + factor * (dv_dx * sums[kVx] + dv_dy * sums[kVy]);
    const double per_pixel_u = std::sqrt(du_dx * du_dx + du_dy * du_dy);
    const double per_pixel_v = std::sqrt(dv_dx * dv_dx + dv_dy * dv_dy);
    const double along = per_pixel_v > 0 ? per_pixel_u / per_pixel_v : 0;  // 0: an image of one texel
    const double across = per_pixel_u > 0 ? per_pixel_v / per_pixel_u : 0;

    gradients.centers[2 * i] = static_cast<T>(-(du_dx * v_u + dv_dx * v_v));
    gradients.centers[2 * i + 1] = static_cast<T>(-(du_dy * v_u + dv_dy * v_v));
    gradients.half_extents[2 * i] = static_cast<T>(-u_by_u / value(boxes.half_extents[2 * i]));
    gradients.half_extents[2 * i + 1] = static_cast<T>(-v_by_v / value(boxes.half_extents[2 * i + 1]));
    gradients.angles[i] = static_cast<T>(along * v_by_u - across * u_by_v);
    gradients.colors[3 * i] = static_cast<T>(sums[kRed]);
    gradients.colors[3 * i + 1] = static_cast<T>(sums[kGreen]);
    gradients.colors[3 * i + 2] = static_cast<T>(sums[kBlue]);
    gradients.opacities[i] = static_cast<T>(sums[kAlpha] / value(boxes.opacities[i]));
    for (int c = 0; c < gradients.layers.count; ++c) {
        const Channel<T> layer = gradients.layers.channels[c];
        layer.values[i * layer.stride] = static_cast<T>(sums[kLayers + c]);
    }
}

// Adds up what the tiles summed for box i, [num_sums(channels)], and turns it into gradients.
template <int channels, class T>
void gather_gradients(const RasterParams& params, const BoxView<T>& boxes, const Record<T>& record,
                      const BoxVisits& visits, std::size_t i, const T* sums, const BoxGradients<T>& gradients) {
    constexpr std::size_t width = num_sums(channels);
    double of_box[width] = {};
    for (std::uint32_t k = visits.starts[i]; k < visits.starts[i + 1]; ++k) {
        const T* of_tile = sums + width * visits.entries[k];
        for (std::size_t s = 0; s < width; ++s) of_box[s] += static_cast<double>(of_tile[s]);
    }
    write_gradients(params, boxes, record, i, of_box, gradients);
}

template <class T>
void write_zeros(std::size_t i, const BoxGradients<T>& gradients) {
    std::fill_n(&gradients.centers[2 * i], 2, T(0));
    std::fill_n(&gradients.half_extents[2 * i], 2, T(0));
    std::fill_n(&gradients.colors[3 * i], 3, T(0));
    gradients.angles[i] = gradients.opacities[i] = 0;
    for (int c = 0; c < gradients.layers.count; ++c)
        gradients.layers.channels[c].values[i * gradients.layers.channels[c].stride] = 0;
}

// Memory of the texel groups: for each group, the texels of all levels.
class TexelGroups {
public:
    TexelGroups(std::span<const Level> levels, std::size_t num_groups) {
        std::size_t total = 0;
        for (const Level& level : levels) {
            starts_.push_back(total);
            total += static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows);
        }
        starts_.push_back(total);
        values_.resize(num_groups * total);
        for (std::size_t group = 0; group < num_groups; ++group)
            for (std::size_t level = 0; level < levels.size(); ++level)
                pointers_.push_back(values_.data() + group * total + starts_[level]);
    }

    double* const* of_group(std::size_t group) const { return &pointers_[group * (starts_.size() - 1)]; }

    void add_to(std::span<double* const> texels, std::size_t num_groups) const {
        for (std::size_t group = 0; group < num_groups; ++group)
            for (std::size_t level = 0; level < texels.size(); ++level)
                for (std::size_t k = 0; k < starts_[level + 1] - starts_[level]; ++k)
                    texels[level][k] += of_group(group)[level][k];
    }

private:
    std::vector<std::size_t> starts_;  // of each level, and the end
    std::vector<double> values_;
    std::vector<double*> pointers_;
};

}  // namespace

template <class T>
void rasterize_backward(const RasterParams& params, const BoxView<T>& boxes, const PictureGradients<T>& picture,
                        const BoxGradients<T>& gradients, std::span<double* const> texels) {
    const BackwardKernels<T> kernels;
    thread_local Scratch<Record<T>> record_memory;
    Record<T>* const records = record_memory.take(boxes.count).data();
    BoxVisits visits;
    const TileLists tiles = make_tiles(params, kernels.make_records, boxes, records, &visits);
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    thread_local Scratch<T> sum_memory;
    const auto width = static_cast<std::size_t>(num_sums(picture.v_layers.count));
    T* const sums = sum_memory.take(width * tiles.starts.back()).data();
    const auto differentiate = [&](std::size_t tile, double* const* into) {
        const TileTask<T> task = task_of(params, boxes, records, tiles, tile);
        kernels.differentiate_tile(task, picture, sums + width * tiles.starts[tile], into);
    };
    if (texels.empty()) {
        parallel_for(num_tiles, params.num_threads, [&](std::size_t tile) { differentiate(tile, nullptr); });
    } else {
        const TexelGroups groups(params.levels, kTexelGroups);
        parallel_for(kTexelGroups, params.num_threads, [&](std::size_t group) {
            for (std::size_t tile = group; tile < num_tiles; tile += kTexelGroups)
                differentiate(tile, groups.of_group(group));
        });
        groups.add_to(texels, kTexelGroups);
    }
    const int num_threads = boxes.count < kParallelFrom ? 1 : params.num_threads;
    const std::size_t num_parts = num_threads > 1 ? static_cast<std::size_t>(4 * num_threads) : 1;
    with_channels(picture.v_layers.count, [&]<int channels>() {
        parallel_for(num_parts, num_threads, [&](std::size_t part) {
            for (std::size_t i = boxes.count * part / num_parts; i < boxes.count * (part + 1) / num_parts; ++i) {
                if (visits.starts[i] == visits.starts[i + 1])
                    write_zeros(i, gradients);
                else
                    gather_gradients<channels>(params, boxes, records[i], visits, i, sums, gradients);
            }
        });
    });
}

template void rasterize_backward<float>(const RasterParams&, const BoxView<float>&, const PictureGradients<float>&,
                                        const BoxGradients<float>&, std::span<double* const>);
template void rasterize_backward<double>(const RasterParams&, const BoxView<double>&, const PictureGradients<double>&,
                                         const BoxGradients<double>&, std::span<double* const>);

}  // namespace brushgs
