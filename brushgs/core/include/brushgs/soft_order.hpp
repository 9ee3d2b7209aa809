// The soft order: strokes fade into each other where their depths are close. Defined by brushgs/rendering/reference.py.
//
// A fragment is final once its depth differs from the next record's by more than the reach of their softness: it is
// retired into the sums, in stroke order, like sorted strokes. The others wait in the queue of their block, all its
// pixels together. Underpaint that no stroke behind reaches in its block is final at once, and never queued: that is
// the greater part of all underpaint. Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "brushgs/soft_queues.hpp"
#include "brushgs/tile_state.hpp"

namespace brushgs::BRUSHGS_ISA {

constexpr std::size_t kRetiredAtOnce = 6;  // fewer are left waiting: sums are loaded and stored once for all

// Painters in soft order take long to compile, so one serves pictures with and without layers and height.
template <class T>
using SoftTile = TileState<T, kMostChannels, true>;

// The planes of a tile in use.
template <class T>
[[gnu::always_inline]] inline int num_soft_planes(const TileTask<T>& task, const SoftQueues<T>& queues) {
    return queues.keeps_heights ? SoftTile<T>::num_planes : 3 + task.boxes.layers.count;
}

// The data of a tile besides `SoftTile`, whose `transmittance` is here that of the visible retired fragments.
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
    if (queues.num_words > 0)
        __builtin_memset(queues.waiting, 0, SoftQueues<T>::num_queues * queues.num_words * sizeof *queues.waiting);
    if (queues.num_free == queues.num_slots) return;
    queues.num_free = 0;  // an error left slots in use
    for (std::size_t slot = queues.num_slots; slot > 0; --slot)
        queues.free_slots[queues.num_free++] = static_cast<std::uint32_t>(slot - 1);
}

// The share of a fragment that is hidden by another, nearer by x times the reach of both, 0 <= x <= 1: from half to
// all.
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
    T end;               // depth + softness
    SoftBehind<T> behind;
    // Of underpaint, else null: [kNumBlocks] the least depth - softness of the strokes behind it in each block. Other
    // underpaint does not reach it, but may reach a stroke.
    const T* begins;
};

// What a record is at the pixels of a tile.
template <class T, Shading stored>
struct SoftSamples {
    SoftRecord<T> record;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    alignas(64) T shades[stored == Shading::tints ? 3 : 1][stored == Shading::none ? 1 : kNumBlocks][kBlockPixels];
    alignas(64) T heights[kNumBlocks][kBlockPixels];  // where they are kept
    std::uint16_t pixels[kNumBlocks];
    std::uint32_t blocks;
    bool has_one_shade, has_one_height;  // of all pixels: those of block 0 are those of all blocks

    [[gnu::always_inline]] inline const T* shades_of(int b) const {
        return shades[0][stored == Shading::none || has_one_shade ? 0 : b];
    }
    [[gnu::always_inline]] inline const T* heights_of(int b) const { return heights[has_one_height ? 0 : b]; }
};

// Its fragments in one block of the tile.
template <class T>
struct BlockFragments {
    int b;
    const T* alphas;   // [kBlockPixels]
    const T* shades;   // [kBlockPixels] as `Shading` says, where they are kept; of further channels a tile behind each
    const T* heights;  // [kBlockPixels] heights of the paint, where they are kept
    unsigned pixels;   // bit p: whether pixel p has one
};

// Blends the records of one tile. All its functions are inlined, so that its fields live in registers: where the
// columns of the queues lie is copied here because vector stores may touch any memory, and each field behind a
// reference would be read anew after each of them.
template <class T, Shading stored>
class SoftBlender {
    using L = Lanes<T>;
    using Real = typename L::Real;
    using Tile = SoftTile<T>;
    static constexpr int W = L::width, num_parts = kBlockPixels / W;
    static constexpr unsigned kAllLanes = (1u << W) - 1;

public:
    [[gnu::always_inline]] inline SoftBlender(const TileTask<T>& task, SoftQueues<T>& queues, SoftState<T>& soft,
                                              Tile& tile)
        : records_(task.records),
          layers_(task.boxes.layers),
          num_planes_(num_soft_planes(task, queues)),
          queues_(queues),
          soft_(soft),
          tile_(tile) {
        copy_columns();
        num_free_ = queues.num_free;
        num_places_ = queues.num_places < kWordPlaces ? queues.num_places : kWordPlaces;
    }

