// `project` around its kernel: picks the kernel, spreads rows over threads, sorts by depth, writes the columns.
#include "brushgs/project.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "brushgs/cpu.hpp"
#include "brushgs/project_kernel.hpp"
#include "brushgs/radix_sort.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsPerItem = 4096;     // work handed to a thread at a time, some 100 us
constexpr std::size_t kRowsPerThread = 10000;  // with fewer, starting a thread costs more than it saves
constexpr std::size_t kRowsAhead = 16;         // records prefetched: they lie anywhere in memory

// A box in the sort: positive floating-point numbers are ordered like their bits.
template <class T>
struct SortEntry {
    using Key = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    Key key;
    std::uint32_t position;  // of the record, in the order of the rows
};

template <class T>
std::size_t project_rows(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin,
                         std::size_t end, BoxRecord<T>* boxes, ProjectCounts& culled) {
    return BRUSHGS_KERNEL(project_rows, T)(gaussians, params, begin, end, boxes, culled);
}

template <class T>
BoxColumns<T> allocate(std::size_t count, bool has_softness, bool has_setbacks) {
    // Columns start on cache lines.
    constexpr std::size_t line = 64;
    const auto padded = [](std::size_t bytes) { return (bytes + line - 1) / line * line; };
    const std::size_t one = padded(count * sizeof(T)), two = padded(2 * count * sizeof(T)),
                      three = padded(3 * count * sizeof(T)), ids = padded(count * sizeof(std::int32_t));
    BoxColumns<T> columns{};
    columns.count = count;
    const std::size_t num_optional = (has_softness ? 1u : 0u) + (has_setbacks ? 1u : 0u);
    columns.memory = make_buffer<std::byte>((3 + num_optional) * one + 2 * two + three + ids);
    std::byte* next = columns.memory.get();
    const auto column = [&next](std::size_t bytes) { return std::exchange(next, next + bytes); };
    columns.centers = reinterpret_cast<T*>(column(two));
    columns.half_extents = reinterpret_cast<T*>(column(two));
    columns.angles = reinterpret_cast<T*>(column(one));
    columns.depths = reinterpret_cast<T*>(column(one));
    columns.colors = reinterpret_cast<T*>(column(three));
    columns.opacities = reinterpret_cast<T*>(column(one));
    columns.ids = reinterpret_cast<std::int32_t*>(column(ids));
    columns.softness = has_softness ? reinterpret_cast<T*>(column(one)) : nullptr;
    columns.setbacks = has_setbacks ? reinterpret_cast<T*>(column(one)) : nullptr;
    return columns;
}

template <class T>
void write_row(const BoxRecord<T>& box, std::size_t row, const BoxColumns<T>& columns) {
    std::copy_n(box.center, 2, &columns.centers[2 * row]);
    std::copy_n(box.half_extents, 2, &columns.half_extents[2 * row]);
    columns.angles[row] = box.angle;
    columns.depths[row] = box.depth;
    std::copy_n(box.color, 3, &columns.colors[3 * row]);
    columns.opacities[row] = box.opacity;
    columns.ids[row] = box.id;
}

// The reach of a Gaussian: the geometric mean of its two larger scales, world units.
template <class T>
double size_of(const T* scales) {
    const auto x = static_cast<double>(scales[0]), y = static_cast<double>(scales[1]),
               z = static_cast<double>(scales[2]);
    return std::sqrt(std::max(x, y)) * std::sqrt(std::max(std::min(x, y), z));
}

}  // namespace

template <class T>
BoxColumns<T> project(const GaussianColumns<T>& gaussians, const ProjectParams& params) {
    const std::size_t most_threads = std::max<std::size_t>(gaussians.count / kRowsPerThread, 1);
    const int num_threads = std::min(params.num_threads, static_cast<int>(most_threads));
    const std::size_t num_items = (gaussians.count + kRowsPerItem - 1) / kRowsPerItem;

    // Every item has room for all its rows, so that none waits for the counts of earlier ones.
    thread_local Scratch<BoxRecord<T>> record_memory;  // with the entries below 60 bytes a float Gaussian
    const std::span<BoxRecord<T>> records = record_memory.take(gaussians.count);
    std::vector<std::size_t> num_boxes(num_items);
    std::vector<ProjectCounts> culled(num_items);
    parallel_for(num_items, num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kRowsPerItem, end = std::min(begin + kRowsPerItem, gaussians.count);
        num_boxes[item] = project_rows(gaussians, params, begin, end, &records[begin], culled[item]);
    });

    std::vector<std::size_t> starts(num_items + 1);
    std::partial_sum(num_boxes.begin(), num_boxes.end(), starts.begin() + 1);
    thread_local Scratch<SortEntry<T>> entry_memory;
    const std::size_t count = starts.back();
    const std::span<SortEntry<T>> entries = entry_memory.take(2 * count).first(count);
    parallel_for(num_items, num_threads, [&](std::size_t item) {
        for (std::size_t i = 0; i < num_boxes[item]; ++i) {
            const std::size_t position = item * kRowsPerItem + i;
            entries[starts[item] + i] = {std::bit_cast<typename SortEntry<T>::Key>(records[position].depth),
                                         static_cast<std::uint32_t>(position)};
        }
    });
    const auto sorted = radix_sort<SortEntry<T>>(entries, {entries.data() + count, count}, num_threads);

    BoxColumns<T> columns = allocate<T>(count, params.softness > 0, params.with_setbacks);
    for (const ProjectCounts& counts : culled) {
        columns.culled.behind_near += counts.behind_near;
        columns.culled.not_finite += counts.not_finite;
        columns.culled.faint += counts.faint;
        columns.culled.outside += counts.outside;
    }
    parallel_for(num_items, num_threads, [&](std::size_t item) {
        const Range range = part_of(count, item, num_items);
        for (std::size_t row = range.begin; row < range.end; ++row) {
            const BoxRecord<T>& ahead = records[sorted[std::min(row + kRowsAhead, count - 1)].position];
            __builtin_prefetch(&ahead);
            __builtin_prefetch(&ahead.id);
            write_row(records[sorted[row].position], row, columns);
        }
        if (columns.softness == nullptr && columns.setbacks == nullptr) return;
        for (std::size_t row = range.begin; row < range.end; ++row) {
            const double size = size_of(gaussians.scales + 3 * static_cast<std::size_t>(columns.ids[row]));
            const double largest = static_cast<double>(std::numeric_limits<T>::max());
            if (columns.softness != nullptr)
                columns.softness[row] = static_cast<T>(std::min(params.softness * size, largest));
            if (columns.setbacks != nullptr) columns.setbacks[row] = static_cast<T>(std::min(size, largest));
        }
    });
    return columns;
}

template BoxColumns<float> project(const GaussianColumns<float>&, const ProjectParams&);
#ifndef BRUSHGS_ALONE
template BoxColumns<double> project(const GaussianColumns<double>&, const ProjectParams&);
#endif

}  // namespace brushgs
