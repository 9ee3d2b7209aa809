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
    const auto lengthen = [&](std::unique_ptr<T[]>& memory, T*& column, int num) {
        const std::size_t width = kSlotPixels * static_cast<std::size_t>(num);
        auto longer = std::make_unique_for_overwrite<T[]>(width * after);
        std::copy_n(column, width * before, longer.get());
        memory = std::move(longer);
        column = memory.get();
    };
    if (queues.num_shades > 0) lengthen(queues.shade_memory, queues.shades, queues.num_shades);
    if (queues.keeps_heights) lengthen(queues.height_memory, queues.heights, 1);
    queues.slot_memory = std::move(slots);
    queues.free_memory = std::move(free_slots);
    queues.slots = queues.slot_memory.get();
    queues.free_slots = queues.free_memory.get();
    queues.num_slots = after;
}

template <class T>
void keep_shades(SoftQueues<T>& queues, int num_shades) {
    if (queues.num_shades == num_shades) return;
    queues.num_shades = num_shades;
    const std::size_t values = kSlotPixels * static_cast<std::size_t>(num_shades) * queues.num_slots;
    queues.shade_memory = num_shades > 0 ? std::make_unique_for_overwrite<T[]>(values) : nullptr;
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
void add_places(SoftQueues<T>& queues) {
    constexpr std::size_t num_queues = SoftQueues<T>::num_queues;
    const std::size_t before = queues.num_words, words = before == 0 ? 1 : 2 * before;
    const std::size_t places = kWordPlaces * words;
    auto entries = std::make_unique<FragmentEntry[]>(num_queues * places);
    std::copy_n(queues.entries, num_queues * queues.num_places, entries.get());
    auto waiting = std::make_unique<std::uint64_t[]>((num_queues + 2) * words);
    for (std::size_t b = 0; b < num_queues; ++b)
        std::copy_n(queues.waiting + b * before, before, waiting.get() + b * words);
    auto records = std::make_unique<std::uint32_t[]>(places);
    std::copy_n(queues.records, queues.num_places, records.get());
    auto columns = std::make_unique<T[]>(4 * places);
    T* next = columns.get();
    for (T** const column : {&queues.depths, &queues.squared_softness, &queues.ends, &queues.shares}) {
        std::copy_n(*column, queues.num_places, next);
        *column = next;
        next += places;
    }
    queues.entry_memory = std::move(entries);
    queues.waiting_memory = std::move(waiting);
    queues.record_memory = std::move(records);
    queues.column_memory = std::move(columns);
    queues.entries = queues.entry_memory.get();
    queues.waiting = queues.waiting_memory.get();
    queues.reached = queues.waiting + num_queues * words;
    queues.open = queues.reached + words;
    queues.records = queues.record_memory.get();
    queues.num_places = places;
    queues.num_words = words;
}

template <class T>
void drop_places(SoftQueues<T>& queues, std::size_t count, std::size_t used) {
    constexpr std::size_t num_queues = SoftQueues<T>::num_queues;
    const auto to_front = [&](auto* column, std::size_t stride) {
        std::copy(column + stride * count, column + stride * used, column);
    };
    to_front(queues.entries, num_queues);
    to_front(queues.records, 1);
    to_front(queues.depths, 1);
    to_front(queues.squared_softness, 1);
    to_front(queues.ends, 1);
    const std::size_t words = queues.num_words, skipped = count / kWordPlaces, shift = count % kWordPlaces;
    for (std::size_t b = 0; b < num_queues; ++b) {
        std::uint64_t* const waiting = queues.waiting + b * words;
        for (std::size_t w = 0; w < words; ++w) {
            const auto word = [&](std::size_t k) { return k < words ? waiting[k] : 0; };
            const std::uint64_t low = word(w + skipped) >> shift;
            waiting[w] = shift == 0 ? low : low | word(w + skipped + 1) << (kWordPlaces - shift);
        }
    }
}

template <class T>
void make_behind(SoftQueues<T>& queues, std::size_t count) {
    if (count <= queues.num_behind) return;
    queues.behind_memory = std::make_unique_for_overwrite<SoftBehind<T>[]>(2 * count);
    queues.behind = queues.behind_memory.get();
    queues.begin_memory = std::make_unique_for_overwrite<T[]>(2 * count * SoftQueues<T>::num_queues);
    queues.begins = queues.begin_memory.get();
    queues.num_behind = 2 * count;
}

template void add_slots(SoftQueues<float>&);
template void add_slots(SoftQueues<double>&);
template void add_places(SoftQueues<float>&);
template void add_places(SoftQueues<double>&);
template void drop_places(SoftQueues<float>&, std::size_t, std::size_t);
template void drop_places(SoftQueues<double>&, std::size_t, std::size_t);
template void keep_shades(SoftQueues<float>&, int);
template void keep_shades(SoftQueues<double>&, int);
template void keep_heights(SoftQueues<float>&, bool);
template void keep_heights(SoftQueues<double>&, bool);
template void make_behind(SoftQueues<float>&, std::size_t);
template void make_behind(SoftQueues<double>&, std::size_t);

}  // namespace brushgs
