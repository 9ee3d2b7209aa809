#include "brushgs/oklab.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kPixelsPerItem = 8192, kLinesPerItem = 32;

// The entry at or below a value from 0 to 1; the first for what is not a number.
float at(const float* table, std::size_t size, float value) {
    const float last = static_cast<float>(size - 1), place = value * last;
    return table[place > 0 ? static_cast<std::size_t>(std::min(place, last)) : 0];
}

float product(const float* row, const float* values) {
    return row[0] * values[0] + row[1] * values[1] + row[2] * values[2];
}

// Writes the three numbers of a color at a distance of `stride`.
void write_oklab(const OklabTables& tables, const float* rgb, float* lab, std::size_t stride) {
    float linear[3], roots[3];
    for (std::size_t k = 0; k < 3; ++k) linear[k] = at(tables.light, tables.num_light, rgb[k]);
    for (std::size_t k = 0; k < 3; ++k)
        roots[k] = at(tables.roots, tables.num_roots, std::sqrt(product(tables.cones_from_rgb + 3 * k, linear)));
    for (std::size_t k = 0; k < 3; ++k) lab[k * stride] = product(tables.lab_from_roots + 3 * k, roots);
}

}  // namespace

void oklab_planes(const OklabTables& tables, const float* rgb, std::size_t count, int num_threads, float* planes) {
    parallel_for((count + kPixelsPerItem - 1) / kPixelsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * kPixelsPerItem, count);
        for (std::size_t i = item * kPixelsPerItem; i < end; ++i) write_oklab(tables, rgb + 3 * i, planes + i, count);
    });
}

void seen_planes(const OklabTables& tables, const PlainPicture& picture, int num_threads, float* planes) {
    const std::size_t height = (picture.height + 1) / 2, width = (picture.width + 1) / 2, count = height * width;
    constexpr float black[3] = {0, 0, 0}, white[3] = {1, 1, 1};
    float empty[6];  // of pixels without paint, which are half of the picture of an object
    write_oklab(tables, black, empty, 1);
    write_oklab(tables, white, empty + 3, 1);
    parallel_for((height + kLinesPerItem - 1) / kLinesPerItem, num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * kLinesPerItem, height);
        for (std::size_t y = item * kLinesPerItem; y < end; ++y)
            for (std::size_t x = 0; x < width; ++x) {
                const std::size_t above = 2 * y * picture.width, left = 2 * x;
                const std::size_t below = std::min(2 * y + 1, picture.height - 1) * picture.width;
                const std::size_t right = std::min(left + 1, picture.width - 1);
                const auto mean = [&](const float* values, std::size_t step, std::size_t k) {
                    return 0.25f * ((values[(above + left) * step + k] + values[(below + left) * step + k]) +
                                    (values[(above + right) * step + k] + values[(below + right) * step + k]));
                };
                float rgb[3];
                for (std::size_t k = 0; k < 3; ++k) rgb[k] = mean(picture.rgb, 3, k);
                float* const lab = planes + y * width + x;
                const float rest = 1 - mean(picture.alpha, 1, 0);
                if (rest == 1 && rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0) {
                    for (std::size_t k = 0; k < 6; ++k) lab[k * count] = empty[k];
                    continue;
                }
                write_oklab(tables, rgb, lab, count);
                for (float& value : rgb) value += rest;
                write_oklab(tables, rgb, lab + 3 * count, count);
            }
    });
}

void seen_errors(const SeenErrors& query) {
    const std::size_t height = (query.height + 1) / 2, width = (query.width + 1) / 2, count = height * width;
    parallel_for((height + kLinesPerItem - 1) / kLinesPerItem, query.num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * kLinesPerItem, height);
        for (std::size_t y = item * kLinesPerItem; y < end; ++y)
            for (std::size_t x = 0; x < width; ++x) {
                double error = 0;
                for (std::size_t first = y * width + x; first < 6 * count; first += 3 * count) {
                    float squares = 0;
                    for (std::size_t i = first; i < first + 3 * count; i += count) {
                        const float away = query.painted[i] - query.plain[i];
                        squares += away * away;
                    }
                    if (squares == 0) continue;  // no paint in either
                    const float step =
                        std::clamp((std::sqrt(squares) - query.low) / (query.high - query.low), 0.0f, 1.0f);
                    error += static_cast<double>(0.5f * squares * (step * step * (3 - 2 * step)));
                }
                for (std::size_t row = 2 * y; row < std::min(2 * y + 2, query.height); ++row)
                    for (std::size_t column = 2 * x; column < std::min(2 * x + 2, query.width); ++column)
                        query.errors[row * query.width + column] = error;
            }
    });
}

}  // namespace brushgs
