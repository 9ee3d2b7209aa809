// From samples to fragments: how they hide each other, and their lists. The loop is in fragments_kernel.cpp.
#include "brushgs/fragments.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "brushgs/blending.hpp"
#include "brushgs/cpu.hpp"
#include "brushgs/pixel_runs.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kTilePixels = kTileWidth * kTileHeight;

template <class T>
struct Fragment {
    std::int32_t row;
    bool is_underpaint;
    T weight, shade;
};

// Additional data of a fragment in soft order, see soft_order.hpp.
template <class T>
struct SoftFragment {
    T alpha, depth, squared_softness;
    T before;  // the light that passes all fragments in front of it in stroke order
    bool is_shown;
};

// Calls `work(block, pixel of the block, pixel of the tile, alpha, shade)` for each painted pixel of a record.
template <class T, class Work>
void for_painted(const RecordSink<T>& sink, const SampledRecord<T>& record, const Work& work) {
    for (std::uint32_t blocks = record.blocks; blocks != 0; blocks &= blocks - 1) {
        const auto b = static_cast<std::size_t>(std::countr_zero(blocks));
        for (std::size_t p = 0; p < 16; ++p) {
            const T alpha = record.alphas[b][p];
            if ((sink.alive[b] >> p & 1u) == 0 || !(alpha >= static_cast<T>(kMinAlpha))) continue;
            const std::size_t x = b % (kTileWidth / 4) * 4 + p % 4, y = b / (kTileWidth / 4) * 4 + p / 4;
            work(b, p, y * kTileWidth + x, alpha, record.shades == nullptr ? T(1) : record.shades[b][p]);
        }
    }
}

// The fragments of one tile, pixel by pixel. Kept by each thread from tile to tile.
template <class T>
class Blender : public RecordSink<T> {
public:
    std::span<const Fragment<T>> of_pixel(std::size_t pixel) const { return pixels_[pixel]; }

    void clear(T min_transmittance) {
        min_transmittance_ = min_transmittance;
        pixels_.resize(kTilePixels);
        for (auto& fragments : pixels_) fragments.clear();
        light_.assign(kTilePixels, 1);
    }

protected:
    void finish_pixel(std::size_t b, std::size_t p) {
        this->alive[b] = static_cast<std::uint16_t>(this->alive[b] & ~(1u << p));
        if (this->alive[b] == 0) this->alive_blocks &= ~(1u << b);
    }

    T min_transmittance_ = 0;
    std::vector<std::vector<Fragment<T>>> pixels_;
    std::vector<T> light_;  // behind all fragments so far
};

// Each stroke hides everything behind it.
template <class T>
class HardBlender final : public Blender<T> {
public:
    void add(const SampledRecord<T>& record) override {
        for_painted(*this, record, [&](std::size_t b, std::size_t p, std::size_t pixel, T alpha, T shade) {
            const T before = this->light_[pixel], weight = before * alpha, after = before - weight;
            if (!(after >= this->min_transmittance_)) return this->finish_pixel(b, p);
            this->light_[pixel] = after;
            this->pixels_[pixel].push_back({static_cast<std::int32_t>(record.id), record.is_underpaint, weight, shade});
        });
    }
};

// Strokes fade into each other where their depths are close.
template <class T>
class SoftBlender final : public Blender<T> {
public:
    void start(const TileTask<T>& task) {
        this->clear(static_cast<T>(task.params.min_transmittance));
        boxes_ = &task.boxes;
        soft_.resize(kTilePixels);
        for (auto& fragments : soft_) fragments.clear();
        waiting_.assign(kTilePixels, 0);
        is_shared_.assign(kTilePixels, false);
        // The largest squared softness of each stroke of the tile and all behind it, and 0 at the end.
        reaches_.assign(task.num_ids + 1, 0);
        for (std::size_t i = task.num_ids; i > 0; --i) {
            const T own = task.boxes.softness[task.ids[i - 1]];
            reaches_[i - 1] = std::max(reaches_[i], own * own);
        }
    }

