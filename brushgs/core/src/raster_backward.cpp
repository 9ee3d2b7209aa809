// The order of work of the rasterizer's derivative: records and tile lists of painting, tiles, boxes.
#include "brushgs/raster_backward.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "brushgs/box_sums.hpp"
#include "brushgs/memory.hpp"
#include "brushgs/tiles.hpp"
#include "brushgs/trace.hpp"

namespace brushgs {

namespace {

// Number of groups in which tiles add to texels, each with its own memory, so that sums do not depend on the threads.
constexpr std::size_t kTexelGroups = 8;

template <class T>
struct BackwardKernels {
    decltype(&baseline::make_records<T>) make_records = BRUSHGS_KERNEL(make_records, T);
    decltype(&baseline::differentiate_tile<T>) differentiate_tile = BRUSHGS_KERNEL(differentiate_tile, T);
};

// The gradients by one box.
struct RowGradients {
    double center[2], half_extents[2], angle, color[3], opacity, layers[kMostChannels];

    RowGradients& operator+=(const RowGradients& other) {
        for (std::size_t k = 0; k < 2; ++k) center[k] += other.center[k];
        for (std::size_t k = 0; k < 2; ++k) half_extents[k] += other.half_extents[k];
        angle += other.angle;
        for (std::size_t k = 0; k < 3; ++k) color[k] += other.color[k];
        opacity += other.opacity;
        for (std::size_t k = 0; k < kMostChannels; ++k) layers[k] += other.layers[k];
        return *this;
    }
};

// The gradients by box i from one of its records, given the sums of the tiles. Half extents and opacity of underpaint
// are multiples of those of the box, so they change in proportion.
template <class T>
RowGradients gradients_of(const RasterParams& params, const BoxView<T>& boxes, const Record<T>& record, bool is_image,
                          std::size_t i, const double* sums, int channels) {
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
    // Sums of the derivative by u (and by v) times u and v from the center of the box.
    const double u_by_u = u * v_u + factor * (du_dx * sums[kUx] + du_dy * sums[kUy]);
    const double v_by_u = v * v_u + factor * (dv_dx * sums[kUx] + dv_dy * sums[kUy]);
    const double u_by_v = u * v_v + factor * (du_dx * sums[kVx] + du_dy * sums[kVy]);
    const double v_by_v = v * v_v + factor * (dv_dx * sums[kVx] + dv_dy * sums[kVy]);
    const double per_pixel_u = std::sqrt(du_dx * du_dx + du_dy * du_dy);
    const double per_pixel_v = std::sqrt(dv_dx * dv_dx + dv_dy * dv_dy);
    const double along = per_pixel_v > 0 ? per_pixel_u / per_pixel_v : 0;  // 0: an image of one texel
    const double across = per_pixel_u > 0 ? per_pixel_v / per_pixel_u : 0;

    RowGradients row{};
    row.center[0] = -(du_dx * v_u + dv_dx * v_v);
    row.center[1] = -(du_dy * v_u + dv_dy * v_v);
    row.half_extents[0] = -u_by_u / value(boxes.half_extents[2 * i]);
    row.half_extents[1] = -v_by_v / value(boxes.half_extents[2 * i + 1]);
    if (boxes.streaks.noise != nullptr) row.half_extents[1] += sums[kLayers + channels];
    row.angle = along * v_by_u - across * u_by_v;
    for (std::size_t k = 0; k < 3; ++k) row.color[k] = sums[kRed + k];
    row.opacity = sums[kAlpha] / value(boxes.opacities[i]);
    for (int c = 0; c < channels; ++c) row.layers[c] = sums[kLayers + c];
    return row;
}

template <class T>
void write_gradients(const RowGradients& row, std::size_t i, const BoxGradients<T>& gradients) {
    for (std::size_t k = 0; k < 2; ++k) gradients.centers[2 * i + k] = static_cast<T>(row.center[k]);
    for (std::size_t k = 0; k < 2; ++k) gradients.half_extents[2 * i + k] = static_cast<T>(row.half_extents[k]);
    gradients.angles[i] = static_cast<T>(row.angle);
    for (std::size_t k = 0; k < 3; ++k) gradients.colors[3 * i + k] = static_cast<T>(row.color[k]);
    gradients.opacities[i] = static_cast<T>(row.opacity);
    for (int c = 0; c < gradients.layers.count; ++c) {
        const Channel<T> layer = gradients.layers.channels[c];
        layer.values[i * layer.stride] = static_cast<T>(row.layers[c]);
    }
}

// Adds up the sums of the tiles for box i and turns them into gradients.
template <int channels, class T>
void gather_gradients(const RasterParams& params, const BoxView<T>& boxes, const Record<T>* records,
                      const BoxVisits& visits, std::size_t i, const TileSums<T>& sums,
                      const BoxGradients<T>& gradients) {
    const bool is_image = params.kernel == Kernel::bilinear || params.kernel == Kernel::nearest;
    RowGradients row{};  // zeros of a stroke that is not seen
    if (const BoxSums<num_sums(channels), T> strokes(visits, i, sums.strokes); strokes.is_seen)
        row = gradients_of(params, boxes, records[i], is_image, i, strokes.values, channels);
    if (sums.underpaints.values != nullptr) {
        const BoxSums<num_sums(channels), T> underpaints(visits, i, sums.underpaints);
        if (underpaints.is_seen)
            row += gradients_of(params, boxes, records[boxes.count + i], false, i, underpaints.values, channels);
    }
    write_gradients(row, i, gradients);
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
void rasterize_backward(const RasterParams& params, const BoxView<T>& boxes, const Trace<T>* trace,
                        const PictureGradients<T>& picture, const BoxGradients<T>& gradients,
                        std::span<double* const> texels) {
    const BackwardKernels<T> kernels;
    Trace<T> found;
    if (trace == nullptr) {
        thread_local Scratch<Record<T>> record_memory;
        Record<T>* const own = record_memory.take(num_records(boxes)).data();
        found.tiles = make_tiles(params, kernels.make_records, boxes, own, &found.visits);
        found.records = own;
        trace = &found;
    }
    const Record<T>* const records = trace->records;
    const TileLists& tiles = trace->tiles;
    const BoxVisits& visits = trace->visits;
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    thread_local Scratch<T> sum_memory;
    thread_local Scratch<bool> seen_memory;
    const auto width = static_cast<std::size_t>(num_sums(picture.v_layers.count));
    const bool has_underpaint = boxes.underpaint.setbacks != nullptr;
    const std::size_t num_entries = tiles.starts.back(), num_layers = has_underpaint ? 2 : 1;
    T* const values = sum_memory.take(num_layers * width * num_entries).data();
    bool* const is_seen = seen_memory.take(num_layers * num_entries).data();
    TileSums<T> sums{{values, is_seen}, {nullptr, nullptr}};
    if (has_underpaint) sums.underpaints = {values + width * num_entries, is_seen + num_entries};
    const auto from = [&](const RecordSums<T>& all, std::size_t entry) {
        return all.values == nullptr ? all : RecordSums<T>{all.values + width * entry, all.is_seen + entry};
    };
    const auto differentiate = [&](std::size_t tile, double* const* into) {
        TileTask<T> task = task_of(params, boxes, records, tiles, tile);
        task.painted = trace->painted(tile, has_underpaint);
        const std::size_t first = tiles.starts[tile];
        kernels.differentiate_tile(task, picture, {from(sums.strokes, first), from(sums.underpaints, first)}, into);
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
    with_channels(picture.v_layers.count, [&]<int channels>() {
        for_boxes(boxes.count, params.num_threads, [&](std::size_t i) {
            if (visits.starts[i] == visits.starts[i + 1])
                write_zeros(i, gradients);
            else
                gather_gradients<channels>(params, boxes, records, visits, i, sums, gradients);
        });
    });
}

template void rasterize_backward<float>(const RasterParams&, const BoxView<float>&, const Trace<float>*,
                                        const PictureGradients<float>&, const BoxGradients<float>&,
                                        std::span<double* const>);
template void rasterize_backward<double>(const RasterParams&, const BoxView<double>&, const Trace<double>*,
                                         const PictureGradients<double>&, const BoxGradients<double>&,
                                         std::span<double* const>);

}  // namespace brushgs
