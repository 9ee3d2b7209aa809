// The soft order: strokes fade into each other where their depths are close. Defined by brushgs/rendering/reference.py.
//
// A fragment whose depth is further from the next record's than their softness reaches is final: it is retired into
// the sums, in stroke order, as sorted strokes are. The others wait in the queue of their block, all its pixels
// together. Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "brushgs/soft_queues.hpp"
#include "brushgs/tile_state.hpp"

namespace brushgs::BRUSHGS_ISA {

constexpr std::size_t kRetiredAtOnce = 6;  // fewer are left waiting: sums are loaded and stored once for all

// What a tile holds beyond `TileState`, whose `transmittance` is here that of the retired fragments that are seen.
template <class T>
struct SoftState {
    alignas(64) T light[kNumBlocks][kBlockPixels];    // behind all fragments so far, those not seen included
    alignas(64) T weights[kNumBlocks][kBlockPixels];  // sum of those retired
    std::uint16_t shared[kNumBlocks];                 // pixels in which two fragments met within their softness

    [[gnu::always_inline]] inline SoftState() {
        T* all = light[0];
        for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
        __builtin_memset(weights, 0, sizeof weights);
        __builtin_memset(shared, 0, sizeof shared);
    }
};

// Empties the queues and frees all slots.
template <class T>
inline void clear(SoftQueues<T>& queues) {
    __builtin_memset(queues.heads, 0, sizeof queues.heads);
    __builtin_memset(queues.tails, 0, sizeof queues.tails);
    if (queues.num_free == queues.num_slots) return;
    queues.num_free = 0;  // an error left slots in use
    for (std::size_t slot = queues.num_slots; slot > 0; --slot)
        queues.free_slots[queues.num_free++] = static_cast<std::uint32_t>(slot - 1);
}

// Makes room for one more fragment at the end of the queue of block b, and a free slot for it.
template <class T>
[[gnu::noinline]] void make_room(int b, SoftQueues<T>& queues) {
    const auto queue = static_cast<std::size_t>(b);
    if (queues.num_free == 0) add_slots(queues);
    if (queues.tails[queue] < queues.queue_size) return;
    const std::size_t head = queues.heads[queue], count = queues.tails[queue] - head;
    if (2 * count >= queues.queue_size) {
        lengthen_queues(queues);
        return;
    }
    const auto to_start = [&](auto* column) {
        auto* first = column + queue * queues.queue_size;
        __builtin_memmove(first, first + head, count * sizeof *first);
    };
    to_start(queues.entries);
    to_start(queues.depths);
    to_start(queues.squared_softness);
    queues.heads[queue] = 0;
    queues.tails[queue] = count;
}

// The share of what lies behind that a fragment hides which is nearer by x times the reach of both, 0 <= x <= 1: from
// half to all.
template <class T>
[[gnu::always_inline]] inline T share_hidden(T x) {
    return T(0.5) + x * (3 - x * x) * T(0.25);
}

// A record on its way into the queues.
template <class T>
struct SoftRecord {
    std::uint32_t id;
    T depth;             // camera z
    T squared_softness;  // world units squared
    T reach;             // the largest squared softness of this record and all behind it
};

// What a record is at the pixels of a tile.
template <class T, bool has_shades, bool has_relief>
struct SoftSamples {
    SoftRecord<T> record;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    alignas(64) T shades[has_shades ? kNumBlocks : 1][kBlockPixels];
    alignas(64) T heights[has_relief ? kNumBlocks : 1][kBlockPixels];
    std::uint16_t pixels[kNumBlocks];
    std::uint32_t blocks;
};

// Its fragments in one block of the tile.
template <class T>
struct BlockFragments {
    int b;
    const T* alphas;   // [kBlockPixels]
    const T* shades;   // [kBlockPixels] factors of the colour, where they are kept
    const T* heights;  // [kBlockPixels] heights of the paint, where they are kept
    unsigned pixels;   // bit p: whether pixel p has one
};

// Blends the records of one tile. All its functions are inlined, so that its fields live in registers: where the
// columns of the queues lie is copied here because vector stores may touch any memory, and each field behind a
// reference would be read anew after each of them.
template <class T, bool has_shades, int channels, bool has_relief>
class SoftBlender {
    using L = Lanes<T>;
    using Real = typename L::Real;
    using Tile = TileState<T, channels, has_relief>;
    static constexpr int W = L::width, num_parts = kBlockPixels / W;

public:
    [[gnu::always_inline]] inline SoftBlender(const TileTask<T>& task, SoftQueues<T>& queues, SoftState<T>& soft,
                                              Tile& tile)
        : records_(task.records), attributes_(task.boxes.layers), queues_(queues), soft_(soft), tile_(tile) {
        copy_columns();
        num_free_ = queues.num_free;
    }

