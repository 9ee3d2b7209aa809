// The order of work of the rasteriser: records, tile lists, tiles. The loops are in raster_kernel.cpp.
#include "brushgs/raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <tuple>
#include <utility>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

// Below this many boxes a second thread costs more than it saves in the stages before painting.
constexpr std::size_t kParallelFrom = 4000;

// Threads that pay for so much work: they are started one after another, 20 us each, so n of them are done after
// work / n + n x 20 us, which is least at n = root(work / 20 us). On two processors a picture of 64 x 64 pixels
// and 250 strokes, 50 us of work, takes 10 % less in one thread than in two; eight threads take three times as long.
constexpr double kThreadCost = 20;                     // us
constexpr double kTileCost = 0.4, kVisitCost = 0.1;  // us: a tile, and a stroke in it, at least

int useful_threads(double microseconds, int most) {
    if (most < 0) return -most;  // a benchmark asks what they cost
    return std::clamp(static_cast<int>(std::sqrt(microseconds / kThreadCost)), 1, std::max(most, 1));
}

template <class T>
struct Kernels {
    decltype(&baseline::make_records<T>) make_records = &baseline::make_records<T>;
    decltype(&baseline::paint_tile<T>) paint_tile = &baseline::paint_tile<T>;
    decltype(&baseline::paint_tile_softly<T>) paint_tile_softly = &baseline::paint_tile_softly<T>;

    Kernels() {
#ifdef BRUSHGS_X86
        if (best_isa() == Isa::avx512) {
            make_records = &avx512::make_records<T>;
            paint_tile = &avx512::paint_tile<T>;
            paint_tile_softly = &avx512::paint_tile_softly<T>;
        } else if (best_isa() == Isa::avx2) {
            make_records = &avx2::make_records<T>;
            paint_tile = &avx2::paint_tile<T>;
            paint_tile_softly = &avx2::paint_tile_softly<T>;
        }
#endif
    }
};

// What the sides of a box are moved outwards before the question which tiles it reaches, in pixels: painting
// decides, this must only never leave out a tile. The outline is as exact as a float.
inline double slack_of(const Outline& o) {
    // In double: of boxes as large as a float can say, the sum would be infinite.
    const double size = std::fabs(static_cast<double>(o.center_x)) + std::fabs(static_cast<double>(o.center_y)) +
                        static_cast<double>(o.reach_u) + static_cast<double>(o.reach_v);
    return 1e-2 + 1e-6 * size;
}

// The right and left ends of a box within a row of tiles.
class RowSpans {
public:
    explicit RowSpans(const Outline& o)
        : cos_(o.cos), sin_(o.sin), center_x_(o.center_x), center_y_(o.center_y), reach_u_(o.reach_u + slack_of(o)),
          reach_v_(o.reach_v + slack_of(o)), slope_sign_(o.sin * o.cos < 0 ? -1.0 : 1.0),
          per_cos_(1 / std::fabs(cos_)), per_sin_(1 / std::fabs(sin_)),
          reach_y_(std::fabs(sin_) * reach_u_ + std::fabs(cos_) * reach_v_),
          corner_y_((cos_ < 0 ? -sin_ : sin_) * reach_u_ - (sin_ < 0 ? -cos_ : cos_) * reach_v_) {}

    // Ends of the box on the rows of pixels with centres `top` to `bottom`; false where it does not reach them.
    // The box is convex: it extends furthest right on the row nearest to its rightmost corner.
    bool find(double top, double bottom, double& left, double& right) const {
        const double low = std::max(top - center_y_, -reach_y_), high = std::min(bottom - center_y_, reach_y_);
        if (low > high) return false;
        right = center_x_ + right_at(std::min(std::max(corner_y_, low), high));
        left = center_x_ - right_at(-std::min(std::max(-corner_y_, low), high));
        return true;
    }

private:
    // Sides that lie along the rows but for this slope end no row: dividing by it would magnify rounding.
    static constexpr double level_slope = 1e-6;

