// Memory of the soft order: the fragments of a tile that later ones may still change.
//
// Each 4 x 4 block of pixels has a queue for its own fragments, in stroke order: places b * queue_size + heads[b] to
// b * queue_size + tails[b] of the columns. Each fragment of a block has a slot, which it keeps while its queue moves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "brushgs/raster.hpp"
#include "brushgs/soft_crowd.hpp"

namespace brushgs {

// Where more fragments of a block wait, the tile is a crowd, see soft_crowd.hpp: each fragment costs as much as its
// queue is long.
constexpr std::size_t kMostWaiting = 64;

template <class T>
struct alignas(64) FragmentSlot {
    T alpha[16];   // 0 in pixels without the fragment
    T weight[16];  // alpha times the light that reaches it, as far as known; 0 in pixels that are finished before
    T before[16];  // the light that passes all fragments in front of it in stroke order
};

struct FragmentEntry {
    std::uint32_t slot, record;
    std::uint16_t pixels;  // bit p: whether pixel p of the block has the fragment
    std::uint16_t shown;   // those in which it is seen: some light reaches it
};

// Kept by each thread from tile to tile.
template <class T>
struct SoftQueues {
    static constexpr std::size_t num_queues = kTileWidth * kTileHeight / 16;
    static constexpr std::size_t room_behind = 16;  // of the columns that are read by vectors
    std::unique_ptr<FragmentSlot<T>[]> slot_memory;
    std::unique_ptr<std::uint32_t[]> free_memory;
    std::unique_ptr<FragmentEntry[]> entry_memory;
    std::unique_ptr<T[]> depth_memory, softness_memory, reach_memory, shade_memory, height_memory;
    FragmentSlot<T>* slots = nullptr;     // [num_slots]
    T* shades = nullptr;                  // [num_slots, 16] factors of the colour; null unless they are kept
    T* heights = nullptr;                 // [num_slots, 16] heights of the paint, pixels; null unless they are kept
    std::uint32_t* free_slots = nullptr;  // [num_slots] the first num_free are free, the last of them next
    FragmentEntry* entries = nullptr;     // [num_queues, queue_size]
    T* depths = nullptr;                  // [num_queues, queue_size] camera z
    T* squared_softness = nullptr;        // [num_queues, queue_size]
    T* reaches = nullptr;                 // [num_ids of a tile + 1] the largest squared softness from there on
    std::size_t num_slots = 0, num_free = 0, queue_size = 0, num_reaches = 0;
    std::size_t heads[num_queues] = {}, tails[num_queues] = {};
    bool keeps_shades = false, keeps_heights = false;
    bool is_crowd = false;  // of the tile: set where more than kMostWaiting wait
    Crowd<T> crowd;
};

// These allocate, in soft_queues.cpp: a kernel's file would compile the library's templates for its instruction set.

// Doubles the slots.
template <class T>
void add_slots(SoftQueues<T>& queues);

// Doubles the room of every queue.
template <class T>
void lengthen_queues(SoftQueues<T>& queues);

// Whether slots have shades, and heights, from now on; none may be in use.
template <class T>
void keep_shades(SoftQueues<T>& queues, bool keeps);
template <class T>
void keep_heights(SoftQueues<T>& queues, bool keeps);

// Makes room for `count` reaches.
template <class T>
void make_reaches(SoftQueues<T>& queues, std::size_t count);

}  // namespace brushgs
