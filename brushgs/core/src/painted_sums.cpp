// The order of work of what boxes make up of a picture: records and tile lists, tiles, boxes.
#include "brushgs/painted_sums.hpp"

#include "brushgs/box_sums.hpp"
#include "brushgs/memory.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

template <class T>
void sum_painted(const RasterParams& params, const BoxView<T>& boxes, const PixelValues<T>& pixels,
                 const PaintedSums<T>& sums) {
    const auto make_records = BRUSHGS_KERNEL(make_records, T);
    const auto sum_tile = BRUSHGS_KERNEL(sum_tile, T);
    thread_local Scratch<Record<T>> record_memory;
    Record<T>* const records = record_memory.take(boxes.count).data();
    BoxVisits visits;
    const TileLists tiles = make_tiles(params, make_records, boxes, records, &visits);
    const std::size_t num_entries = tiles.starts.back();
    thread_local Scratch<T> sum_memory;
    thread_local Scratch<bool> seen_memory;
    const RecordSums<T> found{sum_memory.take(kNumPaintedSums * num_entries).data(),
                              seen_memory.take(num_entries).data()};
    parallel_for(tiles.starts.size() - 1, params.num_threads, [&](std::size_t tile) {
        const std::size_t first = tiles.starts[tile];
        sum_tile(task_of(params, boxes, records, tiles, tile), pixels,
                 {found.values + kNumPaintedSums * first, found.is_seen + first});
    });
    for_boxes(boxes.count, params.num_threads, [&](std::size_t i) {
        const BoxSums<kNumPaintedSums, T> box(visits, i, found);
        if (sums.values != nullptr)
            for (std::size_t k = 0; k < 3; ++k) sums.values[3 * i + k] = static_cast<T>(box.values[k]);
        sums.shares[i] = static_cast<T>(box.values[3]);
    });
}

template void sum_painted<float>(const RasterParams&, const BoxView<float>&, const PixelValues<float>&,
                                 const PaintedSums<float>&);
template void sum_painted<double>(const RasterParams&, const BoxView<double>&, const PixelValues<double>&,
                                  const PaintedSums<double>&);

}  // namespace brushgs
