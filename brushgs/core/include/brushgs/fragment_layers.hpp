// From the fragments of pixels to layers of a picture: means, largest coverage, and samples for compositing.
// brushgs/rendering/layers.py says what they mean. One pass over the fragments each: NumPy needs many.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "brushgs/memory.hpp"

namespace brushgs {

// The fragments of pixels, front to back: those of pixel i from starts[i] to starts[i + 1] - 1.
template <class T>
struct FragmentView {
    const std::int64_t* starts;         // [pixels + 1]
    const std::int32_t* marks;          // row of a table of marks
    const T* weights;                   // of the color
    const T* shades;                    // by which the color is multiplied
    const std::uint8_t* is_underpaint;  // 0 or 1
    std::size_t num_pixels;
};

// Sums over the fragments of each pixel of weight x values, [marks, channels], to sums [pixels, channels].
template <class T>
void sum_fragments(const FragmentView<T>& fragments, const T* values, std::size_t num_channels, int num_threads,
                   T* sums);

// The coverage of pixels, largest first: those of pixel i from starts[i] to starts[i + 1] - 1.
template <class T>
struct Shares {
    Buffer<std::int64_t> starts;  // [pixels + 1]
    Buffer<std::int32_t> keys;
    Buffer<T> weights;
    std::size_t num_pixels, count;
};

// The sums over the fragments of each pixel of their weights, by the keys [marks] of their marks; largest first, ties
// by key. The smallest are dropped, as long as their sum is below `least`.
template <class T>
Shares<T> share_fragments(const FragmentView<T>& fragments, const std::int32_t* keys, T least, int num_threads);

// The data that a sample takes from its mark.
template <class T>
struct MarkView {
    const T* colors;              // [marks, 3]
    const T* depths;              // [marks]
    const T* setbacks;            // [marks] how much further back underpaint lies
    const std::uint32_t* ids;     // [marks]
    const std::uint8_t* coats;    // [marks] row of `tints`
    std::vector<const T*> tints;  // [pixels, 3] each: of the glazes over a coat; null: none
};

// The background of the strokes in each pixel, and the light on both.
template <class T>
struct Setting {
    const T* rest_rgb;    // [pixels, 3] premultiplied; null: nothing
    const T* rest_alpha;  // [pixels]; with `rest_rgb`
    T rest_depth;
    const T* factors;  // [pixels] by which the lamp multiplies a color; null: no lamp
    const T* shines;   // [pixels] which it adds, times alpha; with `factors`
};

// Output of samples, those of pixel i from starts[i] on: one for each fragment, and one for the rest if its alpha is
// above 0.
struct SamplesOut {
    const std::int64_t* starts;  // [pixels]
    float* colors;               // [samples, 3] premultiplied
    float* alphas;               // [samples]
    float* depths;               // [samples] ascending within a pixel
    std::uint32_t* ids;          // [samples]
};

// Samples whose composite has the weights of the fragments.
template <class T>
void make_samples(const FragmentView<T>& fragments, const MarkView<T>& marks, const Setting<T>& setting,
                  int num_threads, const SamplesOut& out);

}  // namespace brushgs