    void add(const SampledRecord<T>& record) override {
        const std::size_t id = record.id;
        T depth = boxes_->depths[id], softness = boxes_->softness[id];
        if (record.is_underpaint) {  // has no softness of its own; see `underpaint_depth`
            const double behind = static_cast<double>(depth) + static_cast<double>(boxes_->underpaint.setbacks[id]);
            constexpr T largest = std::numeric_limits<T>::max();
            depth = behind < static_cast<double>(largest) ? static_cast<T>(behind) : largest;
            softness = 0;
        }
        const T squared = softness * softness, reach = reaches_[record.next_place];
        for_painted(*this, record, [&](std::size_t b, std::size_t p, std::size_t pixel, T alpha, T shade) {
            if (is_dark(pixel, depth, reach)) return this->finish_pixel(b, p);
            const Hidden hidden = hide(pixel, depth, squared, alpha);
            T& light = this->light_[pixel];
            const bool is_shown = hidden.in_front - hidden.in_front * alpha >= this->min_transmittance_;
            soft_[pixel].push_back({alpha, depth, squared, light, is_shown});
            this->pixels_[pixel].push_back({static_cast<std::int32_t>(record.id), record.is_underpaint,
                                            is_shown ? hidden.seen * alpha : 0, shade});
            light = light - light * alpha;
            if (light < static_cast<T>(kLeastLight)) this->finish_pixel(b, p);
        });
    }

    // Where fragments overlapped in depth, their weights are scaled to the alpha of the pixel; invisible ones are
    // dropped.
    void finish() {
        for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
            auto& fragments = this->pixels_[pixel];
            T sum = 0, transmittance = 1;
            for (std::size_t k = 0; k < fragments.size(); ++k) {
                sum += fragments[k].weight;
                if (fragments[k].weight > 0) transmittance -= transmittance * soft_[pixel][k].alpha;
            }
            if (is_shared_[pixel] && sum >= std::numeric_limits<T>::min())
                for (auto& fragment : fragments) fragment.weight *= (1 - transmittance) / sum;
            std::erase_if(fragments, [](const Fragment<T>& fragment) { return !(fragment.weight > 0); });
        }
    }

private:
    struct Hidden {
        T in_front, seen;  // light that passes what lies wholly in front, and that passes what is within reach as well
    };

    // Whether no fragment behind this depth is visible in a pixel, or hides a visible one.
    bool is_dark(std::size_t pixel, T depth, T reach) {
        const auto& fragments = soft_[pixel];
        std::size_t& first = waiting_[pixel];
        for (; first < fragments.size(); ++first) {
            const T gap = depth - fragments[first].depth;
            if (!(gap * gap >= fragments[first].squared_softness + reach)) break;
        }
        const T behind_final = first < fragments.size() ? fragments[first].before : this->light_[pixel];
        if (!(behind_final < this->min_transmittance_)) return false;
        const auto waiting = fragments.begin() + static_cast<std::ptrdiff_t>(first);
        return std::none_of(waiting, fragments.end(), [](const SoftFragment<T>& f) { return f.is_shown; });
    }

    // Updates how a new fragment and waiting ones hide each other.
    Hidden hide(std::size_t pixel, T depth, T squared, T alpha) {
        const auto& fragments = soft_[pixel];
        Hidden hidden{this->light_[pixel], this->light_[pixel]};
        bool has_met = false;
        for (std::size_t k = waiting_[pixel]; k < fragments.size(); ++k) {
            const SoftFragment<T>& other = fragments[k];
            const T gap = depth - other.depth, reach = other.squared_softness + squared;
            if (gap * gap >= reach) {
                if (!has_met) continue;
                hidden.in_front -= hidden.in_front * other.alpha;
                hidden.seen -= hidden.seen * other.alpha;
                continue;
            }
            if (!has_met) hidden = {other.before, other.before};
            has_met = true;
            const T x = std::min(gap / std::sqrt(reach), T(1));
            const T share = T(0.5) + x * (3 - x * x) * T(0.25);
            T& weight = this->pixels_[pixel][k].weight;
            weight -= weight * (alpha * (1 - share));
            hidden.seen -= hidden.seen * (other.alpha * share);
        }
        if (has_met) is_shared_[pixel] = true;
        return hidden;
    }

    const BoxView<T>* boxes_ = nullptr;
    std::vector<std::vector<SoftFragment<T>>> soft_;  // of each pixel as many as fragments
    std::vector<std::size_t> waiting_;                // the first that later ones may still change
    std::vector<bool> is_shared_;                     // whether two have met within their softness
    std::vector<T> reaches_;
};

// The fragments of a tile, pixel after pixel.
template <class T>
using TileFragments = std::vector<Fragment<T>>;