    // Largest x - center_x inside the box on the line y = center_y + dy.
    double right_at(double dy) const {
        const double by_u = (reach_u_ - slope_sign_ * std::fabs(sin_) * dy) * per_cos_;
        const double by_v = (reach_v_ + slope_sign_ * std::fabs(cos_) * dy) * per_sin_;
        if (std::fabs(sin_) < level_slope) return by_u;
        if (std::fabs(cos_) < level_slope) return by_v;
        return std::min(by_u, by_v);
    }

    double cos_, sin_, center_x_, center_y_, reach_u_, reach_v_, slope_sign_, per_cos_, per_sin_, reach_y_, corner_y_;
};

// The tiles that a run of boxes reaches, in stroke order.
struct Chunk {
    std::size_t begin, end;                 // boxes
    std::vector<std::uint32_t> visits;      // tiles, those of one box after those of another; some room behind
    std::size_t count = 0;                  // of `visits`
    std::vector<std::uint32_t> num_visits;  // of each box
    std::vector<std::uint32_t> places;      // per tile: first how many visits, then where the next id belongs

    void make_room(std::size_t more) {
        if (visits.size() < count + more) visits.resize(2 * (count + more));
    }
    // Without a branch. Needs room for one more, whether it counts or not.
    void visit(int tile, bool counts) {
        visits[count] = static_cast<std::uint32_t>(tile);
        count += counts;
        places[static_cast<std::size_t>(tile)] += counts;
    }
};

// Rows and columns of tiles, both ends included.
struct TileRange {
    int first_column, last_column, first_row, last_row;
};

// The columns of tiles, within the range, that the box may reach in one row of tiles; none: first > last.
inline std::pair<int, int> reached_columns(const RowSpans& spans, int row, const TileRange& range) {
    double left, right;
    if (!spans.find(row * kTileHeight + 0.5, (row + 1) * kTileHeight - 0.5, left, right)) return {1, 0};
    const int from = static_cast<int>(std::max(left + 0.5, 0.0) * (1.0 / kTileWidth));
    const int to = static_cast<int>(std::min(std::max(right - 0.5, -1.0 * kTileWidth), 1e5) * (1.0 / kTileWidth));
    return {std::max(from, range.first_column), std::min(to, range.last_column)};
}

// Two by two tiles. The box meets all four, or one of its sides passes between it and the point where they meet;
// then it leaves out the tile that this side faces. Which that is, no branch could predict.
inline void visit_four(const TileRange& range, const Outline& o, int columns, Chunk& chunk) {
    const float dx = static_cast<float>(range.last_column * kTileWidth) - o.center_x;
    const float dy = static_cast<float>(range.last_row * kTileHeight) - o.center_y;
    const float nearest = 0.5f * (std::fabs(o.cos) + std::fabs(o.sin));  // pixel centre to the point they share
    const float to_center = nearest - static_cast<float>(slack_of(o));
    const float u = o.cos * dx + o.sin * dy, v = o.cos * dy - o.sin * dx;
    const bool beyond_u = std::fabs(u) + to_center > o.reach_u, beyond_v = std::fabs(v) + to_center > o.reach_v;
    const int facing_u = ((u < 0) != (o.cos < 0) ? 0 : 1) + ((u < 0) != (o.sin < 0) ? 0 : 2);
    const int facing_v = ((v < 0) != (-o.sin < 0) ? 0 : 1) + ((v < 0) != (o.cos < 0) ? 0 : 2);
    const int left_out = (beyond_u ? 1 << facing_u : 0) | (beyond_v ? 1 << facing_v : 0);
    const int first = range.first_row * columns + range.first_column;
    chunk.make_room(4);
    chunk.visit(first, (left_out & 1) == 0);
    chunk.visit(first + 1, (left_out & 2) == 0);
    chunk.visit(first + columns, (left_out & 4) == 0);
    chunk.visit(first + columns + 1, (left_out & 8) == 0);
}

