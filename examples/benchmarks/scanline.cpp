// The yardstick of the raster benchmark: a plain scalar rasteriser, as one would write it in an afternoon.
// Strokes front to back over horizontal bands, each row clipped to the rotated box, bilinear texture.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

namespace {

struct Stroke {
    float center_x, center_y, cos, sin, half_u, half_v, red, green, blue, opacity;
    int top, bottom;
};

struct Target {
    int width, height;
    float *rgb, *transmittance;
    std::uint8_t* is_finished;
};

// Narrow [low, high] to where |value + slope * x| < bound.
void clip(float value, float slope, float bound, float& low, float& high) {
    if (std::fabs(slope) < 1e-12f) {
        if (std::fabs(value) >= bound) high = low - 1;
        return;
    }
    const float a = (-bound - value) / slope, b = (bound - value) / slope;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
}

void paint_row(const Stroke& s, const std::uint8_t* coverage, int columns, int rows, int y, const Target& target) {
    const float dy = static_cast<float>(y) + 0.5f - s.center_y;
    float low = -s.center_x, high = static_cast<float>(target.width) - s.center_x;
    clip(s.sin * dy, s.cos, s.half_u, low, high);
    clip(s.cos * dy, -s.sin, s.half_v, low, high);
    const int first = std::max(0, static_cast<int>(std::ceil(low + s.center_x - 0.5f)));
    const int last = std::min(target.width - 1, static_cast<int>(std::floor(high + s.center_x - 0.5f)));
    const float scale_u = 0.5f * static_cast<float>(columns - 1) / s.half_u;
    const float scale_v = 0.5f * static_cast<float>(rows - 1) / s.half_v;
    const float dx = static_cast<float>(first) + 0.5f - s.center_x;
    float u = (s.cos * dx + s.sin * dy + s.half_u) * scale_u, v = (s.cos * dy - s.sin * dx + s.half_v) * scale_v;
    const float step_u = s.cos * scale_u, step_v = -s.sin * scale_v;
    for (int x = first; x <= last; ++x, u += step_u, v += step_v) {
        const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(target.width) +
                                  static_cast<std::size_t>(x);
        if (target.is_finished[pixel]) continue;
        const int i = std::clamp(static_cast<int>(v), 0, rows - 2), j = std::clamp(static_cast<int>(u), 0, columns - 2);
        const float fu = u - static_cast<float>(j), fv = v - static_cast<float>(i);
        const std::uint8_t* texel = coverage + i * columns + j;
        const float upper = texel[0] + fu * (texel[1] - texel[0]);
        const float lower = texel[columns] + fu * (texel[columns + 1] - texel[columns]);
        const float alpha = std::min(0.99f, s.opacity * (upper + fv * (lower - upper)) / 255);
        if (alpha < 1.0f / 255) continue;
        const float weight = alpha * target.transmittance[pixel];
        if (target.transmittance[pixel] - weight < 1e-4f * (1 - 1e-5f)) {
            target.is_finished[pixel] = 1;
            continue;
        }
        target.transmittance[pixel] -= weight;
        target.rgb[3 * pixel] += weight * s.red;
        target.rgb[3 * pixel + 1] += weight * s.green;
        target.rgb[3 * pixel + 2] += weight * s.blue;
    }
}

}  // namespace

// rgb [H, W, 3] and transmittance [H, W] are overwritten; arrays as in brushgs.Boxes; coverage [rows, columns].
extern "C" void scanline(int count, const float* centers, const float* half_extents, const float* angles,
                         const float* colors, const float* opacities, const std::uint8_t* coverage, int columns,
                         int rows, int width, int height, int num_threads, float* rgb, float* transmittance) {
    constexpr int num_bands = 32;
    const auto num_pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::fill(rgb, rgb + 3 * num_pixels, 0.0f);
    std::fill(transmittance, transmittance + num_pixels, 1.0f);
    std::vector<std::uint8_t> is_finished(num_pixels, 0);
    std::vector<Stroke> strokes(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const float c = std::cos(angles[i]), s = std::sin(angles[i]);
        const float half_u = half_extents[2 * i], half_v = half_extents[2 * i + 1];
        const float reach = std::fabs(s) * half_u + std::fabs(c) * half_v, y = centers[2 * i + 1];
        strokes[static_cast<std::size_t>(i)] = {
            centers[2 * i], y, c, s, half_u, half_v, colors[3 * i], colors[3 * i + 1], colors[3 * i + 2], opacities[i],
            std::max(0, static_cast<int>(std::ceil(std::max(-1e6f, y - reach - 0.5f)))),
            std::min(height - 1, static_cast<int>(std::floor(std::min(1e6f, y + reach - 0.5f))))};
    }
    const Target target{width, height, rgb, transmittance, is_finished.data()};
    std::atomic<int> next{0};
    const auto work = [&] {
        for (int band = next++; band < num_bands; band = next++) {
            const int top = height * band / num_bands, bottom = height * (band + 1) / num_bands;
            for (const Stroke& s : strokes)
                for (int y = std::max(top, s.top); y <= std::min(bottom - 1, s.bottom); ++y)
                    paint_row(s, coverage, columns, rows, y, target);
        }
    };
    std::vector<std::jthread> helpers;
    for (int i = 1; i < num_threads; ++i) helpers.emplace_back(work);
    work();
}
