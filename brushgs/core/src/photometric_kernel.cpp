// The loops of the loss, compiled once per instruction set (see CMakeLists.txt): each runs along a row, and the
// compiler makes vectors of it. Nothing is reassociated, so all sets give the same bits.
#include "brushgs/photometric.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

// Means in windows: of a, b, a^2 + b^2 and a b.
constexpr int kMeans = 4;

template <class T>
struct Taps {
    T weights[kWindowTaps];
    explicit Taps(const PhotometricParams<T>& params) {
        for (int k = 0; k < kWindowTaps; ++k) weights[k] = static_cast<T>(params.window[k]);
    }
};

// The sum of a row in an order that no vector length changes.
template <class T>
T sum_of(const T* row, std::size_t count) {
    constexpr std::size_t lanes = 16;
    T sums[lanes] = {};
    std::size_t x = 0;
    for (; x + lanes <= count; x += lanes)
        for (std::size_t l = 0; l < lanes; ++l) sums[l] += row[x + l];
    for (; x < count; ++x) sums[x % lanes] += row[x];
    T sum = 0;
    for (std::size_t l = 0; l < lanes; ++l) sum += sums[l];
    return sum;
}

// For a row of windows, the weighted sums down each column of pixels, not yet across.
template <class T>
void sum_down(const PhotometricParams<T>& params, int row, const Taps<T>& taps, T* __restrict__ of_a,
              T* __restrict__ of_b, T* __restrict__ of_squares, T* __restrict__ of_products) {
    const std::size_t size = params.row_size();
    const T *a[kWindowTaps], *b[kWindowTaps];
    T weights[kWindowTaps];
    for (int k = 0; k < kWindowTaps; ++k) {
        const int y = kWindowStride * row + k - kWindowReach;
        const bool is_inside = y >= 0 && y < params.height;
        const std::size_t from = is_inside ? static_cast<std::size_t>(y) * size : 0;
        weights[k] = is_inside ? taps.weights[k] : 0;
        a[k] = params.painted + from;
        b[k] = params.target + from;
    }
    for (std::size_t x = 0; x < size; ++x) {
        T sum_a = 0, sum_b = 0, sum_squares = 0, sum_products = 0;
#pragma GCC unroll 11
        for (int k = 0; k < kWindowTaps; ++k) {
            const T own = a[k][x], other = b[k][x];
            const T weighted = weights[k] * own, weighted_other = weights[k] * other;
            sum_a += weighted;
            sum_b += weighted_other;
            sum_squares += weighted * own + weighted_other * other;
            sum_products += weighted * other;
        }
        of_a[x] = sum_a;
        of_b[x] = sum_b;
        of_squares[x] = sum_squares;
        of_products[x] = sum_products;
    }
}

// Separates even and odd pixels of a row, and the inverse: then windows at every second pixel read contiguous memory.
// `channels` as a constant: a loop of unknown length per pixel would dominate the time.
template <int channels, class T>
void part(const T* __restrict__ row, int width, T* __restrict__ even, T* __restrict__ odd) {
    for (int x = 0; x < width; ++x)
        for (int c = 0; c < channels; ++c) (x % 2 == 0 ? even : odd)[x / 2 * channels + c] = row[x * channels + c];
}

template <int channels, class T>
void join(const T* __restrict__ even, const T* __restrict__ odd, int width, T* __restrict__ row) {
    for (int x = 0; x < width; ++x)
        for (int c = 0; c < channels; ++c) row[x * channels + c] = (x % 2 == 0 ? even : odd)[x / 2 * channels + c];
}

// Means in the windows of a row: of weighted sums down the even and odd pixels the weighted sums across.
template <class T>
void mean_across(const T* __restrict__ even, const T* __restrict__ odd, std::ptrdiff_t channels, const Taps<T>& taps,
                 const T* __restrict__ factors, T factor, std::ptrdiff_t count, T* __restrict__ means) {
    for (std::ptrdiff_t x = 0; x < count; ++x) {
        T sum = 0;
#pragma GCC unroll 5
        for (int m = -2; m <= 2; ++m) sum += taps.weights[kWindowReach + 2 * m] * even[x + m * channels];
#pragma GCC unroll 6
        for (int m = -3; m <= 2; ++m) sum += taps.weights[kWindowReach + 2 * m + 1] * odd[x + m * channels];
        means[x] = sum * (factors[x] * factor);
    }
}

