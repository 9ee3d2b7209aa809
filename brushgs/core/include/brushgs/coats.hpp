// Coats over coats, and paint on its ground, as defined by brushgs/rendering/canvas.py.
//
// One pass over memory: NumPy needs some ten, which take as long as painting the strokes. The same bits as its sums.
#pragma once

#include <cstddef>

namespace brushgs {

// A frame of strokes, [pixels] or [pixels, 3].
template <class T>
struct Layer {
    const T* rgb;
    const T* alpha;
    const T* depth;   // null where there is none
    const T* height;  // null where there is none
};

// The output frame; may be one of the inputs.
template <class T>
struct LayerOut {
    T* rgb;
    T* alpha;
    T* depth;
    T* height;
};

// One frame of strokes over another. The front hides the share `hidden` of the height below it. Depths are means by
// alpha, and need both.
template <class T>
void lay_over(const Layer<T>& front, const Layer<T>& back, T hidden, std::size_t num_pixels, int num_threads,
              const LayerOut<T>& out);

// Strokes on their ground, whose color is multiplied by a tint, if any.
template <class T>
void lay_on_ground(const T* rgb, const T* alpha, const T* ground, const T* tint, std::size_t num_pixels,
                   int num_threads, T* picture);

// The height of a ground, of which paint hides the share `hidden`, plus that of the paint, if any.
template <class T>
void raise_ground(const T* alpha, const T* ground, const T* paint, T hidden, std::size_t num_pixels, int num_threads,
                  T* height);

}  // namespace brushgs
