// Rows with labels -> the rows of each label, and sums over them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// Writes the rows of label 0, of label 1 and so on, each ascending.
void group_rows(const std::int32_t* labels,  // [num_rows], each in [0, num_groups)
                std::size_t num_rows, std::size_t num_groups,
                std::int32_t* rows,     // [num_rows]
                std::int64_t* begins);  // [num_groups + 1] where the rows of each label begin

template <class T>
struct GroupSums {
    const T* values;             // [num_rows, width]
    const double* weights;       // [num_rows]
    const std::int32_t* rows;    // as `group_rows` writes them
    const std::int64_t* begins;  //
    std::size_t num_groups;
    std::size_t width;
    int num_threads;
    double* totals;  // [num_groups] sums of the weights
    double* sums;    // [num_groups, width] sums of weight x value
};

// Sums in the order of the rows: they do not depend on `num_threads`, bit for bit.
template <class T>
void sum_groups(const GroupSums<T>& query);

template <class T>
struct RowAddends {
    const T* values;           // [num_rows, width]
    const std::int32_t* rows;  // [num_rows] of `totals` that they belong to
    std::size_t num_rows;
    std::size_t width;
    double* totals;  // [any, width], which grow by the values
};

// Adds in order.
template <class T>
void add_rows(const RowAddends<T>& addends);

}  // namespace brushgs