// Visits the tiles whose pixel centres may lie inside the record's box, row by row.
template <class T>
void visit_tiles(const Record<T>& r, const Outline& outline, int columns, Chunk& chunk) {
    if (r.right < r.left) return;
    const TileRange range{r.left / kTileWidth, r.right / kTileWidth, r.top / kTileHeight, r.bottom / kTileHeight};
    const int num_columns = range.last_column - range.first_column + 1;
    const int num_rows = range.last_row - range.first_row + 1;
    if (num_columns * num_rows <= 2) {  // most strokes are small; whether it is one tile or two is beyond prediction
        const int first = range.first_row * columns + range.first_column;
        const int last = range.last_row * columns + range.last_column;
        chunk.make_room(2);
        chunk.visit(first, true);
        chunk.visit(last, first != last);
        return;
    }
    if (num_columns == 2 && num_rows == 2) {
        visit_four(range, outline, columns, chunk);
        return;
    }
    const bool is_strip = num_rows == 1 || num_columns == 1;  // its bounds are exact
    const RowSpans spans(outline);
    for (int row = range.first_row; row <= range.last_row; ++row) {
        auto [from, to] = std::pair(range.first_column, range.last_column);
        if (!is_strip) std::tie(from, to) = reached_columns(spans, row, range);
        if (from > to) continue;
        chunk.make_room(static_cast<std::size_t>(to - from + 1));
        for (int column = from; column <= to; ++column) chunk.visit(row * columns + column, true);
    }
}

// Records for all boxes, and for every tile the records that reach it. Chunks of boxes are counted apart and
// laid end to end within each tile, so a list is in stroke order however many threads there are.
template <class T>
TileLists make_tiles(const RasterParams& params, const Kernels<T>& kernels, const BoxView<T>& boxes,
                     Record<T>* records) {
    TileLists tiles;
    tiles.columns = (params.width + kTileWidth - 1) / kTileWidth;
    tiles.rows = (params.height + kTileHeight - 1) / kTileHeight;
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    const int num_threads = boxes.count < kParallelFrom ? 1 : std::abs(params.num_threads);
    std::vector<Chunk> chunks(num_threads > 1 ? static_cast<std::size_t>(4 * num_threads) : 1);

    parallel_for(chunks.size(), num_threads, [&](std::size_t c) {
        Chunk& chunk = chunks[c];
        chunk.begin = boxes.count * c / chunks.size();
        chunk.end = boxes.count * (c + 1) / chunks.size();
        const std::size_t count = chunk.end - chunk.begin;
        const auto outlines = std::make_unique_for_overwrite<Outline[]>(count);
        kernels.make_records(params, boxes, chunk.begin, chunk.end, records, outlines.get());
        chunk.places.assign(num_tiles, 0);
        chunk.num_visits.resize(count);
        chunk.make_room(2 * count);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t before = chunk.count;
            visit_tiles(records[chunk.begin + i], outlines[i], tiles.columns, chunk);
            chunk.num_visits[i] = static_cast<std::uint32_t>(chunk.count - before);
        }
    });
    tiles.starts.resize(num_tiles + 1);
    std::size_t num_visits = 0;
    for (const Chunk& chunk : chunks) num_visits += chunk.visits.size();
    if (num_visits > std::numeric_limits<std::uint32_t>::max()) throw std::bad_alloc();  // 16 GB of list entries
    std::uint32_t total = 0;
    for (std::size_t tile = 0; tile < num_tiles; ++tile) {
        tiles.starts[tile] = total;
        for (Chunk& chunk : chunks) total += std::exchange(chunk.places[tile], total);
    }
    tiles.starts[num_tiles] = total;
    tiles.ids = std::make_unique_for_overwrite<std::uint32_t[]>(total);
    parallel_for(chunks.size(), num_threads, [&](std::size_t c) {
        Chunk& chunk = chunks[c];
        const std::uint32_t* tile = chunk.visits.data();
        for (std::size_t i = chunk.begin; i < chunk.end; ++i)
            for (std::uint32_t k = chunk.num_visits[i - chunk.begin]; k > 0; --k, ++tile)
                tiles.ids[chunk.places[*tile]++] = static_cast<std::uint32_t>(i);
    });
    return tiles;
}

}  // namespace

