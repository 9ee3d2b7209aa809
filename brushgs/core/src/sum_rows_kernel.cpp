// Compiled once per instruction set (see CMakeLists.txt): the compiler makes vectors of columns. No sum is reordered,
// so all sets give the same bits.
#include "brushgs/sum_rows.hpp"

namespace brushgs::BRUSHGS_ISA {

#ifndef BRUSHGS_IN_DOUBLE

namespace {

#ifdef __AVX2__
constexpr std::size_t kRun = kRowRun;
#else
constexpr std::size_t kRun = kRowRun / 2;  // fewer registers
#endif

}  // namespace

void sum_rows(const WeightedRows& weighted, double* result) {
    const auto [rows, weights, count, columns] = weighted;
    std::size_t j = 0;
    for (; j + kRun <= columns; j += kRun) {
        double sums[kRun] = {};
        for (std::size_t k = 0; k < count; ++k) {
            const double* const from = rows + k * columns + j;
            for (std::size_t c = 0; c < kRun; ++c) sums[c] += weights[k] * from[c];
        }
        for (std::size_t c = 0; c < kRun; ++c) result[j + c] = sums[c];
    }
    for (; j < columns; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < count; ++k) sum += weights[k] * rows[k * columns + j];
        result[j] = sum;
    }
}

#endif

}  // namespace brushgs::BRUSHGS_ISA
