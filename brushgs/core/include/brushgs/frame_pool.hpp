// Memory for frames, reused from one frame to the next.
//
// A fresh picture of 800 x 800 costs some 2500 page faults, a third of the time of painting 250 strokes on two threads.
// So a returned block is kept for the next request of the same size.
#pragma once

#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include "brushgs/memory.hpp"

namespace brushgs {

class FramePool {
public:
    // The one pool of the process; it is never destroyed, since frames may outlive everything else.
    static FramePool& instance() {
        static FramePool* pool = new FramePool;
        return *pool;
    }

    void* take(std::size_t bytes) {
        {
            const std::lock_guard lock(mutex_);
            for (auto block = kept_.begin(); block != kept_.end(); ++block) {
                if (block->bytes != bytes) continue;
                void* memory = block->memory;
                kept_.erase(block);
                return memory;
            }
        }
        return make_buffer<std::byte>(bytes).release();
    }

    void give_back(void* memory, std::size_t bytes) noexcept {
        if (bytes > kLargestKept) return Free{}(memory);
        const std::lock_guard lock(mutex_);
        if (kept_.size() == kMaxKept) {
            Free{}(kept_.front().memory);
            kept_.erase(kept_.begin());
        }
        kept_.push_back({memory, bytes});
    }

private:
    static constexpr std::size_t kMaxKept = 4;                           // color, alpha, depth and height of one frame
    static constexpr std::size_t kLargestKept = std::size_t{128} << 20;  // above, memory matters more than time

    struct Block {
        void* memory;
        std::size_t bytes;
    };
    FramePool() { kept_.reserve(kMaxKept); }  // so that give_back never allocates
    std::mutex mutex_;
    std::vector<Block> kept_;
};

}  // namespace brushgs
