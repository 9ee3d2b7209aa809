// A picture on its background, as bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// bytes = whole part of 255 x clamp(rgb + (1 - alpha) x background, 0, 1) + 1/2. The background is one colour, or a
// picture of as many pixels. The same bits as a NumPy expression, which needs five passes over memory in place of one.
template <class T>
void finish(const T* rgb, const T* alpha, const T* background, bool is_picture, std::size_t num_pixels,
            std::uint8_t* bytes) {
    for (std::size_t i = 0; i < num_pixels; ++i) {
        const T light = 1 - alpha[i];
        const T* behind = is_picture ? background + 3 * i : background;
        for (std::size_t c = 0; c < 3; ++c) {
            T value = rgb[3 * i + c] + light * behind[c];
            value = value > 0 ? value : 0;
            value = value < 1 ? value : 1;
            bytes[3 * i + c] = static_cast<std::uint8_t>(value * 255 + T(0.5));
        }
    }
}

}  // namespace brushgs
