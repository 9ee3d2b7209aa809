// Weighted sums of rows of numbers, in the order of the rows: the hot loop of stroke levels.
#pragma once

#include <cstddef>

namespace brushgs {

constexpr std::size_t kRowRun = 32;  // columns that are summed in registers; those of no whole run are slow

struct WeightedRows {
    const double* rows;  // [count, columns]
    const double* weights;
    std::size_t count, columns;
};

// Writes the sums [columns] of weights x rows.
#define BRUSHGS_DECLARE_SUM_ROWS(isa)                            \
    namespace isa {                                              \
    void sum_rows(const WeightedRows& weighted, double* result); \
    }
BRUSHGS_DECLARE_SUM_ROWS(baseline)
BRUSHGS_DECLARE_SUM_ROWS(avx2)
BRUSHGS_DECLARE_SUM_ROWS(avx512)
#undef BRUSHGS_DECLARE_SUM_ROWS

}  // namespace brushgs
