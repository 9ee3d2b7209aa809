// Marks pressed through the tooth of the paper, as defined by brushgs/rendering/tooth.py.
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
void press(const Press<T>& p);

}  // namespace brushgs
