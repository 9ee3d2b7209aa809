// Passes over the planes of pictures: coats over coats, paint through the tooth of the paper, pictures as bytes.
#include "brushgs/coats.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/pixel_runs.hpp"
#include "brushgs/press.hpp"

namespace brushgs {

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

namespace {

// Bytes may alias whatever the pointers of a loop are kept in; as arguments of a function they are in registers.
template <class T>
void to_bytes(const T* __restrict__ values, std::size_t count, std::uint8_t* __restrict__ bytes) {
    for (std::size_t k = 0; k < count; ++k) {
        T value = values[k] > 0 ? values[k] : 0;
        value = value < 1 ? value : 1;
        bytes[k] = static_cast<std::uint8_t>(static_cast<int>(value * 255 + T(0.5)));
    }
}

}  // namespace

template <class T>
void finish(const T* rgb, const T* alpha, const T* background, bool is_picture, std::size_t num_pixels, int num_threads,
            std::uint8_t* bytes) {
    for_pixels(num_pixels, num_threads, [=](std::size_t first, std::size_t end) {
        bool is_opaque = true;
        for (std::size_t i = first; i < end; ++i) is_opaque &= alpha[i] == 1;
        if (is_opaque) return to_bytes(rgb + 3 * first, 3 * (end - first), bytes + 3 * first);
        constexpr std::size_t run = 256;  // pixels that fit the stack
        T values[3 * run];
        for (std::size_t i = first; i < end; ++i) {
            const std::size_t place = (i - first) % run;
            const T light = 1 - alpha[i];
            const T* behind = is_picture ? background + 3 * i : background;
            for (std::size_t c = 0; c < 3; ++c) values[3 * place + c] = rgb[3 * i + c] + light * behind[c];
            if (place + 1 == run || i + 1 == end) to_bytes(values, 3 * (place + 1), bytes + 3 * (i - place));
        }
    });
}

#define BRUSHGS_INSTANTIATE(T)                                                                         \
    template void lay_over(const Layer<T>&, const Layer<T>&, T, std::size_t, int, const LayerOut<T>&); \
    template void lay_on_ground(const T*, const T*, const T*, const T*, std::size_t, int, T*);         \
    template void raise_ground(const T*, const T*, const T*, T, std::size_t, int, T*);                 \
    template void press(const Press<T>&);                                                              \
    template void finish(const T*, const T*, const T*, bool, std::size_t, int, std::uint8_t*);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
