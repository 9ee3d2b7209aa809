// Made-up inputs, the same bits on every machine: from whole numbers by arithmetic that rounds in one way, without the
// C library's functions, which do not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "brushgs/project.hpp"

namespace native {

// SplitMix64 (Steele et al. 2014).
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint8_t byte() { return static_cast<std::uint8_t>(bits() >> 56); }
    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53);
    }
    // Most of the numbers near `low`.
    double mostly_low(double low, double high) {
        const double x = between(0, 1);
        return low + (high - low) * (x * x * x * x);
    }
    template <class T>
    std::vector<T> numbers(std::size_t count, double low, double high) {
        std::vector<T> values(count);
        for (T& value : values) value = static_cast<T>(between(low, high));
        return values;
    }

private:
    std::uint64_t state_;
};

// Gaussians around the origin, some of them large, flat or faint.
template <class T>
struct Gaussians {
    std::size_t count, sh_terms;
    std::vector<T> means, quats, scales, opacities, sh;

    Gaussians(std::uint64_t seed, std::size_t count, std::size_t sh_terms) : count(count), sh_terms(sh_terms) {
        Random random(seed);
        means = random.numbers<T>(3 * count, -2, 2);
        quats = random.numbers<T>(4 * count, -1, 1);
        scales.resize(3 * count);
        for (T& scale : scales) scale = static_cast<T>(random.mostly_low(0.001, 0.6));
        opacities = random.numbers<T>(count, 0, 1);
        sh = random.numbers<T>(3 * sh_terms * count, -0.5, 0.5);
    }
    brushgs::GaussianColumns<T> columns() const {
        return {means.data(), quats.data(), scales.data(), opacities.data(), sh.data(), count, sh_terms};
    }
};

// A camera that looks at the origin from 4 units away, at the angle whose half has the tangent `slope`: sine and cosine
// of that are quotients.
inline brushgs::View view_from(double slope, int width, int height) {
    const double square = slope * slope, cosine = (1 - square) / (1 + square), sine = 2 * slope / (1 + square);
    return {.viewmat = {cosine, 0, -sine, 0.1, 0, 1, 0, -0.05, sine, 0, cosine, 4},
            .fx = 0.9 * width,
            .fy = 0.95 * width,
            .cx = 0.5 * width + 0.25,
            .cy = 0.5 * height,
            .width = static_cast<double>(width),
            .height = static_cast<double>(height),
            .near = 2.5};
}

}  // namespace native