template <class T>
void add_slots(Pending<T>& pending) {
    const std::size_t before = pending.num_slots, after = before == 0 ? 256 : 2 * before;
    auto slots = std::make_unique_for_overwrite<PendingSlot<T>[]>(after);
    auto free_slots = std::make_unique_for_overwrite<std::uint32_t[]>(after);
    std::copy_n(pending.slots, before, slots.get());
    std::copy_n(pending.free_slots, pending.num_free, free_slots.get());
    for (std::size_t slot = after; slot > before; --slot)
        free_slots[pending.num_free++] = static_cast<std::uint32_t>(slot - 1);
    pending.slot_memory = std::move(slots);
    pending.free_memory = std::move(free_slots);
    pending.slots = pending.slot_memory.get();
    pending.free_slots = pending.free_memory.get();
    pending.num_slots = after;
}

template <class T>
void lengthen_queues(Pending<T>& pending) {
    const std::size_t before = pending.queue_size, after = before == 0 ? 16 : 2 * before;
    const std::size_t count = Pending<T>::num_queues * after;
    auto entries = std::make_unique_for_overwrite<PendingEntry[]>(count);
    auto depths = std::make_unique<T[]>(count + Pending<T>::room_behind);
    auto bands = std::make_unique<T[]>(count + Pending<T>::room_behind);
    for (std::size_t b = 0; b < Pending<T>::num_queues; ++b) {
        const std::size_t from = b * before + pending.heads[b], to = b * after + pending.heads[b];
        const std::size_t length = pending.tails[b] - pending.heads[b];
        std::copy_n(pending.entries + from, length, entries.get() + to);
        std::copy_n(pending.depths + from, length, depths.get() + to);
        std::copy_n(pending.squared_bands + from, length, bands.get() + to);
    }
    pending.entry_memory = std::move(entries);
    pending.depth_memory = std::move(depths);
    pending.band_memory = std::move(bands);
    pending.entries = pending.entry_memory.get();
    pending.depths = pending.depth_memory.get();
    pending.squared_bands = pending.band_memory.get();
    pending.queue_size = after;
}

template <class T>
void make_reaches(Pending<T>& pending, std::size_t count) {
    if (count <= pending.num_reaches) return;
    pending.reach_memory = std::make_unique_for_overwrite<T[]>(2 * count);
    pending.reaches = pending.reach_memory.get();
    pending.num_reaches = 2 * count;
}

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
        const std::size_t code = level(bounds_u, half_extents[2 * i]) * (bounds_v.size() + 1) +
                                 level(bounds_v, half_extents[2 * i + 1]);
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

