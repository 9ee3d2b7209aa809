// The order of work of the rasterizer: records, tile lists, tiles. The loops are in raster_kernel.cpp.
#include "brushgs/raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "brushgs/cpu.hpp"
#include "brushgs/soft_queues.hpp"
#include "brushgs/tiles.hpp"
#include "brushgs/trace.hpp"

namespace brushgs {

namespace {

// The best number of threads for an amount of work: they are started one after another, 20 us each, so n threads take
// work / n + n x 20 us, which is least at n = root(work / 20 us). On two processors a picture of 64 x 64 pixels and 250
// strokes, 50 us of work, takes 10 % less in one thread than in two; eight threads take three times as long.
constexpr double kThreadCost = 20;                   // us
constexpr double kTileCost = 0.4, kVisitCost = 0.1;  // us: a tile, and a stroke in it, at least

int useful_threads(double microseconds, int most) {
    if (most < 0) return -most;  // a benchmark asks what they cost
    return std::clamp(static_cast<int>(std::sqrt(microseconds / kThreadCost)), 1, std::max(most, 1));
}

template <class T>
struct Kernels {
    decltype(&baseline::make_records<T>) make_records = BRUSHGS_KERNEL(make_records, T);
    decltype(&baseline::paint_tile<T>) paint_tile = BRUSHGS_KERNEL(paint_tile, T);
    decltype(&baseline::paint_tile_softly<T>) paint_tile_softly = BRUSHGS_KERNEL(paint_tile_softly, T);
    decltype(&baseline::glaze_tile<T>) glaze_tile = BRUSHGS_KERNEL(glaze_tile, T);
};

}  // namespace

template <class T>
LevelChoice choose_levels(std::size_t count, const T* half_extents, std::span<const double> bounds_u,
                          std::span<const double> bounds_v) {
    const auto level = [](std::span<const double> bounds, T half_extent) {
        std::size_t k = 0;  // halving without branches: where to stop is beyond prediction
        std::size_t length = bounds.size();
        for (; length > 1; length -= length / 2)
            k += static_cast<double>(half_extent) <= bounds[k + length / 2 - 1] ? length / 2 : 0;
        return length == 1 ? k + (static_cast<double>(half_extent) <= bounds[k]) : k;
    };
    LevelChoice choice;
    choice.of_box.resize(count);
    std::vector<std::uint16_t> row_of_code((bounds_u.size() + 1) * (bounds_v.size() + 1), 0);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t code =
            level(bounds_u, half_extents[2 * i]) * (bounds_v.size() + 1) + level(bounds_v, half_extents[2 * i + 1]);
        choice.of_box[i] = static_cast<std::uint16_t>(code);
        row_of_code[code] = 1;
    }
    for (std::size_t code = 0; code < row_of_code.size(); ++code) {
        if (row_of_code[code] == 0) continue;
        row_of_code[code] = static_cast<std::uint16_t>(choice.used.size());
        choice.used.push_back(static_cast<std::uint16_t>(code));
    }
    for (std::uint16_t& code : choice.of_box) code = row_of_code[code];
    return choice;
}

