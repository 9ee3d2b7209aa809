// The order of work of the rasteriser: records, tile lists, tiles. The loops are in raster_kernel.cpp.
#include "brushgs/raster.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "brushgs/cpu.hpp"
#include "brushgs/tiles.hpp"

namespace brushgs {

namespace {

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

template <class T>
void rasterize(const RasterParams& params, const BoxView<T>& boxes, const Picture<T>& picture) {
    const Kernels<T> kernels;
    const auto storage = std::make_unique_for_overwrite<Record<T>[]>(boxes.count);
    Record<T>* records = storage.get();
    const TileLists tiles = make_tiles(params, kernels.make_records, boxes, records);
    const auto num_tiles = static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows);
    parallel_for(num_tiles, params.num_threads, [&](std::size_t tile) {
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
