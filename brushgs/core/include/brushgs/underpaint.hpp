// The order of strokes and their underpaint within a tile: by depth, without a list of both.
//
// Strokes come in the order of the tile's list. The underpaint of a stroke waits in a heap until the strokes in front
// of it are painted; so a tile that is finished early sorts no more than it paints. Compiled once per instruction set,
// see CMakeLists.txt.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

// Whether the pixels of a record overlap a tile. Only if they do may it be sampled there.
template <class T>
[[gnu::always_inline]] inline bool reaches_tile(const Record<T>& record, int x0, int y0) {
    return record.left < x0 + kTileWidth && record.right >= x0 && record.top < y0 + kTileHeight && record.bottom >= y0;
}

// Depth of the underpaint of box `id`, at most the largest number.
template <class T>
[[gnu::always_inline]] inline double underpaint_depth(const BoxView<T>& boxes, std::uint32_t id) {
    const double depth = static_cast<double>(boxes.depths[id]) + static_cast<double>(boxes.underpaint.setbacks[id]);
    return depth < __DBL_MAX__ ? depth : __DBL_MAX__;
}

// The underpaint that waits: a binary heap, nearest first, ties by place in the list.
template <class T>
class UnderpaintHeap {
public:
    [[gnu::always_inline]] inline explicit UnderpaintHeap(const TileTask<T>& task) : heap_(task.waiting) {}

    bool is_empty() const { return count_ == 0; }
    double nearest() const { return heap_[0].depth; }

    void add(double depth, std::uint32_t place) {
        const WaitingUnderpaint added{depth, place};
        std::size_t hole = count_++;
        for (; hole > 0 && is_before(added, heap_[(hole - 1) / 2]); hole = (hole - 1) / 2)
            heap_[hole] = heap_[(hole - 1) / 2];
        heap_[hole] = added;
    }

    // Takes the nearest away; returns its place in the list of the tile.
    std::uint32_t take() {
        const std::uint32_t place = heap_[0].place;
        const WaitingUnderpaint last = heap_[--count_];
        std::size_t hole = 0;
        for (std::size_t child = 1; child < count_; child = 2 * hole + 1) {
            child += child + 1 < count_ && is_before(heap_[child + 1], heap_[child]) ? 1 : 0;
            if (!is_before(heap_[child], last)) break;
            heap_[hole] = heap_[child];
            hole = child;
        }
        heap_[hole] = last;
        return place;
    }

private:
    static bool is_before(const WaitingUnderpaint& a, const WaitingUnderpaint& b) {
        return a.depth < b.depth || (a.depth == b.depth && a.place < b.place);
    }

    WaitingUnderpaint* heap_;
    std::size_t count_ = 0;
};

// A stroke of a tile, or its underpaint.
struct Layer {
    std::uint32_t place;  // of the stroke, in the list of the tile
    bool is_underpaint;
};

// The strokes of a tile and their underpaint, if any, nearest first, with strokes first for equal depths. Records that
// do not reach the tile are skipped.
template <class T>
class LayerOrder {
public:
    [[gnu::always_inline]] inline explicit LayerOrder(const TileTask<T>& task) : task_(task), waiting_(task) {}

    // False at the end.
    [[gnu::always_inline]] inline bool next(Layer& layer) {
        constexpr std::size_t ahead = 4;  // as `prefetch`
        while (next_ < task_.num_ids) {
            const std::uint32_t id = task_.ids[next_];
            if (!waiting_.is_empty() && waiting_.nearest() < static_cast<double>(task_.boxes.depths[id])) break;
            const auto place = static_cast<std::uint32_t>(next_++);
            if (task_.underpaints != nullptr) {
                const std::size_t soon = next_ + ahead < task_.num_ids ? next_ + ahead : place;
                __builtin_prefetch(&task_.underpaints[task_.ids[soon]]);
                if (reaches_tile(task_.underpaints[id], task_.x0, task_.y0))
                    waiting_.add(underpaint_depth(task_.boxes, id), place);
            }
            if (!reaches_tile(task_.records[id], task_.x0, task_.y0)) continue;
            layer = {place, false};
            return true;
        }
        if (waiting_.is_empty()) return false;
        layer = {waiting_.take(), true};
        return true;
    }

    // Of the strokes still to come.
    std::size_t next_place() const { return next_; }

private:
    const TileTask<T>& task_;
    UnderpaintHeap<T> waiting_;
    std::size_t next_ = 0;
};

}  // namespace brushgs::BRUSHGS_ISA
