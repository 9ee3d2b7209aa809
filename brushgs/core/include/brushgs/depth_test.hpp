// Boxes fade out behind a limit that each pixel sets, such as the depth of a picture they are painted in front of.
// Defined by brushgs/rendering/reference.py.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/blending.hpp"
#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

// The visible share of a box that ends at `fade.end`, before smoothing: 1 or more is all, 0 or less is nothing.
template <class T>
[[gnu::always_inline]] inline T room_before(T limit, const T* fade) {
    return (limit - fade[0]) * fade[1];
}

// Whether box `id` is invisible in the whole tile, so that many boxes behind a surface are never sampled.
template <class T>
[[gnu::always_inline]] inline bool is_behind(const TileTask<T>& task, std::uint32_t id) {
    return task.limits != nullptr && !(room_before(task.limits->farthest, task.boxes.fades + 2 * id) > 0);
}

// Fades the alphas of box `id` in these blocks. A separate function, so that the calling loops do not change without a
// limit.
template <class T>
[[gnu::noinline]] void fade_behind(const TileTask<T>& task, std::uint32_t id, std::uint32_t blocks,
                                   T (&alphas)[kNumBlocks][kBlockPixels]) {
    using L = Lanes<T>;
    const TileLimits<T>& limits = *task.limits;
    const T* const fade = task.boxes.fades + 2 * id;
    if (room_before(limits.nearest, fade) >= 1) return;
    const auto end = L::set(fade[0]), steepness = L::set(fade[1]);
    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        for (int lane = 0; lane < kBlockPixels; lane += L::width) {
            const auto room = (L::load(limits.limits[b] + lane) - end) * steepness;
            const auto is_seen = L::less(L::from_bits(~0u), L::set(0), room);
            const auto x = L::where(is_seen, L::min(room, L::set(1)));
            const auto share = x * x * (L::set(3) - (x + x));
            L::store(alphas[b] + lane, L::load(alphas[b] + lane) * share);
        }
    }
}

// The same, of alphas that are sifted, see `sample_record`; returns the blocks that are left.
template <class T>
[[gnu::noinline]] std::uint32_t sift_behind(const TileTask<T>& task, std::uint32_t id, std::uint32_t blocks,
                                            T (&alphas)[kNumBlocks][kBlockPixels],
                                            std::uint16_t (&pixels)[kNumBlocks]) {
    using L = Lanes<T>;
    if (room_before(task.limits->nearest, task.boxes.fades + 2 * id) >= 1) return blocks;
    fade_behind(task, id, blocks, alphas);
    for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
        const int b = __builtin_ctz(rest);
        unsigned seen = 0;
        for (int lane = 0; lane < kBlockPixels; lane += L::width) {
            const auto alpha = L::load(alphas[b] + lane);
            const auto painted = L::at_least(L::from_bits(~0u), alpha, L::set(static_cast<T>(kMinAlpha)));
            L::store(alphas[b] + lane, L::where(painted, alpha));
            seen |= L::bits(painted) << lane;
        }
        pixels[b] = static_cast<std::uint16_t>(seen);
        blocks &= ~((seen == 0 ? 1u : 0u) << b);
    }
    return blocks;
}

}  // namespace brushgs::BRUSHGS_ISA
