#include "brushgs/groups.hpp"

#include <algorithm>
#include <vector>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kItems = 256;       // at most: parts that threads take one by one, so that uneven ones balance
constexpr std::size_t kColumns = 16;      // summed at once
constexpr std::ptrdiff_t kRowsAhead = 8;  // prefetched: they lie anywhere in memory

// Sums `width` columns of one group, at most kColumns.
template <class T>
void sum_columns(const GroupSums<T>& query, std::size_t group, std::size_t first, std::size_t width) {
    double total = 0, sums[kColumns] = {};
    const std::int32_t* const end = query.rows + query.begins[group + 1];
    for (const std::int32_t* row = query.rows + query.begins[group]; row < end; ++row) {
        if (end - row > kRowsAhead)
            __builtin_prefetch(query.values + static_cast<std::size_t>(row[kRowsAhead]) * query.width + first);
        const T* values = query.values + static_cast<std::size_t>(*row) * query.width + first;
        const double weight = query.weights[*row];
        total += weight;
        for (std::size_t k = 0; k < width; ++k) sums[k] += weight * static_cast<double>(values[k]);
    }
    query.totals[group] = total;
    std::copy_n(sums, width, query.sums + group * query.width + first);
}

}  // namespace

void group_rows(const std::int32_t* labels, std::size_t num_rows, std::size_t num_groups, std::int32_t* rows,
                std::int64_t* begins) {
    std::fill_n(begins, num_groups + 1, 0);
    for (std::size_t i = 0; i < num_rows; ++i) ++begins[labels[i] + 1];
    for (std::size_t group = 0; group < num_groups; ++group) begins[group + 1] += begins[group];
    std::vector<std::int64_t> next(begins, begins + num_groups);
    for (std::size_t i = 0; i < num_rows; ++i)
        rows[next[static_cast<std::size_t>(labels[i])]++] = static_cast<std::int32_t>(i);
}

template <class T>
void sum_groups(const GroupSums<T>& query) {
    const std::size_t groups_per_item = query.num_groups / kItems + 1;
    const std::size_t num_items = (query.num_groups + groups_per_item - 1) / groups_per_item;
    parallel_for(num_items, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * groups_per_item, end = std::min(begin + groups_per_item, query.num_groups);
        for (std::size_t group = begin; group < end; ++group)
            for (std::size_t first = 0; first < query.width; first += kColumns)
                sum_columns(query, group, first, std::min(kColumns, query.width - first));
    });
}

template <class T>
void add_rows(const RowAddends<T>& addends) {
    const std::size_t width = addends.width, ahead = static_cast<std::size_t>(kRowsAhead);
    const auto total_of = [&](std::size_t i) {
        return addends.totals + static_cast<std::size_t>(addends.rows[i]) * width;
    };
    for (std::size_t i = 0; i < addends.num_rows; ++i) {
        if (i + ahead < addends.num_rows) __builtin_prefetch(total_of(i + ahead), 1);
        double* const total = total_of(i);
        for (std::size_t k = 0; k < width; ++k) total[k] += static_cast<double>(addends.values[i * width + k]);
    }
}

template void sum_groups<float>(const GroupSums<float>&);
template void sum_groups<double>(const GroupSums<double>&);
template void add_rows<float>(const RowAddends<float>&);
template void add_rows<double>(const RowAddends<double>&);

}  // namespace brushgs
