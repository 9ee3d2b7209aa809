// Uninitialised memory for large arrays.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>
#include <type_traits>

#include "brushgs/cpu.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#elif defined(_WIN32)
#include <malloc.h>
#endif

namespace brushgs {

// Memory that begins at a multiple of `alignment`, as must be `size`; null on failure. Returned by `Free`: Windows has
// no aligned_alloc, and memory of its replacement is not for `free`.
inline void* allocate_aligned(std::size_t alignment, std::size_t size) noexcept {
#ifdef _WIN32
    return _aligned_malloc(size, alignment);
#else
    return std::aligned_alloc(alignment, size);
#endif
}

struct Free {
    void operator()(void* memory) const noexcept {
#ifdef _WIN32
        _aligned_free(memory);
#else
        std::free(memory);
#endif
    }
};

template <class T>
using Buffer = std::unique_ptr<T[], Free>;

// `count` values of undefined content. From 4 MiB on, pages of 2 MiB are requested: the system hands them
// out in a few steps instead of one for every 4 KiB, which otherwise costs more time than filling them.
template <class T>
Buffer<T> make_buffer(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    constexpr std::size_t huge_page = std::size_t{1} << 21, cache_line = 64;
    const std::size_t bytes = count * sizeof(T);
    const std::size_t alignment = bytes >= 2 * huge_page ? huge_page : cache_line;
    const std::size_t size = (bytes / alignment + 1) * alignment;
    void* memory = allocate_aligned(alignment, size);
    if (memory == nullptr) out_of_memory();
#ifdef MADV_HUGEPAGE
    if (alignment == huge_page) madvise(memory, size, MADV_HUGEPAGE);
#endif
    return Buffer<T>(static_cast<T*>(memory));
}

// Memory that a thread keeps from frame to frame: fresh pages from the system cost more time than the computation in
// them. Grows to the largest frame.
template <class Value>
class Scratch {
public:
    std::span<Value> take(std::size_t count) {
        if (capacity_ < count) {
            values_.reset();  // before the larger one is made
            capacity_ = 0;
            values_ = make_buffer<Value>(count);
            capacity_ = count;
        }
        return {values_.get(), count};
    }

private:
    Buffer<Value> values_;
    std::size_t capacity_ = 0;
};

}  // namespace brushgs