template <class T>
void paint_fragments(const TileTask<T>& task, const Blender<T>& blender, int first_row, std::int64_t* counts,
                     TileFragments<T>& found) {
    const int num_columns = std::min(kTileWidth, task.params.width - task.x0);
    const int num_rows = std::min(kTileHeight, task.params.height - task.y0);
    for (int y = 0; y < num_rows; ++y)
        for (int x = 0; x < num_columns; ++x) {
            const auto own = blender.of_pixel(static_cast<std::size_t>(y * kTileWidth + x));
            const auto row = static_cast<std::size_t>(task.y0 - first_row + y);
            const std::size_t pixel =
                row * static_cast<std::size_t>(task.params.width) + static_cast<std::size_t>(task.x0 + x);
            counts[pixel] = static_cast<std::int64_t>(own.size());
            found.insert(found.end(), own.begin(), own.end());
        }
}

template <class T>
Fragments<T> laid_out(const RasterParams& params, const TileLists& tiles, std::size_t first_tile,
                      const std::vector<TileFragments<T>>& found, Buffer<std::int64_t> starts, std::size_t num_pixels) {
    const std::size_t count = starts_of_counts(starts.get(), num_pixels);
    Fragments<T> all{std::move(starts),
                     make_buffer<std::int32_t>(count),
                     make_buffer<T>(count),
                     make_buffer<T>(count),
                     make_buffer<std::uint8_t>(count),
                     num_pixels,
                     count};
    parallel_for(found.size(), params.num_threads, [&](std::size_t item) {
        const std::size_t tile = first_tile + item, columns = static_cast<std::size_t>(tiles.columns);
        const std::size_t x0 = tile % columns * kTileWidth, y0 = item / columns * kTileHeight;
        const std::size_t width = static_cast<std::size_t>(params.width), height = num_pixels / width;
        const Fragment<T>* next = found[item].data();
        for (std::size_t y = y0; y < std::min(y0 + kTileHeight, height); ++y) {
            const std::size_t row = y * width;
            const auto first = static_cast<std::size_t>(all.starts[row + x0]);
            const auto end = static_cast<std::size_t>(all.starts[row + std::min(x0 + kTileWidth, width)]);
            for (std::size_t i = first; i < end; ++i, ++next) {
                all.rows[i] = next->row;
                all.weights[i] = next->weight;
                all.shades[i] = next->shade;
                all.is_underpaint[i] = next->is_underpaint;
            }
        }
    });
    return all;
}

}  // namespace

template <class T>
Fragments<T> find_fragments(const RasterParams& params, const BoxView<T>& boxes) {
    const auto make_records = BRUSHGS_KERNEL(make_records, T);
    const auto sample_tile = BRUSHGS_KERNEL(sample_tile, T);
    const auto records = std::make_unique_for_overwrite<Record<T>[]>(num_records(boxes));
    const TileLists tiles = make_tiles(params, make_records, boxes, records.get());
    const auto columns = static_cast<std::size_t>(tiles.columns);
    const int end_row = std::min(params.end_row, params.height);
    const std::size_t first_tile = static_cast<std::size_t>(params.first_row / kTileHeight) * columns;
    const std::size_t num_tile_rows = static_cast<std::size_t>((end_row - params.first_row - 1) / kTileHeight + 1);
    const std::size_t num_pixels =
        static_cast<std::size_t>(end_row - params.first_row) * static_cast<std::size_t>(params.width);
    Buffer<std::int64_t> counts = make_buffer<std::int64_t>(num_pixels + 1);
    std::vector<TileFragments<T>> found(num_tile_rows * columns);
    parallel_for(found.size(), params.num_threads, [&](std::size_t item) {
        const TileTask<T> task = task_of(params, boxes, records.get(), tiles, first_tile + item);
        if (boxes.softness == nullptr) {
            thread_local HardBlender<T> blender;
            blender.clear(static_cast<T>(params.min_transmittance));
            sample_tile(task, blender);
            paint_fragments<T>(task, blender, params.first_row, counts.get(), found[item]);
        } else {
            thread_local SoftBlender<T> blender;
            blender.start(task);
            sample_tile(task, blender);
            blender.finish();
            paint_fragments<T>(task, blender, params.first_row, counts.get(), found[item]);
        }
    });
    return laid_out(params, tiles, first_tile, found, std::move(counts), num_pixels);
}

template Fragments<float> find_fragments<float>(const RasterParams&, const BoxView<float>&);
template Fragments<double> find_fragments<double>(const RasterParams&, const BoxView<double>&);

}  // namespace brushgs
