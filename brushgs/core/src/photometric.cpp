// The order of work of the loss: rows of windows, rows of pixels. The loops are in photometric_kernel.cpp.
#include "brushgs/photometric.hpp"

#include <algorithm>
#include <vector>

#include "brushgs/cpu.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsAtATime = 8;  // that a thread takes: neighbors read the same pixels

// Calls `work(row)` for all rows and returns the sum of the results, in the order of rows.
template <class Work>
double sum_over_rows(int count, int num_threads, const Work& work) {
    const auto rows = static_cast<std::size_t>(count);
    std::vector<double> sums(rows);
    parallel_for((rows + kRowsAtATime - 1) / kRowsAtATime, num_threads, [&](std::size_t part) {
        const std::size_t first = part * kRowsAtATime;
        for (std::size_t row = first; row < std::min(first + kRowsAtATime, rows); ++row)
            sums[row] = work(static_cast<int>(row));
    });
    double sum = 0;
    for (const double of_row : sums) sum += of_row;
    return sum;
}

}  // namespace

template <class T>
double photometric(const PhotometricParams<T>& params) {
    const auto compare_windows = BRUSHGS_KERNEL(compare_windows, T);
    const auto differentiate_pixels = BRUSHGS_KERNEL(differentiate_pixels, T);
    thread_local Scratch<T> spread_memory;
    const std::size_t spread_size = kWindowGradients * params.row_size();
    T* const spreads = spread_memory.take(static_cast<std::size_t>(params.window_rows()) * spread_size).data();
    std::vector<T> factors;
    for (int column = 0; column < params.window_columns(); ++column)
        factors.insert(factors.end(), static_cast<std::size_t>(params.channels),
                       static_cast<T>(params.factor(kWindowStride * column, params.width)));
    const double similarity = sum_over_rows(params.window_rows(), params.num_threads, [&](int row) {
        thread_local Scratch<T> memory;
        return compare_windows(params, row, factors.data(), memory.take(photometric_memory(params)).data(),
                               spreads + static_cast<std::size_t>(row) * spread_size);
    });
    const double difference = sum_over_rows(params.height, params.num_threads, [&](int row) {
        thread_local Scratch<T> memory;
        return differentiate_pixels(params, row, spreads, memory.take(params.row_size()).data());
    });
    const double dissimilarity = 0.5 * (params.num_windows() - similarity) / params.num_windows();
    return (1 - params.share) * difference / params.num_values() + params.share * dissimilarity;
}

template double photometric<float>(const PhotometricParams<float>&);
template double photometric<double>(const PhotometricParams<double>&);

}  // namespace brushgs
