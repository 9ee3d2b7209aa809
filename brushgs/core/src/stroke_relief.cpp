#include "brushgs/stroke_relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

#include "brushgs/colors.hpp"
#include "brushgs/equal_rows.hpp"
#include "brushgs/exponentials.hpp"

namespace brushgs {

namespace {

constexpr double kLeastSize = 0.4, kMostSize = 2.5;  // clamp of a size over the median; large strokes carry more paint
constexpr double kGainSpread = 0.25;                 // standard deviation of the logarithm of the gain
constexpr double kMostDeviations = 2.5;              // beyond, single strokes stand out like scratches
constexpr double kThicknessSpread = 0.5;             // largest relative deviation of the thickness
// Quantiles of painted area that count as fully dark and light, and the paint there. Large strokes lie under others:
// with 0.2 the darkest visible quarter of the still life would be half way to light.
constexpr double kDarkest = 0.4, kLightest = 0.8;
constexpr double kThin = 0.25, kThick = 1.35;

// Sums of logarithms: scales may be 0, or underflow when multiplied.
template <class T>
std::vector<double> log_sizes(const T* scales, std::size_t count) {
    std::vector<double> logs(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::array<double, 3> sorted;
        for (std::size_t k = 0; k < 3; ++k) sorted[k] = static_cast<double>(scales[3 * i + k]);
        std::ranges::sort(sorted);
        logs[i] = (log_of(sorted[1]) + log_of(sorted[2])) / 2;
    }
    return logs;
}

template <class T>
double lightness_of(const PaintedStrokes<T>& strokes, std::size_t row) {
    const T* const sh = strokes.sh + 3 * strokes.sh_terms * row;
    const Oklab oklab(strokes.cones_from_rgb, strokes.lab_from_roots);
    return oklab.lab_of(base_rgb(sh))[0];
}

}  // namespace

template <class T>
double median_log_size(const T* scales, std::size_t count) {
    std::vector<double> logs = log_sizes(scales, count);
    const auto middle = logs.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(logs.begin(), middle, logs.end());
    return count % 2 == 1 ? *middle : (*std::max_element(logs.begin(), middle) + *middle) / 2;
}

template <class T>
LightRange light_range(const PaintedStrokes<T>& strokes) {
    if (strokes.count == 0) return {};
    const std::vector<double> logs = log_sizes(strokes.scales, strokes.count);
    const double largest = *std::ranges::max_element(logs);
    std::vector<std::array<double, 2>> values(strokes.count);  // lightness and area
    bool has_area = false;
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const double area = std::isfinite(largest) ? exp_of(2 * (logs[i] - largest)) : 0;
        values[i] = {lightness_of(strokes, i), static_cast<double>(strokes.opacities[i]) * area};
        has_area |= values[i][1] > 0;
    }
    std::ranges::sort(values);
    double total = 0;
    for (auto& [lightness, area] : values) area = total += has_area ? area : 1;
    const auto at = [&](double share) {
        const auto found = std::ranges::find_if(values, [&](const auto& value) { return value[1] / total >= share; });
        return std::clamp((*std::min(found, values.end() - 1))[0], 0.0, 1.0);
    };
    return {at(kDarkest), at(kLightest)};
}

template <class T>
void relative_reliefs(const PaintedStrokes<T>& strokes, double middle, double by_light, LightRange lights,
                      double* reliefs) {
    const std::vector<double> logs = log_sizes(strokes.scales, strokes.count);
    const double lowest = log_of(kLeastSize), highest = log_of(kMostSize);
    const double range = std::max(lights.light - lights.dark, kLeastLightRange);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const double away = std::isfinite(middle) ? logs[i] - middle : 0;
        double size = exp_of(std::clamp(away, lowest, highest) / 2);
        if (by_light > 0) {
            const double place = (lightness_of(strokes, i) - (lights.dark + lights.light) / 2) / range;
            const double paint = kThin + (kThick - kThin) * std::clamp(0.5 + place, 0.0, 1.0);
            size *= 1 + by_light * (paint - 1);
        }
        // Source: Box and Muller 1958, A note on the generation of random normal deviates.
        const double one = chance(0, 0, 3 * i), two = chance(0, 0, 3 * i + 1), three = chance(0, 0, 3 * i + 2);
        const double normal = std::sqrt(-2 * log_of(1 - one)) * std::cos(2 * std::numbers::pi * two);
        reliefs[2 * i] = size * (1 + kThicknessSpread * (2 * three - 1));
        reliefs[2 * i + 1] = size * exp_of(kGainSpread * std::clamp(normal, -kMostDeviations, kMostDeviations));
    }
}

template double median_log_size<float>(const float*, std::size_t);
template double median_log_size<double>(const double*, std::size_t);
template LightRange light_range<float>(const PaintedStrokes<float>&);
template LightRange light_range<double>(const PaintedStrokes<double>&);
template void relative_reliefs<float>(const PaintedStrokes<float>&, double, double, LightRange, double*);
template void relative_reliefs<double>(const PaintedStrokes<double>&, double, double, LightRange, double*);

}  // namespace brushgs