// The transpose: from values of windows to even and odd pixels.
template <class T>
void spread_across(const T* __restrict__ windows, std::ptrdiff_t channels, const Taps<T>& taps, std::ptrdiff_t count,
                   T* __restrict__ even, T* __restrict__ odd) {
    for (std::ptrdiff_t x = 0; x < count; ++x) {
        T sum_even = 0, sum_odd = 0;
#pragma GCC unroll 5
        for (int m = -2; m <= 2; ++m) sum_even += taps.weights[kWindowReach + 2 * m] * windows[x - m * channels];
#pragma GCC unroll 6
        for (int m = -3; m <= 2; ++m) sum_odd += taps.weights[kWindowReach + 2 * m + 1] * windows[x - m * channels];
        even[x] = sum_even;
        odd[x] = sum_odd;
    }
}

// Similarity in windows, and the derivatives of the loss by the weighted sums of a, of a^2 + b^2 and of a b.
template <class T>
void compare(const PhotometricParams<T>& params, const T* __restrict__ mean_a, const T* __restrict__ mean_b,
             const T* __restrict__ mean_squares, const T* __restrict__ mean_products, const T* __restrict__ factors,
             T factor, std::size_t count, T* __restrict__ similarity, T* __restrict__ by_a, T* __restrict__ by_squares,
             T* __restrict__ by_products) {
    const T c1 = static_cast<T>(params.stabilizers[0]), c2 = static_cast<T>(params.stabilizers[1]);
    const T by_similarity = static_cast<T>(-0.5 * params.share / params.num_windows()) * factor;
    for (std::size_t x = 0; x < count; ++x) {
        const T a = mean_a[x], b = mean_b[x];
        const T product = a * b, squares = a * a + b * b;
        const T per_variances = 1 / (mean_squares[x] - squares + c2), per_squares = 1 / (squares + c1);
        const T structure = (2 * (mean_products[x] - product) + c2) * per_variances;
        const T luminance = (2 * product + c1) * per_squares;
        const T both = structure * luminance;
        // By the mean of a directly, and through the variances.
        const T of_products = 2 * luminance * per_variances, of_squares = -both * per_variances;
        const T of_a = 2 * (b - a * luminance) * structure * per_squares - 2 * a * of_squares - b * of_products;
        const T scale = by_similarity * factors[x];
        similarity[x] = both;
        by_a[x] = of_a * scale;
        by_squares[x] = of_squares * scale;
        by_products[x] = of_products * scale;
    }
}

// The rows of windows that contain a row of pixels, the weights of its pixels in them, and their spreads.
constexpr int kMostSeen = (kWindowTaps + 1) / kWindowStride;

template <class T>
struct SeenBy {
    T weights[kMostSeen];
    const T* spreads[kMostSeen];
};

// The gradient of a row of pixels, and |a - b|. A separate function: only for pointer arguments the compiler assumes
// distinct memory, and vectorises.
template <class T>
void gather_down(const SeenBy<T>& seen_by, const T* __restrict__ a, const T* __restrict__ b, T by_difference,
                 std::size_t size, T* __restrict__ gradient, T* __restrict__ away) {
    T weights[kMostSeen];
    const T* spreads[kMostSeen];
    for (int s = 0; s < kMostSeen; ++s) weights[s] = seen_by.weights[s], spreads[s] = seen_by.spreads[s];
    for (std::size_t x = 0; x < size; ++x) {
        T by_a = 0, by_squares = 0, by_products = 0;
#pragma GCC unroll 6
        for (int s = 0; s < kMostSeen; ++s) {
            by_a += weights[s] * spreads[s][x];
            by_squares += weights[s] * spreads[s][size + x];
            by_products += weights[s] * spreads[s][2 * size + x];
        }
        const T difference = a[x] - b[x];
        const T up = difference > 0 ? by_difference : T(0), down = difference < 0 ? by_difference : T(0);
        gradient[x] = by_a + 2 * a[x] * by_squares + b[x] * by_products + (up - down);
        away[x] = difference < 0 ? -difference : difference;
    }
}