    // Adds the fragments of a record in one block to its queue, and lets them and those that wait hide each other;
    // false where too many wait.
    [[gnu::always_inline]] inline bool blend(const SoftRecord<T>& record, const BlockFragments<T>& fragments) {
        const int b = fragments.b;
        const auto queue = static_cast<std::size_t>(b);
        std::size_t start = queue * queue_size_;
        std::size_t head = start + queues_.heads[queue], tail = start + queues_.tails[queue];
        InFront in_front = count_in_front(head, tail, record);
        if (in_front.of_all >= kRetiredAtOnce) {
            retire(b, head, in_front.of_all);
            head += in_front.of_all;
            queues_.heads[queue] = head - start;
            in_front = {in_front.of_this - in_front.of_all, 0};
        }
        const unsigned pixels = fragments.pixels & open_pixels_behind(b, head + in_front.of_all, tail);
        if (pixels == 0) return true;
        if (tail - head >= kMostWaiting) {
            queues_.num_free = num_free_;
            return false;
        }
        if (num_free_ == 0 || tail - start == queue_size_) {
            queues_.num_free = num_free_;
            make_room(b, queues_);
            copy_columns();
            num_free_ = queues_.num_free;
            start = queue * queue_size_;
            head = start + queues_.heads[queue];
            tail = start + queues_.tails[queue];
        }

        // Light that passes what lies wholly in front, and that passes the fragments within reach as well.
        Real alpha[num_parts], front[num_parts], seen[num_parts];
        for (int part = 0; part < num_parts; ++part) {
            const auto painted = L::from_bits(pixels >> (part * W));
            alpha[part] = L::where(painted, L::load(fragments.alphas + part * W));
            front[part] = seen[part] = L::load(soft_.light[b] + part * W);
        }
        unsigned shared = 0;
        for (std::size_t k = head + in_front.of_this; k < tail; ++k) {
            const unsigned both = entries_[k].pixels & pixels;
            if (both == 0) continue;
            FragmentSlot<T>& other = slots_[entries_[k].slot];
            const T gap = record.depth - depths_[k], reach = squared_softness_[k] + record.squared_softness;
            if (gap * gap >= reach) {
                if (shared == 0) continue;
                for (int part = 0; part < num_parts; ++part) {
                    const Real hidden = L::load(other.alpha + part * W);
                    front[part] = front[part] - front[part] * hidden;
                    seen[part] = seen[part] - seen[part] * hidden;
                }
                continue;
            }
            if (shared == 0)
                for (int part = 0; part < num_parts; ++part)
                    front[part] = seen[part] = L::load(other.before + part * W);
            shared |= both;
            const T x = gap / std::sqrt(reach);
            const T share = share_hidden(x < 1 ? x : T(1));
            const Real hidden_here = L::set(share), hidden_there = L::set(1 - share);
            for (int part = 0; part < num_parts; ++part) {
                const Real weight = L::load(other.weight + part * W);
                L::store(other.weight + part * W, weight - weight * (alpha[part] * hidden_there));
                seen[part] = seen[part] - seen[part] * (L::load(other.alpha + part * W) * hidden_here);
            }
        }
        soft_.shared[b] = static_cast<std::uint16_t>(soft_.shared[b] | shared);
        append(record, fragments, tail, pixels, alpha, front, seen);
        queues_.tails[queue] = tail + 1 - start;
        return true;
    }