    // Begins a record: gives it a place, and finds which records with places are within reach of it, and which are
    // final. That is the same in all blocks of the tile: with a queue of bits, a block needs a single `and`. Pictures
    // of 7000 strokes take 5 to 7 % less so than with a search in each block.
    [[gnu::always_inline]] inline void begin(const SoftRecord<T>& record) {
        if (num_used_ == num_places_) make_place();
        constexpr auto width = static_cast<std::size_t>(W);
        std::size_t first_open = num_used_;
        for (std::size_t w = num_words_; w-- > 0;) {
            std::uint64_t reached = 0, open = 0;
            const std::size_t start = w * kWordPlaces,
                              end = start + kWordPlaces < num_used_ ? start + kWordPlaces : num_used_;
            for (std::size_t k = first_open_ > start ? (first_open_ - start) / width * width : 0; start + k < end;
                 k += width) {
                const std::size_t place = start + k;
                const Real gap = L::set(record.depth) - L::load(depths_ + place), squared = gap * gap;
                const Real softness = L::load(squared_softness_ + place);
                const auto all = L::from_bits(~0u);
                const auto is_in_front = L::at_least(all, squared, softness + L::set(record.squared_softness));
                const auto by_largest = L::at_least(all, squared, softness + L::set(record.behind.squared_softness));
                const auto by_nearest = L::at_least(all, L::set(record.behind.begin), L::load(ends_ + place));
                reached |= static_cast<std::uint64_t>(~L::bits(is_in_front) & kAllLanes) << k;
                open |= static_cast<std::uint64_t>(~(L::bits(by_largest) | L::bits(by_nearest)) & kAllLanes) << k;
            }
            if (end < start + kWordPlaces) {
                const std::uint64_t used = end > start ? (std::uint64_t{1} << (end - start)) - 1 : 0;
                reached &= used, open &= used;
            }
            reached_[w] = reached;
            for (std::uint64_t rest = reached; rest != 0; rest &= rest - 1)
                find_share(record, start + static_cast<std::size_t>(__builtin_ctzll(rest)));
            open_[w] = open;
            if (open != 0) first_open = start + static_cast<std::size_t>(__builtin_ctzll(open));
        }
        first_open_ = first_open;
        own_ = num_used_++;
        depths_[own_] = record.depth;
        squared_softness_[own_] = record.squared_softness;
        ends_[own_] = record.end;
        row_records_[own_] = record.id;
        num_begun_ = own_ / kWordPlaces + 1;
        final_blocks_ = 0;
        if (record.begins == nullptr) return;
        for (int b = 0; b < kNumBlocks; b += W) {
            const auto is_final = L::at_least(L::from_bits(~0u), L::load(record.begins + b), L::set(record.end));
            final_blocks_ |= static_cast<std::uint32_t>(L::bits(is_final)) << b;
        }
    }

    // Adds the fragments of the current record, in one block, to its queue, or if they are final to the sums, and
    // updates how they and waiting fragments hide each other; false if too many wait.
    [[gnu::always_inline]] inline bool blend(const BlockFragments<T>& fragments) {
        if ((final_blocks_ >> fragments.b & 1) != 0) {
            blend_final(fragments);
            return true;
        }
        const int b = fragments.b;
        std::uint64_t* const queue = queue_of(b);
        std::size_t num_waiting = retired_early_[b], num_final = 0;
        std::uint64_t before_open = ~std::uint64_t{0};
        for (std::size_t w = 0; w < num_begun_; ++w) {
            const std::uint64_t open = queue[w] & open_[w];
            num_final += count_bits(queue[w] & (open - 1) & ~open & before_open);
            num_waiting += count_bits(queue[w]);
            if (open != 0) before_open = 0;
        }
        if (num_final + retired_early_[b] >= kRetiredAtOnce) {
            retire(b, num_final);
            num_waiting -= num_final + retired_early_[b];
            retired_early_[b] = 0;
        }
        const unsigned pixels = fragments.pixels & open_pixels_behind(b);
        if (pixels == 0) return true;
        if (num_waiting >= kMostWaiting) {
            queues_.num_free = num_free_;
            return false;
        }
        if (num_free_ == 0) {
            queues_.num_free = num_free_;
            add_slots(queues_);
            copy_columns();
            num_free_ = queues_.num_free;
        }

        Real alpha[num_parts], front[num_parts], seen[num_parts];
        meet(fragments, pixels, alpha, front, seen);
        append(fragments, pixels, alpha, front, seen);
        return true;
    }

