// The tiles that each box reaches, and the records of the boxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "brushgs/raster.hpp"

namespace brushgs {

// Below this many boxes a second thread costs more than it saves in the stages before painting.
constexpr std::size_t kParallelFrom = 4000;

template <class T>
using MakeRecords = decltype(&baseline::make_records<T>);

// Entries of the tile lists that belong to box i, tile by tile: entries[starts[i]] to entries[starts[i + 1]].
struct BoxVisits {
    std::vector<std::uint32_t> starts;
    std::unique_ptr<std::uint32_t[]> entries;
};

// Number of records of boxes: two each with underpaint.
template <class T>
std::size_t num_records(const BoxView<T>& boxes) {
    return boxes.underpaint.setbacks == nullptr ? boxes.count : 2 * boxes.count;
}

// Records for all boxes, and for every tile the records that reach it. Chunks of boxes are counted separately and
// concatenated within each tile, so lists are in stroke order for any number of threads. `visits`, unless null, gets
// the inverse.
template <class T>
TileLists make_tiles(const RasterParams& params, MakeRecords<T> make_records, const BoxView<T>& boxes,
                     Record<T>* records, BoxVisits* visits = nullptr);

// The work for one tile. Memory for waiting underpaint and for limits belongs to the thread.
template <class T>
TileTask<T> task_of(const RasterParams& params, const BoxView<T>& boxes, const Record<T>* records,
                    const TileLists& tiles, std::size_t tile);

}  // namespace brushgs