namespace {

// Adjacent tiles that a thread takes at a time. With single tiles, threads would write to adjacent lines of memory: on
// two processors a picture of 250 strokes takes 12 % longer, one of 7000 5 %.
constexpr std::size_t kRunOfTiles = 5;

template <class T>
void paint_one(const Kernels<T>& kernels, const TileTask<T>& task, const Picture<T>& picture) {
    if (task.params.blend == Blend::glaze) return kernels.glaze_tile(task, picture);
    if (task.boxes.softness == nullptr) return kernels.paint_tile(task, picture);
    thread_local SoftQueues<T> queues;
    const bool has_relief = picture.height != nullptr;
    const BoxView<T>& boxes = task.boxes;
    const bool has_layers = has_relief || boxes.streaks.noise != nullptr || boxes.underpaint.setbacks != nullptr;
    keep_shades(queues, task.params.has_tints ? 3 : (has_layers ? 1 : 0));
    keep_heights(queues, has_relief);
    kernels.paint_tile_softly(task, queues, picture);
}

// Paints the rows of pixels in `params`. `trace` may be null.
template <class T>
void paint_strip(const RasterParams& params, const BoxView<T>& boxes, const Picture<T>& picture, Trace<T>* trace) {
    const Kernels<T> kernels;
    Trace<T> own;
    Trace<T>& made = trace == nullptr ? own : *trace;
    made.memory = make_buffer<Record<T>>(num_records(boxes));
    Record<T>* const records = made.memory.get();
    made.records = records;
    made.tiles = make_tiles(params, kernels.make_records, boxes, records, trace == nullptr ? nullptr : &made.visits);
    const TileLists& tiles = made.tiles;
    const bool has_underpaint = boxes.underpaint.setbacks != nullptr;
    if (trace != nullptr) made.blocks = make_buffer<std::uint32_t>((has_underpaint ? 2 : 1) * tiles.starts.back());
    const auto columns = static_cast<std::size_t>(tiles.columns);
    const std::size_t first_tile = static_cast<std::size_t>(params.first_row / kTileHeight) * columns;
    const int end_row = (params.end_row + kTileHeight - 1) / kTileHeight;
    const std::size_t end_tile = static_cast<std::size_t>(end_row) * columns;
    const std::size_t num_tiles = end_tile - first_tile;
    const double visits = tiles.starts[end_tile] - tiles.starts[first_tile];
    const double work = kTileCost * static_cast<double>(num_tiles) + kVisitCost * visits;
    const std::size_t num_runs = (num_tiles + kRunOfTiles - 1) / kRunOfTiles;
    const auto first_column = static_cast<std::size_t>(params.left / kTileWidth);
    const auto end_column = static_cast<std::size_t>((params.right() + kTileWidth - 1) / kTileWidth);
    parallel_for(num_runs, useful_threads(work, params.num_threads), [&](std::size_t run) {
        const std::size_t first = first_tile + run * kRunOfTiles;
        for (std::size_t tile = first; tile < std::min(first + kRunOfTiles, end_tile); ++tile) {
            if (tile % columns < first_column || tile % columns >= end_column) continue;
            TileTask<T> task = task_of(params, boxes, records, tiles, tile);
            task.painted = made.painted(tile, has_underpaint);
            for (std::uint32_t* const blocks : {task.painted.strokes, task.painted.underpaints})
                if (blocks != nullptr) std::fill_n(blocks, task.num_ids, 0u);
            paint_one(kernels, task, picture);
        }
    });
}

// Maximum number of entries of tile lists at a time: some 12 bytes each during construction.
constexpr double kMostVisits = 1 << 26;

// Half-open range of rows of pixels, whole tiles except at the end of the picture.
struct Strip {
    int first_row, end_row;
};

// The strips of the part to paint one after the other, so that tile lists stay small in memory even for very many
// very large boxes. An upper bound is counted: a box reaches no further than the sum of its half extents.
template <class T>
std::vector<Strip> strips_of(const RasterParams& params, const BoxView<T>& boxes) {
    const int columns = (params.right() - params.left + kTileWidth - 1) / kTileWidth;
    const int rows = (params.bottom() - params.top + kTileHeight - 1) / kTileHeight;
    const double most_visits = static_cast<double>(boxes.count) * columns * rows;
    const double larger = std::max(boxes.underpaint.reach, 1.0);
    double visits = 0;
    for (std::size_t i = 0; i < boxes.count && most_visits > kMostVisits; ++i) {
        const double half_u = static_cast<double>(boxes.half_extents[2 * i]);
        const double reach = larger * (half_u + static_cast<double>(boxes.half_extents[2 * i + 1]));
        const auto tiles = [&](T center, int first, int end, int tile) {
            const double c = static_cast<double>(center);
            return 1 + std::max(std::min(c + reach, 1.0 * end) - std::max(c - reach, 1.0 * first), 0.0) / tile;
        };
        visits += tiles(boxes.centers[2 * i], params.left, params.right(), kTileWidth) *
                  tiles(boxes.centers[2 * i + 1], params.top, params.bottom(), kTileHeight);
    }
    const int num_strips = static_cast<int>(std::min(std::floor(visits / kMostVisits) + 1, 1.0 * rows));
    std::vector<Strip> strips;
    for (int strip = 0; strip < num_strips; ++strip) {
        const int first = rows * strip / num_strips, end = rows * (strip + 1) / num_strips;
        strips.push_back({params.top + first * kTileHeight, std::min(params.top + end * kTileHeight, params.bottom())});
    }
    return strips;
}

}  // namespace

template <class T>
void rasterize(const RasterParams& whole, const BoxView<T>& boxes, const Picture<T>& picture, Trace<T>* trace) {
    // A trace keeps all lists.
    const auto strips = trace == nullptr ? strips_of(whole, boxes) : std::vector<Strip>{{0, whole.height}};
    for (const Strip& strip : strips) {
        RasterParams params = whole;
        params.first_row = strip.first_row;
        params.end_row = strip.end_row;
        paint_strip(params, boxes, picture, trace);
    }
}

template LevelChoice choose_levels<float>(std::size_t, const float*, std::span<const double>, std::span<const double>);
template void rasterize<float>(const RasterParams&, const BoxView<float>&, const Picture<float>&, Trace<float>*);
#ifndef BRUSHGS_ALONE
template LevelChoice choose_levels<double>(std::size_t, const double*, std::span<const double>,
                                           std::span<const double>);
template void rasterize<double>(const RasterParams&, const BoxView<double>&, const Picture<double>&, Trace<double>*);
#endif

}  // namespace brushgs
