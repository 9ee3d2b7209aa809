#include "brushgs/key_order.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "brushgs/radix_sort.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kKeysPerItem = 65536;  // work handed to a thread at a time, some 0.3 ms

constexpr double kMostMorton = (1 << 21) - 1;  // of a number of 21 bits

struct Entry {
    using Key = std::uint32_t;
    Key key;  // the leading bits
    std::uint32_t row;
};

// Moves the 21 low bits to every third position. Source: Morton 1966; the masks are public lore.
inline std::uint64_t spread_bits(std::uint64_t value) {
    value = (value | value << 32) & 0x1F00000000FFFF;
    value = (value | value << 16) & 0x1F0000FF0000FF;
    value = (value | value << 8) & 0x100F00F00F00F00F;
    value = (value | value << 4) & 0x10C30C30C30C30C3;
    return (value | value << 2) & 0x1249249249249249;
}

// The key of the first `width` numbers of a point, at most three.
template <class T>
std::uint64_t morton_key(const T* point, std::size_t width, const double* low, double step) {
    std::uint64_t key = 0;
    for (std::size_t axis = 0; axis < width; ++axis) {
        const double place = (static_cast<double>(point[axis]) - low[axis]) * step;
        key |= spread_bits(static_cast<std::uint64_t>(place)) << axis;
    }
    return key;
}

}  // namespace

// Three passes over the leading 32 bits sort nearly everything; runs of entries that share these are short.
Buffer<std::uint32_t> rows_by_key(const std::uint64_t* keys, std::size_t count, int num_threads) {
    auto rows = make_buffer<std::uint32_t>(count);
    if (count == 0) return rows;
    const auto [low, high] = std::minmax_element(keys, keys + count);
    const std::uint64_t smallest = *low;
    const int shift = std::max(0, static_cast<int>(std::bit_width(*high - smallest)) - 32);
    const auto memory = make_buffer<Entry>(2 * count);
    for_each_row(count, kKeysPerItem, num_threads, [&](std::size_t i) {
        memory[i] = {static_cast<std::uint32_t>((keys[i] - smallest) >> shift), static_cast<std::uint32_t>(i)};
    });
    const auto sorted = radix_sort<Entry>({memory.get(), count}, {memory.get() + count, count}, num_threads);
    for_each_row(count, kKeysPerItem, num_threads, [&](std::size_t i) { rows[i] = sorted[i].row; });
    if (shift == 0) return rows;
    const auto is_before = [=](std::uint32_t a, std::uint32_t b) {
        return keys[a] < keys[b] || (keys[a] == keys[b] && a < b);
    };
    for (std::size_t begin = 0, end; begin < count; begin = end) {
        for (end = begin + 1; end < count && sorted[end].key == sorted[begin].key; ++end) {
        }
        if (end - begin > 1) std::sort(rows.get() + begin, rows.get() + end, is_before);
    }
    return rows;
}

void keys_of(const double* values, std::size_t count, std::uint64_t* keys) {
    for (std::size_t i = 0; i < count; ++i) keys[i] = std::bit_cast<std::uint64_t>(values[i] + 0.0);  // -0 is 0
}

template <class T>
void morton_keys(const T* points, std::size_t count, const double* low, double step, int num_threads,
                 std::uint64_t* keys) {
    for_each_row(count, kKeysPerItem, num_threads,
                 [=](std::size_t i) { keys[i] = morton_key(points + 3 * i, 3, low, step); });
}

template <class T>
Buffer<std::uint32_t> rows_along_curve(const T* points, std::size_t count, std::size_t num_dimensions,
                                       int num_threads) {
    const std::size_t width = std::min<std::size_t>(num_dimensions, 3);
    double low[3] = {}, high[3] = {}, extent = 0;
    for (std::size_t axis = 0; axis < width && count > 0; ++axis) {
        low[axis] = high[axis] = static_cast<double>(points[axis]);
        for (std::size_t i = 1; i < count; ++i) {
            const auto place = static_cast<double>(points[i * num_dimensions + axis]);
            low[axis] = std::min(low[axis], place), high[axis] = std::max(high[axis], place);
        }
        extent = std::max(extent, high[axis] - low[axis]);
    }
    const double step = extent > 0 ? kMostMorton / extent : 0;
    const auto keys = make_buffer<std::uint64_t>(count);
    for_each_row(count, kKeysPerItem, num_threads,
                 [&](std::size_t i) { keys[i] = morton_key(points + i * num_dimensions, width, low, step); });
    return rows_by_key(keys.get(), count, num_threads);
}

template Buffer<std::uint32_t> rows_along_curve<float>(const float*, std::size_t, std::size_t, int);
template Buffer<std::uint32_t> rows_along_curve<double>(const double*, std::size_t, std::size_t, int);
template void morton_keys<float>(const float*, std::size_t, const double*, double, int, std::uint64_t*);
template void morton_keys<double>(const double*, std::size_t, const double*, double, int, std::uint64_t*);

}  // namespace brushgs
