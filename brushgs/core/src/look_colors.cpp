#include "brushgs/look_colors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "brushgs/colors.hpp"
#include "brushgs/lloyd.hpp"

namespace brushgs {

namespace {

constexpr double kShadow = 0.62, kShadowRange = 0.4;  // OKLab L at which they begin, and the range in which they grow
constexpr double kLight = 0.62, kLightRange = 0.35;
constexpr double kHue = 2;  // weight of a and b over that of L: two pigments should differ in hue

// The root of the painted area of each stroke, relative to the largest one: not areas, so that accents keep their
// colors.
template <class T>
std::vector<double> weights_of(const PaintedStrokes<T>& strokes) {
    std::vector<std::array<double, 3>> sizes(strokes.count);
    double largest = std::numeric_limits<double>::min(), most = 0;
    for (std::size_t i = 0; i < strokes.count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) sizes[i][k] = static_cast<double>(strokes.scales[3 * i + k]);
        std::ranges::sort(sizes[i]);
        largest = std::max(largest, sizes[i][2]);
    }
    std::vector<double> weights(strokes.count);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const double area = (sizes[i][1] / largest) * (sizes[i][2] / largest);
        weights[i] = std::sqrt(static_cast<double>(strokes.opacities[i]) * area);
        most = std::max(most, weights[i]);
    }
    for (double& weight : weights) weight += 1e-12 * (most > 0 ? most : 1);
    return weights;
}

}  // namespace

template <class T>
void grade(const Grading& grading, const double* cones_from_rgb, const double* lab_from_roots, std::size_t count,
           std::size_t sh_terms, T* sh) {
    const Oklab oklab(cones_from_rgb, lab_from_roots);
    for (std::size_t i = 0; i < count; ++i) {
        T* const row = sh + 3 * sh_terms * i;
        const Oklab::Color color = base_rgb(row), lab = oklab.lab_of(color);
        const double dark = std::clamp((kShadow - lab[0]) / kShadowRange, 0.0, 1.0);
        const double light = std::clamp((lab[0] - kLight) / kLightRange, 0.0, 1.0);
        Oklab::Color graded{grading.pivot + (lab[0] - grading.pivot) * grading.contrast};
        for (std::size_t k = 0; k < 2; ++k)
            graded[k + 1] = lab[k + 1] * grading.chroma + dark * grading.shadows[k] + light * grading.lights[k];
        const Oklab::Color rgb = oklab.rgb_of(graded);
        for (std::size_t k = 0; k < 3; ++k) {  // colors out of range do not move further out
            const double before = 0.5 + kBand0 * static_cast<double>(row[k]);
            const double after = before + std::clamp(rgb[k], 0.0, 1.0) - color[k];
            row[k] = static_cast<T>((std::clamp(after, std::min(before, 0.0), std::max(before, 1.0)) - 0.5) / kBand0);
        }
    }
}

template <class T>
void mix_pigments(const PaintedStrokes<T>& strokes, const Pigments& pigments, double* rgb) {
    if (strokes.count == 0) return;
    const Oklab oklab(strokes.cones_from_rgb, strokes.lab_from_roots);
    const std::vector<double> weights = weights_of(strokes);
    std::vector<Oklab::Color> labs(strokes.count);
    std::vector<float> points;
    for (std::size_t i = 0; i < strokes.count; ++i) {
        labs[i] = oklab.lab_of(base_rgb(strokes.sh + 3 * strokes.sh_terms * i));
        for (std::size_t k = 0; k < 3; ++k) points.push_back(static_cast<float>(labs[i][k] * (k == 0 ? 1 : kHue)));
    }
    const std::size_t count = std::min(pigments.num_pigments, strokes.count);
    const Clusters found =
        find_clusters({points.data(), weights.data(), strokes.count, 3},
                      {count, pigments.draws, pigments.num_steps, pigments.gain, pigments.num_threads});
    std::vector<std::array<double, 4>> sums(found.num_clusters);
    for (std::size_t i = 0; i < strokes.count; ++i) {
        auto& sum = sums[static_cast<std::size_t>(found.labels[i])];
        for (std::size_t k = 0; k < 3; ++k) sum[k] += weights[i] * labs[i][k];
        sum[3] += weights[i];
    }
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const auto& sum = sums[static_cast<std::size_t>(found.labels[i])];
        Oklab::Color lab;
        for (std::size_t k = 0; k < 3; ++k)
            lab[k] = (1 - pigments.share) * labs[i][k] + pigments.share * (sum[k] / sum[3]);
        const Oklab::Color color = oklab.rgb_of(lab);
        for (std::size_t k = 0; k < 3; ++k) rgb[3 * i + k] = std::clamp(color[k], 0.0, 1.0);
    }
}

template void grade<float>(const Grading&, const double*, const double*, std::size_t, std::size_t, float*);
template void grade<double>(const Grading&, const double*, const double*, std::size_t, std::size_t, double*);
template void mix_pigments<float>(const PaintedStrokes<float>&, const Pigments&, double*);
template void mix_pigments<double>(const PaintedStrokes<double>&, const Pigments&, double*);

}  // namespace brushgs