template <int channels, class T>
double compare_row(const PhotometricParams<T>& params, int row, const T* factors, T* memory, T* spread) {
    const Taps<T> taps(params);
    const std::size_t count = static_cast<std::size_t>(params.window_columns()) * channels;
    const std::size_t room = kWindowRoom * channels, padded = count + 2 * room, size = params.row_size();
    const auto take = [&memory](std::size_t length) {
        T* const taken = memory;
        memory += length;
        return taken;
    };
    T *sums[kMeans], *means[kMeans], *by_means[kWindowGradients];
    for (T*& of_mean : sums) of_mean = take(2 * padded);
    for (T*& of_mean : means) of_mean = take(padded);
    for (T*& of_mean : by_means) of_mean = take(padded);
    T *const similarity = take(padded), *const even = take(padded), *const odd = take(padded);

    const T factor = static_cast<T>(params.factor(kWindowStride * row, params.height));
    sum_down(params, row, taps, sums[0], sums[1], sums[2], sums[3]);
    __builtin_memset(even, 0, padded * sizeof(T));  // beyond the picture
    __builtin_memset(odd, 0, padded * sizeof(T));
    for (int k = 0; k < kMeans; ++k) {
        part<channels>(sums[k], params.width, even + room, odd + room);
        mean_across(even + room, odd + room, channels, taps, factors, factor, static_cast<std::ptrdiff_t>(count),
                    means[k]);
    }
    for (T* const of_mean : by_means) __builtin_memset(of_mean, 0, padded * sizeof(T));
    compare(params, means[0], means[1], means[2], means[3], factors, factor, count, similarity, by_means[0] + room,
            by_means[1] + room, by_means[2] + room);
    for (int k = 0; k < kWindowGradients; ++k) {
        spread_across(by_means[k] + room, channels, taps, static_cast<std::ptrdiff_t>(count), even, odd);
        join<channels>(even, odd, params.width, spread + static_cast<std::size_t>(k) * size);
    }
    return static_cast<double>(sum_of(similarity, count));
}

}  // namespace

template <class T>
double compare_windows(const PhotometricParams<T>& params, int row, const T* factors, T* memory, T* spread) {
    return params.channels == 1 ? compare_row<1>(params, row, factors, memory, spread)
                                : compare_row<3>(params, row, factors, memory, spread);
}

template <class T>
double differentiate_pixels(const PhotometricParams<T>& params, int row, const T* spreads, T* away) {
    const std::size_t size = params.row_size();
    SeenBy<T> seen_by;
    for (int s = 0; s < kMostSeen; ++s) {
        const int windows = row / kWindowStride - kWindowReach / kWindowStride + s;
        const int tap = row - kWindowStride * windows + kWindowReach;
        const bool sees = tap >= 0 && windows >= 0 && windows < params.window_rows();
        seen_by.weights[s] = sees ? static_cast<T>(params.window[tap]) : 0;
        seen_by.spreads[s] = spreads + (sees ? static_cast<std::size_t>(windows) * kWindowGradients * size : 0);
    }
    const std::size_t from = static_cast<std::size_t>(row) * size;
    gather_down(seen_by, params.painted + from, params.target + from,
                static_cast<T>((1 - params.share) / params.num_values()), size, params.gradient + from, away);
    return static_cast<double>(sum_of(away, size));
}

#ifdef BRUSHGS_IN_DOUBLE
#define BRUSHGS_SCALAR double
#else
#define BRUSHGS_SCALAR float
#endif
template double compare_windows<BRUSHGS_SCALAR>(const PhotometricParams<BRUSHGS_SCALAR>&, int, const BRUSHGS_SCALAR*,
                                                BRUSHGS_SCALAR*, BRUSHGS_SCALAR*);
template double differentiate_pixels<BRUSHGS_SCALAR>(const PhotometricParams<BRUSHGS_SCALAR>&, int,
                                                     const BRUSHGS_SCALAR*, BRUSHGS_SCALAR*);
#undef BRUSHGS_SCALAR

}  // namespace brushgs::BRUSHGS_ISA
