// The loss of a painted picture to its target, by absolute difference and structural similarity, and its gradient.
//
// Loss: (1 - share) x mean |a - b| + share x (1 - mean SSIM) / 2, over pixels or windows and over channels. A window
// lies around every second pixel either way; it is clipped at the borders of the picture, and its weights sum to 1.
// With the means m_a and m_b in a window, variances v_a and v_b and the covariance v_ab: SSIM = (2 m_a m_b + c1) /
// (m_a^2 + m_b^2 + c1) x (2 v_ab + c2) / (v_a + v_b + c2).
//   1. every row of windows: means, similarity, and the derivatives by the means, spread over the columns of pixels;
//   2. every row of pixels: its sum over the rows of windows that contain it.
// What a row writes depends on the row alone: neither number nor gradient depends on the threads.
#pragma once

#include <cstddef>

namespace brushgs {

constexpr int kWindowReach = 5;  // half size of a window, pixels
constexpr int kWindowTaps = 2 * kWindowReach + 1;
constexpr int kWindowStride = 2;     // pixels between windows
constexpr int kWindowGradients = 3;  // by the weighted sums of a, of a^2 + b^2 and of a b in a window
constexpr int kWindowRoom = 3;       // windows, or pixels of one parity, that are read beyond either end of a row

template <class T>
struct PhotometricParams {
    const T* painted;       // [H, W, C]
    const T* target;        // [H, W, C]
    T* gradient;            // [H, W, C] of the loss by `painted`, written
    int width, height;      // pixels, >= 1
    int channels;           // 1 or 3
    const double* window;   // [kWindowTaps] weights along an axis
    double share;           // of dissimilarity in the loss
    double stabilizers[2];  // c1, c2
    int num_threads;        // >= 1

    std::size_t row_size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels); }
    int window_columns() const { return (width + kWindowStride - 1) / kWindowStride; }
    int window_rows() const { return (height + kWindowStride - 1) / kWindowStride; }
    double num_windows() const { return 1.0 * window_rows() * window_columns() * channels; }
    double num_values() const { return 1.0 * height * width * channels; }
    // Factor from weighted sums to means, for the window around pixel `at`, along an axis of `size` pixels.
    double factor(int at, int size) const {
        double sum = 0;
        for (int k = 0; k < kWindowTaps; ++k)
            if (at + k >= kWindowReach && at + k < size + kWindowReach) sum += window[k];
        return 1 / sum;
    }
};

// Returns the loss.
template <class T>
double photometric(const PhotometricParams<T>& params);

// Number of values of memory for `compare_windows`.
template <class T>
std::size_t photometric_memory(const PhotometricParams<T>& params) {
    const int padded = (params.window_columns() + 2 * kWindowRoom) * params.channels;
    return 18 * static_cast<std::size_t>(padded);
}

// The first returns the sum of the similarity in a row of windows and writes `spread`, [kWindowGradients, W, C];
// `factors` are [w, C] along the row. The second writes the gradient of a row of pixels by the spreads of all rows of
// windows and returns its sum of |a - b|; `away` is memory for W x C values.
#define BRUSHGS_DECLARE_PHOTOMETRIC(isa)                                                                         \
    namespace isa {                                                                                              \
    template <class T>                                                                                           \
    double compare_windows(const PhotometricParams<T>& params, int row, const T* factors, T* memory, T* spread); \
    template <class T>                                                                                           \
    double differentiate_pixels(const PhotometricParams<T>& params, int row, const T* spreads, T* away);         \
    }
BRUSHGS_DECLARE_PHOTOMETRIC(in_double)
BRUSHGS_DECLARE_PHOTOMETRIC(baseline)
BRUSHGS_DECLARE_PHOTOMETRIC(avx2)
BRUSHGS_DECLARE_PHOTOMETRIC(avx512)
#undef BRUSHGS_DECLARE_PHOTOMETRIC

}  // namespace brushgs
