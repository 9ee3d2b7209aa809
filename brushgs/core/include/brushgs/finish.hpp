// A picture on its background, as bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// bytes = whole part of 255 x clamp(rgb + (1 - alpha) x background, 0, 1) + 1/2. The background is one color, or a
// picture of as many pixels. The same bits as a NumPy expression, which needs five passes over memory in place of one.
template <class T>
void finish(const T* rgb, const T* alpha, const T* background, bool is_picture, std::size_t num_pixels, int num_threads,
            std::uint8_t* bytes);

}  // namespace brushgs