    // Of some blocks those in which the current record is final at once and none waits for later ones.
    [[gnu::always_inline]] inline std::uint32_t plain_blocks(std::uint32_t blocks) const {
        std::uint32_t plain = blocks &= final_blocks_;
        for (; blocks != 0; blocks &= blocks - 1) {
            const int b = __builtin_ctz(blocks);
            std::uint64_t open = 0;
            for (std::size_t w = 0; w < num_begun_; ++w) open |= queue_of(b)[w] & open_[w];
            plain &= ~((open != 0 ? 1u : 0u) << b);
        }
        return plain;
    }

    // Blends the fragments of the current record in such a block: as in depth order.
    [[gnu::always_inline]] inline void blend_plainly(const BlockFragments<T>& fragments) {
        const int b = fragments.b;
        Real alpha[num_parts], light[num_parts];
        for (int part = 0; part < num_parts; ++part) {
            alpha[part] = L::load(fragments.alphas + part * W);
            light[part] = L::load(soft_.light[b] + part * W);
        }
        finish_pixels(tile_, b, add_final(fragments, alpha, light, light));
    }

    // Retires all waiting fragments. Where fragments overlapped in depth, their weights are scaled to the alpha of the
    // pixel.
    [[gnu::always_inline]] inline void finish() {
        for (int b = 0; b < kNumBlocks; ++b) {
            if (const std::size_t count = count_before(b, num_used_); count > 0) retire(b, count);
            if (soft_.shared[b] == 0) continue;
            for (int lane = 0; lane < kBlockPixels; lane += W) {
                const Real weights = L::load(soft_.weights[b] + lane);  // 0 where none leaves enough light to be seen
                const auto shared = L::at_least(L::from_bits(static_cast<unsigned>(soft_.shared[b]) >> lane), weights,
                                                L::set(std::numeric_limits<T>::min()));
                const Real alpha = L::set(1) - L::load(tile_.light(b) + lane);
                const Real factor = L::select(shared, alpha / weights, L::set(1));
                for (int k = 0; k < num_planes_; ++k) {
                    T* const plane = tile_.plane(k, b) + lane;
                    L::store(plane, L::load(plane) * factor);
                }
            }
        }
        queues_.num_free = num_free_;
    }

private:
    // What is summed up at the pixels of a vector.
    struct Sums {
        Real planes[Tile::num_planes], weights, light;

        [[gnu::always_inline]] inline Sums(const SoftBlender& of, int b, int lane)
            : weights(L::load(of.soft_.weights[b] + lane)), light(L::load(of.tile_.light(b) + lane)) {
            for (int k = 0; k < Tile::num_planes; ++k)
                if (of.uses_plane(k)) planes[k] = L::load(of.tile_.plane(k, b) + lane);
        }
        [[gnu::always_inline]] inline void store(const SoftBlender& of, int b, int lane) const {
            for (int k = 0; k < Tile::num_planes; ++k)
                if (of.uses_plane(k)) L::store(of.tile_.plane(k, b) + lane, planes[k]);
            L::store(of.soft_.weights[b] + lane, weights);
            L::store(of.tile_.light(b) + lane, light);
        }
        // A fragment of record `id`; its further shades lie `step` behind the first.
        [[gnu::always_inline]] inline void add(const SoftBlender& of, std::uint32_t id, Real alpha, Real weight,
                                               const T* shades, std::size_t step, const T* heights) {
            const Record<T>& record = of.records_[id];
            Real of_color = weight;
            if constexpr (stored == Shading::streaks) of_color = weight * L::load(shades);
            for (std::size_t c = 0; c < 3; ++c) {
                if constexpr (stored == Shading::tints)
                    planes[c] = planes[c] + weight * L::load(shades + c * step);
                else
                    planes[c] = planes[c] + of_color * L::set(record.color[c]);
            }
            for (int c = 0; c < of.layers_.count; ++c) {
                const Channel<const T> channel = of.layers_.channels[c];
                planes[3 + c] = planes[3 + c] + weight * L::set(channel.values[id * channel.stride]);
            }
            if (of.heights_ != nullptr)
                planes[Tile::num_planes - 1] = planes[Tile::num_planes - 1] + weight * L::load(heights);
            weights = weights + weight;
            const auto shown = L::less(L::from_bits(~0u), L::set(0), weight);
            light = L::select(shown, light - light * alpha, light);
        }
    };
    // Plane k of a tile: color, layers, height.
    [[gnu::always_inline]] inline bool uses_plane(int k) const {
        return k < 3 || (k == Tile::num_planes - 1 ? heights_ != nullptr : k - 3 < layers_.count);
    }