    // Retires all that waits. Where fragments met, their weights are scaled to the alpha of the pixel.
    [[gnu::always_inline]] inline void finish() {
        for (int b = 0; b < kNumBlocks; ++b) {
            const auto queue = static_cast<std::size_t>(b);
            const std::size_t waiting = queues_.tails[queue] - queues_.heads[queue];
            if (waiting > 0) retire(b, queue * queue_size_ + queues_.heads[queue], waiting);
            if (soft_.shared[b] == 0) continue;
            for (int lane = 0; lane < kBlockPixels; lane += W) {
                const Real weights = L::load(soft_.weights[b] + lane);  // 0 where none leaves enough light to be seen
                const auto shared = L::at_least(L::from_bits(static_cast<unsigned>(soft_.shared[b]) >> lane), weights,
                                                L::set(std::numeric_limits<T>::min()));
                const Real alpha = L::set(1) - L::load(tile_.light(b) + lane);
                const Real factor = L::select(shared, alpha / weights, L::set(1));
                for (int k = 0; k < Tile::num_planes; ++k) {
                    T* const plane = tile_.plane(k, b) + lane;
                    L::store(plane, L::load(plane) * factor);
                }
            }
        }
        queues_.num_free = num_free_;
    }

private:
    [[gnu::always_inline]] inline void copy_columns() {
        slots_ = queues_.slots, shades_ = queues_.shades, heights_ = queues_.heights, free_slots_ = queues_.free_slots,
        entries_ = queues_.entries;
        depths_ = queues_.depths, squared_softness_ = queues_.squared_softness;
        queue_size_ = queues_.queue_size;
    }

    // How many fragments of a queue, from its first on, lie wholly in front of a record, and of all behind it too.
    struct InFront {
        std::size_t of_this, of_all;
    };
    [[gnu::always_inline]] inline InFront count_in_front(std::size_t first, std::size_t last,
                                                         const SoftRecord<T>& record) const {
        constexpr auto width = static_cast<std::size_t>(W);
        InFront count{0, 0};
        for (std::size_t k = 0; first + k < last && count.of_this == k; k += width) {
            const auto gap = L::set(record.depth) - L::load(depths_ + first + k);
            const auto softness = L::load(squared_softness_ + first + k), squared = gap * gap;
            const auto all = L::from_bits(~0u);
            const unsigned this_bits = L::bits(L::at_least(all, squared, softness + L::set(record.squared_softness)));
            const unsigned all_bits = L::bits(L::at_least(all, squared, softness + L::set(record.reach)));
            count.of_this += static_cast<std::size_t>(__builtin_ctz(~this_bits | 1u << W));
            if (count.of_all == k) count.of_all += static_cast<std::size_t>(__builtin_ctz(~all_bits | 1u << W));
        }
        const std::size_t waiting = last - first;
        return {count.of_this < waiting ? count.of_this : waiting, count.of_all < waiting ? count.of_all : waiting};
    }

    // The open pixels of block b in which too little light is left.
    [[gnu::always_inline]] inline unsigned dark_pixels(int b, const T* light) const {
        unsigned dark = 0;
        for (int part = 0; part < num_parts; ++part) {
            const Real here = L::load(light + part * W);
            dark |= L::bits(L::less(L::from_bits(~0u), here, L::set(tile_.min_transmittance))) << (part * W);
        }
        return dark & tile_.alive[b];
    }

    // Finishes the pixels of block b that are dark behind the final fragments, those before place `next`; returns the
    // pixels that are open.
    [[gnu::always_inline]] inline unsigned open_pixels_behind(int b, std::size_t next, std::size_t tail) {
        // The light behind all is the least: where it is enough, nothing else is asked for.
        if (dark_pixels(b, soft_.light[b]) == 0) return tile_.alive[b];
        unsigned finished =
            next < tail ? dark_pixels(b, slots_[entries_[next].slot].before) : dark_pixels(b, soft_.light[b]);
        if (finished != 0) {
            // What waits and is seen may still be hidden in part by what comes.
            for (std::size_t k = next; k < tail; ++k) finished &= ~static_cast<unsigned>(entries_[k].shown);
            finish_pixels(tile_, b, finished);
        }
        return tile_.alive[b];
    }

