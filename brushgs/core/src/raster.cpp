// The order of work of the rasteriser: records, tile lists, tiles. The loops are in raster_kernel.cpp.
#include "brushgs/raster.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

// Below this many boxes a second thread costs more than it saves in the stages before painting.
constexpr std::size_t parallel_from = 20000;

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

// The outline of a box, for the question which tiles of a row it reaches.
struct Outline {
    double center_x, center_y, cos, sin, half_u, half_v;

    // Largest x - center_x at which the line y = center_y + dy is inside the box.
    double right_at(double dy) const {
        const double by_u = (half_u - std::copysign(sin, sin * cos) * dy) / std::max(std::fabs(cos), 1e-300);
        const double by_v = (half_v + std::copysign(cos, sin * cos) * dy) / std::max(std::fabs(sin), 1e-300);
        return std::min(by_u, by_v);
    }
};

// Calls visit(tile) for the tiles whose pixel centres may lie inside the record's box, row by row.
template <class T, class Visit>
void for_each_tile(const Record<T>& r, double high_u, double high_v, bool is_centred, int columns, const Visit& visit) {
    if (r.right < r.left) return;
    const int first_column = r.left / tile_width, last_column = r.right / tile_width;
    const int first_row = r.top / tile_height, last_row = r.bottom / tile_height;
    const bool is_exact = first_column == last_column || first_row == last_row;
    if (is_exact && (last_column - first_column) + (last_row - first_row) <= 1) {
        for (int row = first_row; row <= last_row; ++row)
            for (int column = first_column; column <= last_column; ++column) visit(row * columns + column);
        return;
    }
    // Back from the record to the box: gradients are (cos, sin) and (-sin, cos) times a scale each.
    const double scale_u = std::hypot(static_cast<double>(r.du_dx), static_cast<double>(r.du_dy));
    const double scale_v = std::hypot(static_cast<double>(r.dv_dx), static_cast<double>(r.dv_dy));
    const double cos = static_cast<double>(r.du_dx) / scale_u, sin = static_cast<double>(r.du_dy) / scale_u;
    const double middle_u = is_centred ? 0 : 0.5 * high_u, middle_v = is_centred ? 0 : 0.5 * high_v;
    const double to_u = (middle_u - static_cast<double>(r.offset_u)) / scale_u;
    const double to_v = (middle_v - static_cast<double>(r.offset_v)) / scale_v;
    const double slack = 1e-3;  // pixels: the paint loop decides; this must only never leave out a tile it needs
    const Outline box{static_cast<double>(r.anchor_x) + cos * to_u - sin * to_v,
                      static_cast<double>(r.anchor_y) + sin * to_u + cos * to_v,
                      cos,
                      sin,
                      (is_centred ? high_u : middle_u) / scale_u + slack,
                      (is_centred ? high_v : middle_v) / scale_v + slack};
    const double reach_y = std::fabs(sin) * box.half_u + std::fabs(cos) * box.half_v;
    // The outermost corner on the right; the box is convex, so within a row the point nearest to it reaches furthest.
    const double corner_y = std::copysign(1.0, cos) * sin * box.half_u - std::copysign(1.0, sin) * cos * box.half_v;
    for (int row = first_row; row <= last_row; ++row) {
        const double low = std::max(row * tile_height + 0.5 - box.center_y, -reach_y);
        const double high = std::min((row + 1) * tile_height - 0.5 - box.center_y, reach_y);
        if (low > high) continue;
        const double right = box.center_x + box.right_at(std::clamp(corner_y, low, high));
        const double left = box.center_x - box.right_at(-std::clamp(-corner_y, low, high));
        const double first = std::ceil((left - (tile_width - 0.5)) / tile_width);
        const double last = std::floor((right - 0.5) / tile_width);
        const int from = static_cast<int>(std::max(first, static_cast<double>(first_column)));
        const int to = static_cast<int>(std::min(last, static_cast<double>(last_column)));
        for (int column = from; column <= to; ++column) visit(row * columns + column);
    }
}

