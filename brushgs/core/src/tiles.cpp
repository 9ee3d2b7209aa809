#include "brushgs/tiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>
#include <utility>

#include "brushgs/cpu.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

namespace {

// Outward shift of the sides of a box before the search for its tiles, in pixels: painting is exact, this search must
// only not miss a tile. The outline has the precision of a float.
double slack_of(const Outline& o) {
    // In double: for boxes near the largest float the sum would be infinite.
    const double size = std::fabs(static_cast<double>(o.center_x)) + std::fabs(static_cast<double>(o.center_y)) +
                        static_cast<double>(o.reach_u) + static_cast<double>(o.reach_v);
    return 1e-2 + 1e-6 * size;
}

// The right and left ends of a box within a row of tiles.
class RowSpans {
public:
    explicit RowSpans(const Outline& o)
        : cos_(o.cos),
          sin_(o.sin),
          center_x_(o.center_x),
          center_y_(o.center_y),
          reach_u_(o.reach_u + slack_of(o)),
          reach_v_(o.reach_v + slack_of(o)),
          slope_sign_(o.sin * o.cos < 0 ? -1.0 : 1.0),
          per_cos_(1 / std::fabs(cos_)),
          per_sin_(1 / std::fabs(sin_)),
          reach_y_(std::fabs(sin_) * reach_u_ + std::fabs(cos_) * reach_v_),
          corner_y_((cos_ < 0 ? -sin_ : sin_) * reach_u_ - (sin_ < 0 ? -cos_ : cos_) * reach_v_) {}

    // Ends of the box on the rows of pixels with centers `top` to `bottom`; false if it does not reach them. The box is
    // convex: it extends furthest right on the row nearest to its rightmost corner.
    bool find(double top, double bottom, double& left, double& right) const {
        const double low = std::max(top - center_y_, -reach_y_), high = std::min(bottom - center_y_, reach_y_);
        if (low > high) return false;
        right = center_x_ + right_at(std::min(std::max(corner_y_, low), high));
        left = center_x_ - right_at(-std::min(std::max(-corner_y_, low), high));
        return true;
    }

private:
    // Sides with a smaller slope than this count as parallel to the rows: dividing by it would magnify rounding.
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
    // Without a branch. Needs room for one more entry in any case.
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
std::pair<int, int> reached_columns(const RowSpans& spans, int row, const TileRange& range) {
    double left, right;
    if (!spans.find(row * kTileHeight + 0.5, (row + 1) * kTileHeight - 0.5, left, right)) return {1, 0};
    const int from = static_cast<int>(std::max(left + 0.5, 0.0) * (1.0 / kTileWidth));
    const int to = static_cast<int>(std::min(std::max(right - 0.5, -1.0 * kTileWidth), 1e5) * (1.0 / kTileWidth));
    return {std::max(from, range.first_column), std::min(to, range.last_column)};
}

// Two by two tiles. The box meets all four, or one of its sides passes between it and their common corner; then it
// misses the tile that this side faces. This case cannot be predicted by branches.
void visit_four(const TileRange& range, const Outline& o, int columns, Chunk& chunk) {
    const float dx = static_cast<float>(range.last_column * kTileWidth) - o.center_x;
    const float dy = static_cast<float>(range.last_row * kTileHeight) - o.center_y;
    const float nearest = 0.5f * (std::fabs(o.cos) + std::fabs(o.sin));  // pixel center to the point they share
    const float to_center = nearest - static_cast<float>(slack_of(o));
    const float u = o.cos * dx + o.sin * dy, v = o.cos * dy - o.sin * dx;
    const bool beyond_u = std::fabs(u) + to_center > o.reach_u, beyond_v = std::fabs(v) + to_center > o.reach_v;
    const int facing_u = ((u < 0) != (o.cos < 0) ? 0 : 1) + ((u < 0) != (o.sin < 0) ? 0 : 2);
    const int facing_v = ((v < 0) != (-o.sin < 0) ? 0 : 1) + ((v < 0) != (o.cos < 0) ? 0 : 2);
    const int skipped = (beyond_u ? 1 << facing_u : 0) | (beyond_v ? 1 << facing_v : 0);
    const int first = range.first_row * columns + range.first_column;
    chunk.make_room(4);
    chunk.visit(first, (skipped & 1) == 0);
    chunk.visit(first + 1, (skipped & 2) == 0);
    chunk.visit(first + columns, (skipped & 4) == 0);
    chunk.visit(first + columns + 1, (skipped & 8) == 0);
}

// Visits the tiles whose pixel centers may lie inside the outline, row by row.
void visit_tiles(const Outline& outline, int columns, Chunk& chunk) {
    if (outline.right < outline.left) return;
    const TileRange range{outline.left / kTileWidth, outline.right / kTileWidth, outline.top / kTileHeight,
                          outline.bottom / kTileHeight};
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

// The limits of the tile whose first pixel is (x0, y0).
template <class T>
void find_limits(const RasterParams& params, const T* limits, int x0, int y0, TileLimits<T>& tile) {
    tile.nearest = std::numeric_limits<T>::infinity();
    tile.farthest = -tile.nearest;
    std::fill_n(tile.limits[0], kTileWidth * kTileHeight, tile.nearest);
    const int num_columns = std::min(params.right() - x0, kTileWidth),
              num_rows = std::min(params.bottom() - y0, kTileHeight);
    for (int y = 0; y < num_rows; ++y) {
        const std::size_t first = params.place(x0, y0 + y);
        for (int x = 0; x < num_columns; ++x) {
            const T limit = limits[first + static_cast<std::size_t>(x)];
            tile.limits[y / 4 * (kTileWidth / 4) + x / 4][y % 4 * 4 + x % 4] = limit;
            tile.nearest = std::min(tile.nearest, limit);
            tile.farthest = std::max(tile.farthest, limit);
        }
    }
}

}  // namespace

template <class T>
TileLists make_tiles(const RasterParams& params, MakeRecords<T> make_records, const BoxView<T>& boxes,
                     Record<T>* records, BoxVisits* visits) {
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
        make_records(params, boxes, chunk.begin, chunk.end, records, outlines.get());
        chunk.places.assign(num_tiles, 0);
        chunk.num_visits.resize(count);
        chunk.make_room(2 * count);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t before = chunk.count;
            visit_tiles(outlines[i], tiles.columns, chunk);
            chunk.num_visits[i] = static_cast<std::uint32_t>(chunk.count - before);
        }
    });
    tiles.starts.resize(num_tiles + 1);
    std::size_t num_visits = 0;
    for (const Chunk& chunk : chunks) num_visits += chunk.visits.size();
    if (num_visits > std::numeric_limits<std::uint32_t>::max()) out_of_memory();  // 16 GB of list entries
    std::uint32_t total = 0;
    for (std::size_t tile = 0; tile < num_tiles; ++tile) {
        tiles.starts[tile] = total;
        for (Chunk& chunk : chunks) total += std::exchange(chunk.places[tile], total);
    }
    tiles.starts[num_tiles] = total;
    tiles.ids = std::make_unique_for_overwrite<std::uint32_t[]>(total);
    if (visits != nullptr) {
        visits->starts.assign(1, 0);
        visits->starts.reserve(boxes.count + 1);
        for (const Chunk& chunk : chunks)
            for (const std::uint32_t count : chunk.num_visits) visits->starts.push_back(visits->starts.back() + count);
        visits->entries = std::make_unique_for_overwrite<std::uint32_t[]>(total);
    }
    parallel_for(chunks.size(), num_threads, [&](std::size_t c) {
        Chunk& chunk = chunks[c];
        const std::uint32_t* tile = chunk.visits.data();
        std::uint32_t* entry = visits == nullptr ? nullptr : &visits->entries[visits->starts[chunk.begin]];
        for (std::size_t i = chunk.begin; i < chunk.end; ++i)
            for (std::uint32_t k = chunk.num_visits[i - chunk.begin]; k > 0; --k, ++tile) {
                const std::uint32_t place = chunk.places[*tile]++;
                tiles.ids[place] = static_cast<std::uint32_t>(i);
                if (entry != nullptr) *entry++ = place;
            }
    });
    return tiles;
}

