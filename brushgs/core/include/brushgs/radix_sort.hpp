// Sorting of many short entries by an integer key, in threads.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "brushgs/cpu.hpp"

namespace brushgs {

constexpr int kMaxDigitBits = 12;  // 4096 buckets stay in the cache

// Half-open range `item` of `count` entries in `num_items` parts of nearly equal size.
struct Range {
    std::size_t begin, end;
};
inline Range part_of(std::size_t count, std::size_t item, std::size_t num_items) {
    return {count * item / num_items, count * (item + 1) / num_items};
}

// One stable pass of the radix sort, by `digit_bits` of key - smallest from bit `shift` on.
template <class Entry>
void radix_pass(std::span<const Entry> from, std::span<Entry> to, typename Entry::Key smallest, int shift,
                int digit_bits, int num_threads) {
    const auto num_parts = static_cast<std::size_t>(num_threads);
    const std::size_t num_digits = std::size_t{1} << digit_bits;
    const auto digit_of = [=](const Entry& entry) {
        return static_cast<std::size_t>((entry.key - smallest) >> shift) & (num_digits - 1);
    };
    std::vector<std::uint32_t> starts(num_parts * num_digits);  // counts first
    parallel_for(num_parts, num_threads, [&](std::size_t part) {
        std::uint32_t* counts = starts.data() + part * num_digits;
        const Range range = part_of(from.size(), part, num_parts);
        for (std::size_t i = range.begin; i < range.end; ++i) ++counts[digit_of(from[i])];
    });
    std::uint32_t start = 0;
    for (std::size_t digit = 0; digit < num_digits; ++digit)
        for (std::size_t part = 0; part < num_parts; ++part)
            start += std::exchange(starts[part * num_digits + digit], start);
    parallel_for(num_parts, num_threads, [&](std::size_t part) {
        std::uint32_t* next = starts.data() + part * num_digits;
        const Range range = part_of(from.size(), part, num_parts);
        for (std::size_t i = range.begin; i < range.end; ++i) to[next[digit_of(from[i])]++] = from[i];
    });
}

// Stable sort by key; returns the half of memory with the sorted entries.
template <class Entry>
std::span<const Entry> radix_sort(std::span<Entry> entries, std::span<Entry> other, int num_threads) {
    if (entries.empty()) return entries;
    const auto [low, high] = std::ranges::minmax_element(entries, {}, &Entry::key);
    const auto smallest = low->key;  // subtracted: keys of one scene share their leading bits
    const int key_bits = static_cast<int>(std::bit_width(high->key - smallest));
    const int num_passes = (key_bits + kMaxDigitBits - 1) / kMaxDigitBits;
    for (int pass = 0; pass < num_passes; ++pass) {
        const int shift = key_bits * pass / num_passes, next_shift = key_bits * (pass + 1) / num_passes;
        radix_pass<Entry>(entries, other, smallest, shift, next_shift - shift, num_threads);
        std::swap(entries, other);
    }
    return entries;
}

}  // namespace brushgs