    [[gnu::always_inline]] inline void copy_columns() {
        slots_ = queues_.slots, shades_ = queues_.shades, heights_ = queues_.heights, free_slots_ = queues_.free_slots;
        entries_ = queues_.entries, waiting_ = queues_.waiting, reached_ = queues_.reached, open_ = queues_.open;
        row_records_ = queues_.records, depths_ = queues_.depths, squared_softness_ = queues_.squared_softness;
        ends_ = queues_.ends, shares_ = queues_.shares;
        num_words_ = queues_.num_words;
    }

    [[gnu::always_inline]] inline std::uint64_t* queue_of(int b) const {
        return waiting_ + static_cast<std::size_t>(b) * num_words_;
    }
    [[gnu::always_inline]] inline FragmentEntry& entry_of(std::size_t place, int b) const {
        return entries_[place * static_cast<std::size_t>(kNumBlocks) + static_cast<std::size_t>(b)];
    }
    [[gnu::always_inline]] inline T* shades_of(std::uint32_t slot, int c) const {
        return shades_ +
               kBlockPixels * (num_shades(stored) * static_cast<std::size_t>(slot) + static_cast<std::size_t>(c));
    }
    [[gnu::always_inline]] static inline std::size_t count_bits(std::uint64_t bits) {
        return static_cast<std::size_t>(__builtin_popcountll(bits));
    }
    // The number of fragments of block b that wait in the places before `end`.
    [[gnu::always_inline]] inline std::size_t count_before(int b, std::size_t end) const {
        std::size_t count = 0;
        for (std::size_t w = 0; w * kWordPlaces < end; ++w) {
            const std::size_t places = end - w * kWordPlaces;
            const std::uint64_t there = places < kWordPlaces ? (std::uint64_t{1} << places) - 1 : ~std::uint64_t{0};
            count += count_bits(queue_of(b)[w] & there);
        }
        return count;
    }

    // What the record at `place` hides of one within its reach.
    [[gnu::always_inline]] inline void find_share(const SoftRecord<T>& record, std::size_t place) const {
        const T x = (record.depth - depths_[place]) / std::sqrt(record.squared_softness + squared_softness_[place]);
        shares_[place] = share_hidden(x < 1 ? x : T(1));
    }

    // If all places are used: fragments final in all blocks are retired, the others move to the front, and if they are
    // too many, more places are used. A tile begins with few, not with those that earlier ones needed: the order of
    // sums hangs on when fragments are retired.
    [[gnu::always_inline]] inline void make_place() {
        for (int b = 0; b < kNumBlocks; ++b) {
            const std::size_t count = count_before(b, first_open_);
            if (count == 0) continue;
            retire(b, count);
            retired_early_[b] += count;
        }
        if (first_open_ > 0) drop_places(queues_, first_open_, num_used_);
        num_used_ -= first_open_;
        first_open_ = 0;
        if (2 * num_used_ < num_places_) return;
        if (num_places_ == queues_.num_places) {
            add_places(queues_);
            copy_columns();
        }
        num_places_ = num_places_ == 0 ? kWordPlaces : 2 * num_places_;
    }

