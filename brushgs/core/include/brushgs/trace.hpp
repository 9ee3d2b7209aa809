// Data of painting that its derivative needs again.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/memory.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

// Kept from painting for its derivative, which takes 0.75 times as long with it for 7000 strokes and 0.6 times for
// 150,000: many strokes paint nothing in a tile that they reach, or only on some of its blocks. In memory 64 bytes for
// each stroke, and as much for its underpaint if it has any, twice that in double; and 12 bytes for each tile that a
// stroke reaches, 16 with underpaint. Nothing per fragment.
template <class T>
struct Trace {
    Buffer<Record<T>> memory;            // of `records`, where they are its own
    const Record<T>* records = nullptr;  // of the strokes, then of their underpaint
    TileLists tiles{};
    BoxVisits visits;
    Buffer<std::uint32_t> blocks;  // see PaintedBlocks: of all lists, then of their underpaint; null: not known

    // Of the tile.
    PaintedBlocks painted(std::size_t tile, bool has_underpaint) const {
        if (blocks == nullptr) return {};
        std::uint32_t* const strokes = blocks.get() + tiles.starts[tile];
        return {strokes, has_underpaint ? strokes + tiles.starts.back() : nullptr};
    }
};

// Whether the trace may be that of these boxes: the numbers of boxes and tiles agree.
template <class T>
bool is_of(const Trace<T>& trace, const BoxView<T>& boxes, int width, int height) {
    const bool is_wide = trace.tiles.columns == (width + kTileWidth - 1) / kTileWidth;
    return trace.visits.starts.size() == boxes.count + 1 && is_wide &&
           trace.tiles.rows == (height + kTileHeight - 1) / kTileHeight;
}

}  // namespace brushgs
