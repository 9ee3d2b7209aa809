// A picture in the light that falls on its height. Defined by brushgs/rendering/reference.py.
#pragma once

#include <cstddef>
#include <span>

namespace brushgs {

// With g the slope of the blurred height (central differences; beyond its border the picture goes on as at the border)
// and n = root of 1 + g . g: rgb x (1 + strength (clamp((1 - lamp . g) / n, 0, 2) - 1)) + alpha x gloss x
// max(f (((1 - half_way . g) / n)^exponent - 1), 0), f the same power of the z of half_way as a unit vector.
template <class T>
struct LightParams {
    const T* rgb;                  // [H, W, 3]
    const T* heights;              // [H, W] pixels
    const T* alpha;                // [H, W]; null: 1
    T* lit;                        // [H, W, 3]; may be `rgb` itself
    int width, height;             // pixels
    std::span<const double> blur;  // weights of the pixels -r to r, along either axis
    double lamp[2];                // x and y of the direction to the lamp, over its z
    double half_way[2];            // of the direction half way between the lamp and the eye
    double strength, gloss;
    int exponent;     // >= 1
    int num_threads;  // >= 1; the picture does not depend on it
};

template <class T>
void light(const LightParams<T>& params);

// Lights the rows first to end - 1; `memory` holds `light_memory` values.
template <class T>
std::size_t light_memory(const LightParams<T>& params) {
    const std::size_t width = static_cast<std::size_t>(params.width);
    return (width + params.blur.size() - 1) + 3 * (width + 2) + 3 * width;
}

#define BRUSHGS_DECLARE_LIGHT(isa)                                                \
    namespace isa {                                                               \
    template <class T>                                                            \
    void light_rows(const LightParams<T>& params, int first, int end, T* memory); \
    }
BRUSHGS_DECLARE_LIGHT(in_double)
BRUSHGS_DECLARE_LIGHT(baseline)
BRUSHGS_DECLARE_LIGHT(avx2)
BRUSHGS_DECLARE_LIGHT(avx512)
#undef BRUSHGS_DECLARE_LIGHT

}  // namespace brushgs