// Paints the rows of pixels that `params` names.
template <class T>
void paint_strip(const RasterParams& params, const BoxView<T>& boxes, const Picture<T>& picture) {
    const Kernels<T> kernels;
    const auto storage = std::make_unique_for_overwrite<Record<T>[]>(boxes.count);
    Record<T>* records = storage.get();
    const TileLists tiles = make_tiles(params, kernels, boxes, records);
    const auto columns = static_cast<std::size_t>(tiles.columns);
    const std::size_t first_tile = static_cast<std::size_t>(params.first_row / kTileHeight) * columns;
    const int end_row = (params.end_row + kTileHeight - 1) / kTileHeight;
    const std::size_t end_tile = static_cast<std::size_t>(end_row) * columns;
    const std::size_t num_tiles = end_tile - first_tile;
    const double visits = tiles.starts[end_tile] - tiles.starts[first_tile];
    const double work = kTileCost * static_cast<double>(num_tiles) + kVisitCost * visits;
    parallel_for(num_tiles, useful_threads(work, params.num_threads), [&](std::size_t item) {
        const std::size_t tile = first_tile + item;
        const std::uint32_t first = tiles.starts[tile];
        const int column = static_cast<int>(tile) % tiles.columns, row = static_cast<int>(tile) / tiles.columns;
        const std::uint32_t* ids = tiles.ids.get() + first;
        const std::size_t num_ids = tiles.starts[tile + 1] - first;
        if (boxes.bands == nullptr) {
            kernels.paint_tile(params, records, ids, num_ids, column, row, picture);
            return;
        }
        thread_local Pending<T> pending;
        kernels.paint_tile_softly(params, records, boxes.bands, ids, num_ids, column, row, pending, picture);
    });
}

// Entries of the lists of tiles that are made at a time: some 12 bytes each while they are.
constexpr double kMostVisits = 1 << 26;

// Half-open range of rows of pixels, whole tiles but at the end of the picture.
struct Strip {
    int first_row, end_row;
};

// The strips of the picture to paint one after the other, so that the lists of tiles stay small in memory even
// where very many boxes are very large. Counted from above: a box reaches no further than the sum of its half
// extents.
template <class T>
std::vector<Strip> strips_of(const RasterParams& params, const BoxView<T>& boxes) {
    const int columns = (params.width + kTileWidth - 1) / kTileWidth;
    const int rows = (params.height + kTileHeight - 1) / kTileHeight;
    const double most_visits = static_cast<double>(boxes.count) * columns * rows;
    double visits = 0;
    for (std::size_t i = 0; i < boxes.count && most_visits > kMostVisits; ++i) {
        const double half_u = static_cast<double>(boxes.half_extents[2 * i]);
        const double reach = half_u + static_cast<double>(boxes.half_extents[2 * i + 1]);
        const auto tiles = [&](T center, int length, int tile) {
            const double c = static_cast<double>(center);
            return 1 + std::max(std::min(c + reach, 1.0 * length) - std::max(c - reach, 0.0), 0.0) / tile;
        };
        visits += tiles(boxes.centers[2 * i], params.width, kTileWidth) *
                  tiles(boxes.centers[2 * i + 1], params.height, kTileHeight);
    }
    const int num_strips = static_cast<int>(std::min(std::floor(visits / kMostVisits) + 1, 1.0 * rows));
    std::vector<Strip> strips;
    for (int strip = 0; strip < num_strips; ++strip) {
        const int first = rows * strip / num_strips, end = rows * (strip + 1) / num_strips;
        strips.push_back({first * kTileHeight, std::min(end * kTileHeight, params.height)});
    }
    return strips;
}

}  // namespace

template <class T>
void rasterize(const RasterParams& whole, const BoxView<T>& boxes, const Picture<T>& picture) {
    for (const Strip& strip : strips_of(whole, boxes)) {
        RasterParams params = whole;
        params.first_row = strip.first_row;
        params.end_row = strip.end_row;
        paint_strip(params, boxes, picture);
    }
}

template void add_slots(Pending<float>&);
template void add_slots(Pending<double>&);
template void lengthen_queues(Pending<float>&);
template void lengthen_queues(Pending<double>&);
template void make_reaches(Pending<float>&, std::size_t);
template void make_reaches(Pending<double>&, std::size_t);
template LevelChoice choose_levels<float>(std::size_t, const float*, std::span<const double>, std::span<const double>);
template LevelChoice choose_levels<double>(std::size_t, const double*, std::span<const double>,
                                           std::span<const double>);
template void rasterize<float>(const RasterParams&, const BoxView<float>&, const Picture<float>&);
template void rasterize<double>(const RasterParams&, const BoxView<double>&, const Picture<double>&);

}  // namespace brushgs