template <class T>
TileTask<T> task_of(const RasterParams& params, const BoxView<T>& boxes, const Record<T>* records,
                    const TileLists& tiles, std::size_t tile) {
    const std::uint32_t first = tiles.starts[tile];
    const bool has_underpaint = boxes.underpaint.setbacks != nullptr;
    thread_local Scratch<WaitingUnderpaint> waiting;
    const int column = static_cast<int>(tile) % tiles.columns, row = static_cast<int>(tile) / tiles.columns;
    thread_local TileLimits<T> limits;
    const bool has_strokes = tiles.starts[tile + 1] != first;
    if (boxes.limits != nullptr && has_strokes)
        find_limits(params, boxes.limits, column * kTileWidth, row * kTileHeight, limits);
    return {.params = params,
            .boxes = boxes,
            .records = records,
            .underpaints = has_underpaint ? records + boxes.count : nullptr,
            .ids = tiles.ids.get() + first,
            .num_ids = tiles.starts[tile + 1] - first,
            .x0 = column * kTileWidth,
            .y0 = row * kTileHeight,
            .waiting = has_underpaint ? waiting.take(tiles.starts[tile + 1] - first).data() : nullptr,
            .limits = boxes.limits == nullptr ? nullptr : &limits};
}

template TileLists make_tiles<float>(const RasterParams&, MakeRecords<float>, const BoxView<float>&, Record<float>*,
                                     BoxVisits*);
template TileTask<float> task_of<float>(const RasterParams&, const BoxView<float>&, const Record<float>*,
                                        const TileLists&, std::size_t);
template TileLists make_tiles<double>(const RasterParams&, MakeRecords<double>, const BoxView<double>&, Record<double>*,
                                      BoxVisits*);
template TileTask<double> task_of<double>(const RasterParams&, const BoxView<double>&, const Record<double>*,
                                          const TileLists&, std::size_t);

}  // namespace brushgs
