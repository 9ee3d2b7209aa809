// Memory of the soft order: the fragments of a tile that later ones may still change.
//
// The records of which fragments may wait have places, in stroke order. Each 4 x 4 block of pixels has a queue: a bit
// for each place, set where a fragment of that record waits in the block. Each such fragment has a slot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "brushgs/raster.hpp"
#include "brushgs/soft_crowd.hpp"

namespace brushgs {

// If more fragments of a block wait, the tile is a crowd, see soft_crowd.hpp: the cost of a fragment grows with the
// length of its queue.
constexpr std::size_t kMostWaiting = 256;

template <class T>
struct alignas(64) FragmentSlot {
    T alpha[16];   // 0 in pixels without the fragment
    T weight[16];  // alpha times the light that reaches it, as far as known; 0 in pixels that are finished before
    T before[16];  // the light that passes all fragments in front of it in stroke order
};

struct FragmentEntry {
    std::uint32_t slot;
    std::uint16_t pixels;  // bit p: whether pixel p of the block has the fragment
    std::uint16_t shown;   // those in which it is seen: some light reaches it
};

// A bound on a record of a tile and all behind it. Two records reach each other within the root of the sum of their
// squared softness, which is at most the sum of their softness: so one with depth + softness <= `begin` is in front of
// all of them, however large the softness of a stroke far behind.
template <class T>
struct SoftBehind {
    T squared_softness;  // the largest
    T begin;             // the least depth - softness
};

constexpr std::size_t kWordPlaces = 64;  // places whose bits make one word

// Kept by each thread from tile to tile.
template <class T>
struct SoftQueues {
    static constexpr std::size_t num_queues = kTileWidth * kTileHeight / 16;
    std::unique_ptr<FragmentSlot<T>[]> slot_memory;
    std::unique_ptr<std::uint32_t[]> free_memory;
    std::unique_ptr<FragmentEntry[]> entry_memory;
    std::unique_ptr<std::uint64_t[]> waiting_memory;
    std::unique_ptr<T[]> column_memory, shade_memory, height_memory, begin_memory;
    std::unique_ptr<SoftBehind<T>[]> behind_memory;
    std::unique_ptr<std::uint32_t[]> record_memory;
    FragmentSlot<T>* slots = nullptr;     // [num_slots]
    T* shades = nullptr;                  // [num_slots, num_shades, 16] factors of the color, or colors; or null
    T* heights = nullptr;                 // [num_slots, 16] heights of the paint, pixels; null unless they are kept
    std::uint32_t* free_slots = nullptr;  // [num_slots] the first num_free are free, the last of them next
    FragmentEntry* entries = nullptr;     // [num_places, num_queues]
    std::uint64_t* waiting = nullptr;     // [num_queues, num_words] bit p % 64 of word p / 64 is that of place p
    std::uint64_t* reached = nullptr;     // [num_words] records within reach of the latest
    std::uint64_t* open = nullptr;        // [num_words] records not wholly in front of the latest and all behind it
    std::uint32_t* records = nullptr;     // [num_places]
    T* depths = nullptr;                  // [num_places] camera z
    T* squared_softness = nullptr;        // [num_places]
    T* ends = nullptr;                    // [num_places] depth + softness
    T* shares = nullptr;                  // [num_places] share that those within reach hide of the latest record
    SoftBehind<T>* behind = nullptr;      // [num_ids of a tile + 1]
    T* begins = nullptr;                  // [num_ids of a tile + 1, num_queues] `begin` of the strokes of each block
    std::size_t num_slots = 0, num_free = 0, num_places = 0, num_words = 0, num_behind = 0;
    int num_shades = 0;  // of a slot: 0 for none, 1 for a factor, 3 for a color
    bool keeps_heights = false;
    bool is_crowd = false;  // of the tile: set where more than kMostWaiting wait
    Crowd<T> crowd;
};

// These allocate, in soft_queues.cpp: a kernel's file would compile the library's templates for its instruction set.

// Doubles the slots.
template <class T>
void add_slots(SoftQueues<T>& queues);

// Doubles the places.
template <class T>
void add_places(SoftQueues<T>& queues);

// Drops the first `count` of the `used` places, which are empty: all others move to the front.
template <class T>
void drop_places(SoftQueues<T>& queues, std::size_t count, std::size_t used);

// How many shades slots have, and whether heights, from now on; none may be in use.
template <class T>
void keep_shades(SoftQueues<T>& queues, int num_shades);
template <class T>
void keep_heights(SoftQueues<T>& queues, bool keeps);

// Makes room for `count` bounds.
template <class T>
void make_behind(SoftQueues<T>& queues, std::size_t count);

}  // namespace brushgs
