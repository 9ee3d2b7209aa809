// Marks pressed through the tooth of the paper: brushgs/rendering/tooth.py says what it means.
#pragma once

#include <cstddef>

namespace brushgs {

template <class T>
struct Press {
    const T* rgb;    // [pixels, 3]
    const T* alpha;  // [pixels]
    const T* grain;  // [pixels] 0 (a valley of the paper) to 1
    T dry;           // 0 to 1
    T softness;      // of the step between bare and painted paper, in alpha, > 0
    std::size_t num_pixels;
    T* pressed_rgb;    // [pixels, 3]
    T* pressed_alpha;  // [pixels]
};

// One pass over memory: NumPy needs some ten, which take longer than painting the strokes.
template <class T>
void press(const Press<T>& p) {
    constexpr std::size_t run = 256;  // pixels whose shares fit the stack, so that the loops below become vectors
    T shares[run];
    for (std::size_t first = 0; first < p.num_pixels; first += run) {
        const std::size_t count = p.num_pixels - first < run ? p.num_pixels - first : run;
        for (std::size_t i = 0; i < count; ++i) {
            const T alpha = p.alpha[first + i], room = (alpha - p.dry * (1 - p.grain[first + i])) / p.softness;
            const T above = room > 0 ? room : 0, x = above < 1 ? above : 1;
            shares[i] = x * x * (3 - 2 * x);
            p.pressed_alpha[first + i] = alpha * shares[i];
        }
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t c = 0; c < 3; ++c)
                p.pressed_rgb[3 * (first + i) + c] = p.rgb[3 * (first + i) + c] * shares[i];
    }
}

}  // namespace brushgs
