#include "brushgs/oklab.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kPixelsPerItem = 8192;

// The entry at or below a value from 0 to 1; the first for what is not a number.
float at(const float* table, std::size_t size, float value) {
    const float last = static_cast<float>(size - 1), place = value * last;
    return table[place > 0 ? static_cast<std::size_t>(std::min(place, last)) : 0];
}

float product(const float* row, const float* values) {
    return row[0] * values[0] + row[1] * values[1] + row[2] * values[2];
}

}  // namespace

void oklab_planes(const OklabTables& tables, const float* rgb, std::size_t count, int num_threads, float* planes) {
    parallel_for((count + kPixelsPerItem - 1) / kPixelsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * kPixelsPerItem, count);
        for (std::size_t i = item * kPixelsPerItem; i < end; ++i) {
            float linear[3], roots[3];
            for (std::size_t k = 0; k < 3; ++k) linear[k] = at(tables.light, tables.num_light, rgb[3 * i + k]);
            for (std::size_t k = 0; k < 3; ++k)
                roots[k] =
                    at(tables.roots, tables.num_roots, std::sqrt(product(tables.cones_from_rgb + 3 * k, linear)));
            for (std::size_t k = 0; k < 3; ++k) planes[k * count + i] = product(tables.lab_from_roots + 3 * k, roots);
        }
    });
}

}  // namespace brushgs
