#include "brushgs/soft_queues.hpp"

#include <algorithm>
#include <utility>

namespace brushgs {

constexpr std::size_t kSlotPixels = 16;

template <class T>
void add_slots(SoftQueues<T>& queues) {
    const std::size_t before = queues.num_slots, after = before == 0 ? 256 : 2 * before;
    auto slots = std::make_unique_for_overwrite<FragmentSlot<T>[]>(after);
    auto free_slots = std::make_unique_for_overwrite<std::uint32_t[]>(after);
    std::copy_n(queues.slots, before, slots.get());
    std::copy_n(queues.free_slots, queues.num_free, free_slots.get());
    for (std::size_t slot = after; slot > before; --slot)
        free_slots[queues.num_free++] = static_cast<std::uint32_t>(slot - 1);
    const auto lengthen = [&](std::unique_ptr<T[]>& memory, T*& column) {
        auto longer = std::make_unique_for_overwrite<T[]>(kSlotPixels * after);
        std::copy_n(column, kSlotPixels * before, longer.get());
        memory = std::move(longer);
        column = memory.get();
    };
    if (queues.keeps_shades) lengthen(queues.shade_memory, queues.shades);
    if (queues.keeps_heights) lengthen(queues.height_memory, queues.heights);
    queues.slot_memory = std::move(slots);
    queues.free_memory = std::move(free_slots);
    queues.slots = queues.slot_memory.get();
    queues.free_slots = queues.free_memory.get();
    queues.num_slots = after;
}

template <class T>
void keep_shades(SoftQueues<T>& queues, bool keeps) {
    if (queues.keeps_shades == keeps) return;
    queues.keeps_shades = keeps;
    queues.shade_memory = keeps ? std::make_unique_for_overwrite<T[]>(kSlotPixels * queues.num_slots) : nullptr;
    queues.shades = queues.shade_memory.get();
}

template <class T>
void keep_heights(SoftQueues<T>& queues, bool keeps) {
    if (queues.keeps_heights == keeps) return;
    queues.keeps_heights = keeps;
    queues.height_memory = keeps ? std::make_unique_for_overwrite<T[]>(kSlotPixels * queues.num_slots) : nullptr;
    queues.heights = queues.height_memory.get();
}

template <class T>
void lengthen_queues(SoftQueues<T>& queues) {
    using Queues = SoftQueues<T>;
    const std::size_t before = queues.queue_size, after = before == 0 ? 16 : 2 * before;
    const std::size_t count = Queues::num_queues * after;
    auto entries = std::make_unique_for_overwrite<FragmentEntry[]>(count);
    auto depths = std::make_unique<T[]>(count + Queues::room_behind);
    auto softness = std::make_unique<T[]>(count + Queues::room_behind);
    for (std::size_t b = 0; b < Queues::num_queues; ++b) {
        const std::size_t from = b * before + queues.heads[b], to = b * after + queues.heads[b];
        const std::size_t length = queues.tails[b] - queues.heads[b];
        std::copy_n(queues.entries + from, length, entries.get() + to);
        std::copy_n(queues.depths + from, length, depths.get() + to);
        std::copy_n(queues.squared_softness + from, length, softness.get() + to);
    }
    queues.entry_memory = std::move(entries);
    queues.depth_memory = std::move(depths);
    queues.softness_memory = std::move(softness);
    queues.entries = queues.entry_memory.get();
    queues.depths = queues.depth_memory.get();
    queues.squared_softness = queues.softness_memory.get();
    queues.queue_size = after;
}

template <class T>
void make_reaches(SoftQueues<T>& queues, std::size_t count) {
    if (count <= queues.num_reaches) return;
    queues.reach_memory = std::make_unique_for_overwrite<T[]>(2 * count);
    queues.reaches = queues.reach_memory.get();
    queues.num_reaches = 2 * count;
}

template void add_slots(SoftQueues<float>&);
template void add_slots(SoftQueues<double>&);
template void lengthen_queues(SoftQueues<float>&);
template void lengthen_queues(SoftQueues<double>&);
template void keep_shades(SoftQueues<float>&, bool);
template void keep_shades(SoftQueues<double>&, bool);
template void keep_heights(SoftQueues<float>&, bool);
template void keep_heights(SoftQueues<double>&, bool);
template void make_reaches(SoftQueues<float>&, std::size_t);
template void make_reaches(SoftQueues<double>&, std::size_t);

}  // namespace brushgs
