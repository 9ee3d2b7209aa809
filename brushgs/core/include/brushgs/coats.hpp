// Coats over coats, and paint on its ground: brushgs/rendering/canvas.py says what it means.
//
// One pass over memory: NumPy needs some ten, which take as long as painting the strokes. The same bits as its sums.
#pragma once

#include <algorithm>
#include <cstddef>

#include "brushgs/cpu.hpp"

namespace brushgs {

inline constexpr std::size_t kPixelsPerItem = 1 << 14;  // work handed to a thread at a time

// A frame of strokes, [pixels] or [pixels, 3].
template <class T>
struct Layer {
    const T* rgb;
    const T* alpha;
    const T* depth;   // null where there is none
    const T* height;  // null where there is none
};

// Where a frame is written to; may be one that is read.
template <class T>
struct LayerOut {
    T* rgb;
    T* alpha;
    T* depth;
    T* height;
};

// Calls `work(first, end)` for all pixels, in threads.
template <class Work>
void for_pixels(std::size_t num_pixels, int num_threads, const Work& work) {
    parallel_for((num_pixels + kPixelsPerItem - 1) / kPixelsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t first = item * kPixelsPerItem;
        work(first, std::min(first + kPixelsPerItem, num_pixels));
    });
}

// One frame of strokes over another. The front hides the share `hidden` of the height below it. Depths are means by
// alpha, and need both.
template <class T>
void lay_over(const Layer<T>& front, const Layer<T>& back, T hidden, std::size_t num_pixels, int num_threads,
              const LayerOut<T>& out) {
    for_pixels(num_pixels, num_threads, [=](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            const T passed = 1 - front.alpha[i];
            for (std::size_t c = 0; c < 3; ++c)
                out.rgb[3 * i + c] = back.rgb[3 * i + c] * passed + front.rgb[3 * i + c];
        }
        if (out.height != nullptr)
            for (std::size_t i = first; i < end; ++i)
                out.height[i] = back.height[i] * (1 - hidden * front.alpha[i]) + front.height[i];
        if (out.depth != nullptr)
            for (std::size_t i = first; i < end; ++i) {
                const T behind = back.alpha[i] * (1 - front.alpha[i]), all = behind + front.alpha[i];
                const T sum = back.depth[i] * behind + front.alpha[i] * front.depth[i];
                out.depth[i] = all > 0 ? sum / all : sum;
            }
        for (std::size_t i = first; i < end; ++i) out.alpha[i] = back.alpha[i] * (1 - front.alpha[i]) + front.alpha[i];
    });
}

// Strokes on their ground, whose colour is multiplied by a tint where there is one.
template <class T>
void lay_on_ground(const T* rgb, const T* alpha, const T* ground, const T* tint, std::size_t num_pixels,
                   int num_threads, T* picture) {
    for_pixels(num_pixels, num_threads, [=](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            const T passed = 1 - alpha[i];
            for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
                const T seen = passed * ground[k];
                picture[k] = (tint == nullptr ? seen : seen * tint[k]) + rgb[k];
            }
        }
    });
}

// The height of a ground, of which paint hides the share `hidden`, and of the paint where it has one.
template <class T>
void raise_ground(const T* alpha, const T* ground, const T* paint, T hidden, std::size_t num_pixels, int num_threads,
                  T* height) {
    for_pixels(num_pixels, num_threads, [=](std::size_t first, std::size_t end) {
        if (paint == nullptr)
            for (std::size_t i = first; i < end; ++i) height[i] = (1 - hidden * alpha[i]) * ground[i];
        else
            for (std::size_t i = first; i < end; ++i) height[i] = (1 - hidden * alpha[i]) * ground[i] + paint[i];
    });
}

}  // namespace brushgs
