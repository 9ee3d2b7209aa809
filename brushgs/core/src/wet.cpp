// The order of work of a wet layer: rows, strips of columns, and runs of pixels. The loops are in wet_kernel.cpp.
#include "brushgs/wet.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"
#include "brushgs/memory.hpp"
#include "brushgs/pixel_runs.hpp"

namespace brushgs {

namespace {

constexpr int kRows = 4;  // smoothed at once: a row is a chain of sums, each waiting for the one before
constexpr int kColumns = 64;

// Calls `work(first, end, memory)` for runs of `step` of `count`, with memory of a thread.
template <class T, class Work>
void for_strips(int count, int step, std::size_t memory, int num_threads, const Work& work) {
    parallel_for(static_cast<std::size_t>((count + step - 1) / step), num_threads, [&](std::size_t strip) {
        thread_local Scratch<T> scratch;
        const int first = static_cast<int>(strip) * step;
        work(first, std::min(first + step, count), scratch.take(memory).data());
    });
}

}  // namespace

template <class T>
void space_noise(const SpaceNoiseParams<T>& params) {
    const auto row = BRUSHGS_KERNEL(noise_row, T);
    parallel_for(static_cast<std::size_t>(params.height), params.num_threads,
                 [&](std::size_t y) { row(params, static_cast<int>(y)); });
}

template <class T>
void smooth_planes(const SmoothParams<T>& params) {
    const auto rows = BRUSHGS_KERNEL(smooth_rows, T);
    const auto columns = BRUSHGS_KERNEL(smooth_columns, T);
    const auto width = static_cast<std::size_t>(params.width), height = static_cast<std::size_t>(params.height);
    const std::size_t channels = static_cast<std::size_t>(params.channels);
    for (int round = 0; round < params.rounds; ++round) {
        const double sigma = params.sigma * std::sqrt(3.0) * std::exp2(params.rounds - 1 - round) /
                             std::sqrt(std::pow(4.0, params.rounds) - 1);
        for_strips<T>(params.height, kRows, kRows * width, params.num_threads,
                      [&](int first, int end, T* memory) { rows(params, sigma, first, end, memory); });
        for_strips<T>(params.width, kColumns, height * channels * kColumns + kColumns, params.num_threads,
                      [&](int first, int end, T* memory) { columns(params, sigma, first, end, memory); });
    }
}

template <class T>
void key_colors(const KeyParams<T>& params) {
    const auto pixels = BRUSHGS_KERNEL(key_pixels, T);
    for_pixels(params.num_pixels, params.num_threads,
               [&](std::size_t first, std::size_t end) { pixels(params, first, end); });
}

template <class T>
void part_washes(const WashParams<T>& params, const WashNumbers<T>& numbers) {
    const auto pixels = BRUSHGS_KERNEL(part_pixels, T);
    for_pixels(params.num_pixels, params.num_threads,
               [&](std::size_t first, std::size_t end) { pixels(params, numbers, first, end); });
}

template <class T>
void mix_washes(const MixParams<T>& params, const WashNumbers<T>& numbers) {
    const auto pixels = BRUSHGS_KERNEL(mix_pixels, T);
    for_pixels(params.num_pixels, params.num_threads,
               [&](std::size_t first, std::size_t end) { pixels(params, numbers, first, end); });
}

#define BRUSHGS_INSTANTIATE(T)                                              \
    template void space_noise(const SpaceNoiseParams<T>&);                  \
    template void smooth_planes(const SmoothParams<T>&);                    \
    template void key_colors(const KeyParams<T>&);                          \
    template void part_washes(const WashParams<T>&, const WashNumbers<T>&); \
    template void mix_washes(const MixParams<T>&, const WashNumbers<T>&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
