// The order of work of the rasteriser: records, tile lists, tiles. The loops are in raster_kernel.cpp.
#include "brushgs/raster.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

// Below this many boxes a second thread costs more than it saves in the stages before painting.
constexpr std::size_t parallel_from = 4000;

template <class T>
struct Kernels {
    decltype(&baseline::make_records<T>) make_records = &baseline::make_records<T>;
    decltype(&baseline::paint_tile<T>) paint_tile = &baseline::paint_tile<T>;

    Kernels() {
#ifdef BRUSHGS_X86
        if (best_isa() == Isa::avx512) {
            make_records = &avx512::make_records<T>;
            paint_tile = &avx512::paint_tile<T>;
        } else if (best_isa() == Isa::avx2) {
            make_records = &avx2::make_records<T>;
            paint_tile = &avx2::paint_tile<T>;
        }
#endif
    }
};

// The right and left ends of a box within a row of tiles.
class RowSpans {
public:
    explicit RowSpans(const Outline& o)
        : cos_(o.cos), sin_(o.sin), center_x_(o.center_x), center_y_(o.center_y), reach_u_(o.reach_u + slack),
          reach_v_(o.reach_v + slack), slope_sign_(o.sin * o.cos < 0 ? -1.0 : 1.0),
          per_cos_(1 / std::fabs(cos_)), per_sin_(1 / std::fabs(sin_)),
          reach_y_(std::fabs(sin_) * reach_u_ + std::fabs(cos_) * reach_v_),
          corner_y_((cos_ < 0 ? -sin_ : sin_) * reach_u_ - (sin_ < 0 ? -cos_ : cos_) * reach_v_) {}

    // Ends of the box on the rows of pixels with centres `top` to `bottom`; false where it does not reach them.
    // The box is convex: it extends furthest right on the row nearest to its rightmost corner.
    bool find(double top, double bottom, double& left, double& right) const {
        const double low = std::max(top - center_y_, -reach_y_), high = std::min(bottom - center_y_, reach_y_);
        if (low > high) return false;
        right = center_x_ + right_at(std::clamp(corner_y_, low, high));
        left = center_x_ - right_at(-std::clamp(-corner_y_, low, high));
        return true;
    }

private:
    static constexpr double slack = 1e-2;  // pixels; painting decides, this must only never leave out a tile
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

// Calls visit(tile) for the tiles whose pixel centres may lie inside the record's box, row by row.
template <class T, class Visit>
void for_each_tile(const Record<T>& r, const Outline& outline, int columns, const Visit& visit) {
    if (r.right < r.left) return;
    const int first_column = r.left / tile_width, last_column = r.right / tile_width;
    const int first_row = r.top / tile_height, last_row = r.bottom / tile_height;
    if (first_row == last_row || first_column == last_column) {  // a strip: the bounds are exact
        for (int row = first_row; row <= last_row; ++row)
            for (int column = first_column; column <= last_column; ++column) visit(row * columns + column);
        return;
    }
    const RowSpans spans(outline);
    for (int row = first_row; row <= last_row; ++row) {
        double left, right;
        if (!spans.find(row * tile_height + 0.5, (row + 1) * tile_height - 0.5, left, right)) continue;
        const int from = static_cast<int>(std::max(left + 0.5, 0.0) * (1.0 / tile_width));
        const int to = static_cast<int>(std::clamp(right - 0.5, -1.0 * tile_width, 1e5) * (1.0 / tile_width));
        for (int column = std::max(from, first_column); column <= std::min(to, last_column); ++column)
            visit(row * columns + column);
    }
}

// The tiles that a run of boxes reaches, in stroke order.
struct Chunk {
    std::size_t begin, end;               // boxes
    std::vector<std::uint32_t> visits;    // tiles, those of one box after those of another
    std::vector<std::uint32_t> num_visits;  // of each box
    std::vector<std::uint32_t> places;    // per tile: first how many visits, then where the next id belongs
};

// Records for all boxes, and for every tile the records that reach it. Chunks of boxes are counted apart and
// laid end to end within each tile, so a list is in stroke order however many threads there are.
template <class T>
TileLists make_tiles(const RasterParams& params, const Kernels<T>& kernels, const BoxView<T>& boxes,
                     Record<T>* records) {
    TileLists tiles;
    tiles.columns = (params.width + tile_width - 1) / tile_width;
    tiles.rows = (params.height + tile_height - 1) / tile_height;
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    const int num_threads = boxes.count < parallel_from ? 1 : params.num_threads;
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
        chunk.visits.reserve(4 * count);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t before = chunk.visits.size();
            for_each_tile(records[chunk.begin + i], outlines[i], tiles.columns, [&](int tile) {
                chunk.visits.push_back(static_cast<std::uint32_t>(tile));
                ++chunk.places[static_cast<std::size_t>(tile)];
            });
            chunk.num_visits[i] = static_cast<std::uint32_t>(chunk.visits.size() - before);
        }
    });
    tiles.starts.resize(num_tiles + 1);
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
LevelChoice choose_levels(std::size_t count, const T* half_extents, std::span<const double> bounds_u,
                          std::span<const double> bounds_v) {
    const auto level = [](std::span<const double> bounds, T half_extent) {
        std::size_t k = 0;
        while (k < bounds.size() && static_cast<double>(half_extent) <= bounds[k]) ++k;
        return k;
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

template <class T>
void rasterize(const RasterParams& params, const BoxView<T>& boxes, const Picture<T>& picture) {
    const Kernels<T> kernels;
    const auto storage = std::make_unique_for_overwrite<Record<T>[]>(boxes.count);
    Record<T>* records = storage.get();
    const TileLists tiles = make_tiles(params, kernels, boxes, records);
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    parallel_for(num_tiles, params.num_threads, [&](std::size_t tile) {
        const std::uint32_t first = tiles.starts[tile];
        const int column = static_cast<int>(tile) % tiles.columns, row = static_cast<int>(tile) / tiles.columns;
        kernels.paint_tile(params, records, tiles.ids.get() + first, tiles.starts[tile + 1] - first, column,
                           row, picture);
    });
}

template LevelChoice choose_levels<float>(std::size_t, const float*, std::span<const double>, std::span<const double>);
template LevelChoice choose_levels<double>(std::size_t, const double*, std::span<const double>,
                                           std::span<const double>);
template void rasterize<float>(const RasterParams&, const BoxView<float>&, const Picture<float>&);
template void rasterize<double>(const RasterParams&, const BoxView<double>&, const Picture<double>&);

}  // namespace brushgs