    // The fragments of the current record in one block and those that wait within reach of it hide each other. `front`
    // is the light behind all fragments wholly in front, `seen` that also behind those within reach.
    [[gnu::always_inline]] inline void meet(const BlockFragments<T>& fragments, unsigned pixels,
                                            Real (&alpha)[num_parts], Real (&front)[num_parts],
                                            Real (&seen)[num_parts]) {
        const int b = fragments.b;
        const std::uint64_t* const queue = queue_of(b);
        for (int part = 0; part < num_parts; ++part) {
            const auto painted = L::from_bits(pixels >> (part * W));
            alpha[part] = L::where(painted, L::load(fragments.alphas + part * W));
            front[part] = seen[part] = L::load(soft_.light[b] + part * W);
        }
        unsigned shared = 0;
        std::uint64_t behind_reached = 0;  // all ones where a word in front has a record within reach
        for (std::size_t w = 0; w < num_begun_; ++w) {
            const std::uint64_t reached = queue[w] & reached_[w];
            std::uint64_t rest = queue[w] & (behind_reached | ~((reached & (0 - reached)) - 1));
            if (reached != 0) behind_reached = ~std::uint64_t{0};
            for (; rest != 0; rest &= rest - 1) {
                const auto bit = static_cast<std::size_t>(__builtin_ctzll(rest));
                const std::size_t place = w * kWordPlaces + bit;
                const FragmentEntry entry = entry_of(place, b);
                const unsigned both = entry.pixels & pixels;
                if (both == 0) continue;
                FragmentSlot<T>& other = slots_[entry.slot];
                if ((reached >> bit & 1) == 0) {
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
                const T share = shares_[place];
                const Real hidden_here = L::set(share), hidden_there = L::set(1 - share);
                for (int part = 0; part < num_parts; ++part) {
                    const Real weight = L::load(other.weight + part * W);
                    L::store(other.weight + part * W, weight - weight * (alpha[part] * hidden_there));
                    seen[part] = seen[part] - seen[part] * (L::load(other.alpha + part * W) * hidden_here);
                }
            }
        }
        soft_.shared[b] = static_cast<std::uint16_t>(soft_.shared[b] | shared);
    }

    // Adds final fragments to the sums; returns the open pixels that are dark behind all.
    [[gnu::always_inline]] inline unsigned add_final(const BlockFragments<T>& fragments, const Real (&alpha)[num_parts],
                                                     const Real (&front)[num_parts], const Real (&seen)[num_parts]) {
        const int b = fragments.b;
        const std::uint32_t id = row_records_[own_];
        const auto all = L::from_bits(~0u);
        unsigned dark = 0, last = 0;
        for (int part = 0; part < num_parts; ++part) {
            const int lane = part * W;
            const Real left = front[part] - front[part] * alpha[part];
            const auto kept = L::at_least(all, left, L::set(tile_.min_transmittance));
            Sums sums(*this, b, lane);
            sums.add(*this, id, alpha[part], L::where(kept, seen[part] * alpha[part]), fragments.shades + lane,
                     kNumBlocks * kBlockPixels, fragments.heights + lane);
            sums.store(*this, b, lane);
            const Real before = L::load(soft_.light[b] + lane), after = before - before * alpha[part];
            L::store(soft_.light[b] + lane, after);
            dark |= L::bits(L::less(all, after, L::set(tile_.min_transmittance))) << lane;
            last |= L::bits(L::less(all, after, L::set(static_cast<T>(kLeastLight)))) << lane;
        }
        finish_pixels(tile_, b, last);
        return dark & tile_.alive[b];
    }

    // Blends fragments of the current record that are final at once, in a block where others wait.
    [[gnu::always_inline]] inline void blend_final(const BlockFragments<T>& fragments) {
        Real alpha[num_parts], front[num_parts], seen[num_parts];
        meet(fragments, fragments.pixels, alpha, front, seen);
        pass(fragments.b, alpha);
        if (add_final(fragments, alpha, front, seen) != 0) open_pixels_behind(fragments.b);
    }

    // Those that wait in block b are passed by final fragments, which are in front of all later ones and not in the
    // queue.
    [[gnu::always_inline]] inline void pass(int b, const Real (&alpha)[num_parts]) {
        for (std::size_t w = 0; w < num_begun_; ++w)
            for (std::uint64_t rest = queue_of(b)[w] & open_[w]; rest != 0; rest &= rest - 1) {
                const std::size_t place = w * kWordPlaces + static_cast<std::size_t>(__builtin_ctzll(rest));
                T* const before = slots_[entry_of(place, b).slot].before;
                for (int part = 0; part < num_parts; ++part) {
                    const Real light = L::load(before + part * W);
                    L::store(before + part * W, light - light * alpha[part]);
                }
            }
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

    // Finishes the pixels of block b that are dark behind its final fragments; returns the pixels that are open.
    [[gnu::always_inline]] inline unsigned open_pixels_behind(int b) {
        // The light behind all is the least: if it is enough, nothing else is checked.
        unsigned finished = dark_pixels(b, soft_.light[b]);
        if (finished == 0) return tile_.alive[b];
        const std::uint64_t* const queue = queue_of(b);
        std::uint64_t behind_open = 0;  // all ones where a word in front has one that is not final
        for (std::size_t w = 0; w < num_begun_; ++w) {
            const std::uint64_t open = queue[w] & open_[w];
            std::uint64_t rest = queue[w] & (behind_open | ~((open & (0 - open)) - 1));
            if (open != 0 && behind_open == 0) {
                const std::size_t place = w * kWordPlaces + static_cast<std::size_t>(__builtin_ctzll(open));
                finished = dark_pixels(b, slots_[entry_of(place, b).slot].before);
                behind_open = ~std::uint64_t{0};
            }
            // Visible waiting fragments may still be partly hidden by later ones.
            for (; rest != 0 && finished != 0; rest &= rest - 1)
                finished &= ~static_cast<unsigned>(
                    entry_of(w * kWordPlaces + static_cast<std::size_t>(__builtin_ctzll(rest)), b).shown);
        }
        if (finished != 0) finish_pixels(tile_, b, finished);
        return tile_.alive[b];
    }

    // Puts the fragments of the current record into the queue of a block.
    [[gnu::always_inline]] inline void append(const BlockFragments<T>& fragments, unsigned pixels,
                                              const Real (&alpha)[num_parts], const Real (&front)[num_parts],
                                              const Real (&seen)[num_parts]) {
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
            for (int c = 0; c < num_shades(stored); ++c)
                L::store(shades_of(slot_id, c) + lane,
                         L::load(fragments.shades + c * kNumBlocks * kBlockPixels + lane));
            if (heights_ != nullptr)
                L::store(heights_ + kBlockPixels * slot_id + lane, L::load(fragments.heights + lane));
            last |= L::bits(L::less(all, after, L::set(static_cast<T>(kLeastLight)))) << lane;
        }
        entry_of(own_, b) = {slot_id, static_cast<std::uint16_t>(pixels), static_cast<std::uint16_t>(shown)};
        queue_of(b)[own_ / kWordPlaces] |= std::uint64_t{1} << own_ % kWordPlaces;
        if (last != 0) finish_pixels(tile_, b, last);
    }

    // Adds the first `count` fragments that wait in block b to the sums, and frees their slots.
    [[gnu::always_inline]] inline void retire(int b, std::size_t count) {
        std::uint32_t slots[kMostWaiting], records[kMostWaiting];
        std::uint64_t* word = queue_of(b);
        for (std::size_t k = 0, w = 0; k < count; ++k) {
            while (word[w] == 0) ++w;
            const std::size_t place = w * kWordPlaces + static_cast<std::size_t>(__builtin_ctzll(word[w]));
            word[w] &= word[w] - 1;
            slots[k] = free_slots_[num_free_++] = entry_of(place, b).slot;
            records[k] = row_records_[place];
        }
        for (int lane = 0; lane < kBlockPixels; lane += W) {
            Sums sums(*this, b, lane);
            for (std::size_t k = 0; k < count; ++k) {
                const FragmentSlot<T>& slot = slots_[slots[k]];
                const T* const shades = stored == Shading::none ? nullptr : shades_of(slots[k], 0) + lane;
                const T* const heights = heights_ == nullptr ? nullptr : heights_ + kBlockPixels * slots[k] + lane;
                sums.add(*this, records[k], L::load(slot.alpha + lane), L::load(slot.weight + lane), shades,
                         kBlockPixels, heights);
            }
            sums.store(*this, b, lane);
        }
    }

    const Record<T>* const records_;
    const Channels<const T>& layers_;
    const int num_planes_;
    SoftQueues<T>& queues_;
    SoftState<T>& soft_;
    Tile& tile_;
    // Copied from `queues_`.
    FragmentSlot<T>* slots_;
    T* shades_;
    T* heights_;
    std::uint32_t* free_slots_;
    FragmentEntry* entries_;
    std::uint64_t* waiting_;
    std::uint64_t* reached_;
    std::uint64_t* open_;
    std::uint32_t* row_records_;
    T* depths_;
    T* squared_softness_;
    T *ends_, *shares_;
    std::size_t num_free_, num_places_, num_words_;
    std::size_t num_used_ = 0;                    // places
    std::size_t first_open_ = 0;                  // the first place of a record that is not final
    std::size_t own_ = 0;                         // the place of the record that was begun
    std::size_t num_begun_ = 0;                   // words with places that are used
    std::uint32_t final_blocks_ = 0;              // those in which it is final at once
    std::size_t retired_early_[kNumBlocks] = {};  // fragments retired to make place: they still count as waiting
};

}  // namespace brushgs::BRUSHGS_ISA