    // Puts the fragments of a record at place `tail` of the queue of block b.
    [[gnu::always_inline]] inline void append(const SoftRecord<T>& record, const BlockFragments<T>& fragments,
                                              std::size_t tail, unsigned pixels, const Real (&alpha)[num_parts],
                                              const Real (&front)[num_parts], const Real (&seen)[num_parts]) {
        const int b = fragments.b;
        const std::uint32_t slot_id = free_slots_[--num_free_];
        FragmentSlot<T>& slot = slots_[slot_id];
        unsigned last = 0, shown = 0;
        for (int part = 0; part < num_parts; ++part) {
            const int lane = part * W;
            const auto all = L::from_bits(~0u);
            const Real left = front[part] - front[part] * alpha[part];
            const auto kept = L::at_least(all, left, L::set(tile_.min_transmittance));
            shown |= (L::bits(kept) << lane) & pixels;
            const Real before = L::load(soft_.light[b] + lane), after = before - before * alpha[part];
            L::store(soft_.light[b] + lane, after);
            L::store(slot.alpha + lane, alpha[part]);
            L::store(slot.weight + lane, L::where(kept, seen[part] * alpha[part]));
            L::store(slot.before + lane, before);
            if constexpr (has_shades)
                L::store(shades_ + kBlockPixels * slot_id + lane, L::load(fragments.shades + lane));
            if constexpr (has_relief)
                L::store(heights_ + kBlockPixels * slot_id + lane, L::load(fragments.heights + lane));
            last |= L::bits(L::less(all, after, L::set(static_cast<T>(kLeastLight)))) << lane;
        }
        entries_[tail] = {slot_id, record.id, static_cast<std::uint16_t>(pixels), static_cast<std::uint16_t>(shown)};
        depths_[tail] = record.depth;
        squared_softness_[tail] = record.squared_softness;
        if (last != 0) finish_pixels(tile_, b, last);
    }

    // Adds the `count` fragments from place `first` on, of block b, to the sums, and frees their slots.
    [[gnu::always_inline]] inline void retire(int b, std::size_t first, std::size_t count) {
        const FragmentEntry* const entries = entries_ + first;
        const FragmentSlot<T>* const slots = slots_;
        for (int part = 0; part < num_parts; ++part) {
            const int lane = part * W;
            Real planes[Tile::num_planes];
            for (int k = 0; k < Tile::num_planes; ++k) planes[k] = L::load(tile_.plane(k, b) + lane);
            Real sum = L::load(soft_.weights[b] + lane), light = L::load(tile_.light(b) + lane);
            for (std::size_t k = 0; k < count; ++k) {
                const FragmentSlot<T>& slot = slots[entries[k].slot];
                const Record<T>& record = records_[entries[k].record];
                const Real weight = L::load(slot.weight + lane);
                Real of_color = weight;
                if constexpr (has_shades) of_color = weight * L::load(shades_ + kBlockPixels * entries[k].slot + lane);
                for (int c = 0; c < 3; ++c) planes[c] = planes[c] + of_color * L::set(record.color[c]);
                for (int c = 0; c < channels; ++c)
                    planes[3 + c] = planes[3 + c] + weight * L::set(attributes_.of(entries[k].record, c));
                if constexpr (has_relief)
                    planes[3 + channels] =
                        planes[3 + channels] + weight * L::load(heights_ + kBlockPixels * entries[k].slot + lane);
                sum = sum + weight;
                const auto shown = L::less(L::from_bits(~0u), L::set(0), weight);
                light = L::select(shown, light - light * L::load(slot.alpha + lane), light);
            }
            for (int k = 0; k < Tile::num_planes; ++k) L::store(tile_.plane(k, b) + lane, planes[k]);
            L::store(soft_.weights[b] + lane, sum);
            L::store(tile_.light(b) + lane, light);
        }
        for (std::size_t k = 0; k < count; ++k) free_slots_[num_free_++] = entries[k].slot;
    }

    const Record<T>* const records_;
    const Attributes<T, channels> attributes_;
    SoftQueues<T>& queues_;
    SoftState<T>& soft_;
    Tile& tile_;
    // Copied from `queues_`.
    FragmentSlot<T>* slots_;
    T* shades_;
    T* heights_;
    std::uint32_t* free_slots_;
    FragmentEntry* entries_;
    T* depths_;
    T* squared_softness_;
    std::size_t num_free_, queue_size_;
};

}  // namespace brushgs::BRUSHGS_ISA
