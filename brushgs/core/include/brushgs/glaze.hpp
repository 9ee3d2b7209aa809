// Glazes: transparent paint. Each box transmits a share of each color of the light, so the transmitted light is a
// product that does not depend on the order. Defined by brushgs/rendering/reference.py.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/blending.hpp"
#include "brushgs/depth_test.hpp"
#include "brushgs/tile_state.hpp"

namespace brushgs::BRUSHGS_ISA {

// Adds a record to the sums of alpha x log2 of its color. No pixel is ever finished: each glaze changes the tint.
template <class T, Kernel kernel>
[[gnu::always_inline]] inline void glaze_record(const TileTask<T>& task, std::uint32_t id, TileState<T, 0>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width;
    const Record<T>& record = task.records[id];
    if (is_behind(task, id)) return;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint32_t blocks = sample_record<T, kernel>(task.params, record, task.x0, task.y0, tile, alphas);
    if (task.limits != nullptr) fade_behind(task, id, blocks, alphas);
    Real logs[3];
    for (int c = 0; c < 3; ++c) logs[c] = L::set(record.color[c]);
    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        for (int lane = 0; lane < kBlockPixels; lane += W) {
            const auto all = L::from_bits(~0u);
            const Real sampled = L::load(alphas[b] + lane);
            const Real alpha = L::where(L::at_least(all, sampled, L::set(static_cast<T>(kMinAlpha))), sampled);
            const Real before = L::load(tile.light(b) + lane), after = before - before * alpha;
            // Fainter light is set to 0: denormal numbers are slow.
            L::store(tile.light(b) + lane,
                     L::where(L::at_least(all, after, L::set(static_cast<T>(kLeastLight))), after));
            for (int c = 0; c < 3; ++c) {
                T* const plane = tile.plane(c, b) + lane;
                L::store(plane, L::load(plane) + alpha * logs[c]);
            }
        }
    }
}

// By value: through a reference it would be reloaded after every store to the tile.
template <class T, Kernel kernel>
void glaze_all(const TileTask<T> task, TileState<T, 0>& tile) {
    const Attributes<T, 0> attributes(task.boxes.layers);
    for (std::size_t i = 0; i < task.num_ids; ++i) {
        prefetch(task, attributes, i);
        glaze_record<T, kernel>(task, task.ids[i], tile);
    }
}

// Turns the sums of logarithms into tints.
template <class T>
inline void finish_tints(TileState<T, 0>& tile) {
    using L = Lanes<T>;
    constexpr T least = sizeof(T) == 4 ? T(-120) : T(-1000);  // 2^x below this is as good as 0
    for (int k = 0; k < 3; ++k)
        for (int b = 0; b < kNumBlocks; ++b)
            for (int lane = 0; lane < kBlockPixels; lane += L::width) {
                T* const plane = tile.plane(k, b) + lane;
                const auto sum = L::load(plane);
                const auto in_range = L::at_least(L::from_bits(~0u), sum, L::set(least));
                L::store(plane, L::where(in_range, exp2_negative<T>(L::where(in_range, sum))));
            }
}

}  // namespace brushgs::BRUSHGS_ISA