template <class T>
struct Binner {
    const RasterParams& params;
    const std::vector<Record<T>>& records;
    int columns;

    template <class Visit>
    void visit_tiles(std::size_t i, const Visit& visit) const {
        const Record<T>& r = records[i];
        if (params.levels.empty()) {
            for_each_tile(r, static_cast<double>(r.limit), static_cast<double>(r.limit), true, columns, visit);
        } else {
            const Level& level = params.levels[static_cast<std::size_t>(r.level)];
            for_each_tile(r, level.columns - 1.0, level.rows - 1.0, false, columns, visit);
        }
    }
};

// Records for all boxes, and for every tile the records that reach it. Chunks of boxes are counted apart and
// laid end to end within each tile, so a list is in stroke order however many threads there are.
template <class T>
TileLists make_tiles(const RasterParams& params, const Kernels<T>& kernels, const BoxView<T>& boxes,
                     std::vector<Record<T>>& records) {
    TileLists tiles;
    tiles.columns = (params.width + tile_width - 1) / tile_width;
    tiles.rows = (params.height + tile_height - 1) / tile_height;
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    const int num_threads = boxes.count < parallel_from ? 1 : params.num_threads;
    const std::size_t num_chunks = num_threads > 1 ? static_cast<std::size_t>(4 * num_threads) : 1;
    const auto chunk_begin = [&](std::size_t chunk) { return boxes.count * chunk / num_chunks; };
    const Binner<T> binner{params, records, tiles.columns};

    std::vector<std::uint32_t> next(num_chunks * num_tiles, 0);  // first the counts, then where to write
    parallel_for(num_chunks, num_threads, [&](std::size_t chunk) {
        kernels.make_records(params, boxes, chunk_begin(chunk), chunk_begin(chunk + 1), records.data());
        std::uint32_t* counts = next.data() + chunk * num_tiles;
        for (std::size_t i = chunk_begin(chunk); i < chunk_begin(chunk + 1); ++i)
            binner.visit_tiles(i, [&](int tile) { ++counts[tile]; });
    });
    tiles.starts.resize(num_tiles + 1);
    std::uint32_t total = 0;
    for (std::size_t tile = 0; tile < num_tiles; ++tile) {
        tiles.starts[tile] = total;
        for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) {
            const std::uint32_t count = next[chunk * num_tiles + tile];
            next[chunk * num_tiles + tile] = total;
            total += count;
        }
    }
    tiles.starts[num_tiles] = total;
    tiles.ids.resize(total);
    parallel_for(num_chunks, num_threads, [&](std::size_t chunk) {
        std::uint32_t* places = next.data() + chunk * num_tiles;
        for (std::size_t i = chunk_begin(chunk); i < chunk_begin(chunk + 1); ++i)
            binner.visit_tiles(i, [&](int tile) { tiles.ids[places[tile]++] = static_cast<std::uint32_t>(i); });
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
    std::vector<Record<T>> records(boxes.count);
    const TileLists tiles = make_tiles(params, kernels, boxes, records);
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    parallel_for(num_tiles, params.num_threads, [&](std::size_t tile) {
        const std::uint32_t first = tiles.starts[tile];
        const int column = static_cast<int>(tile) % tiles.columns, row = static_cast<int>(tile) / tiles.columns;
        kernels.paint_tile(params, records.data(), tiles.ids.data() + first, tiles.starts[tile + 1] - first, column,
                           row, picture);
    });
}

template LevelChoice choose_levels<float>(std::size_t, const float*, std::span<const double>, std::span<const double>);
template LevelChoice choose_levels<double>(std::size_t, const double*, std::span<const double>,
                                           std::span<const double>);
template void rasterize<float>(const RasterParams&, const BoxView<float>&, const Picture<float>&);
template void rasterize<double>(const RasterParams&, const BoxView<double>&, const Picture<double>&);

}  // namespace brushgs
