// The strokes of a stage: large and quiet, small only in the shadow.
#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/quats.hpp"
#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr double kUsualStrokes = 6000;    // of a painting, at which the strokes of a stage have their usual size
constexpr double kSizes[2] = {0.6, 1.8};  // least and most of it, however many the subject has
constexpr double kOverlap = 9.6;          // strokes over each point
constexpr double kFine = 0.55;            // size of strokes in the shadow, relative to others at that distance
constexpr double kShaded = 0.08;          // minimum shade or contact of fine strokes
constexpr double kSizeJitter = 0.18;      // deviation of the logarithm of sizes
constexpr double kThickness = 0.01, kOpacity = 0.95;

void append(std::vector<double>& to, const std::vector<double>& from, std::size_t i, std::size_t width = 1) {
    const double* const first = from.data() + width * i;
    to.insert(to.end(), first, first + width);
}

}  // namespace

double size_beside(std::size_t num_strokes) {
    return std::clamp(std::sqrt(kUsualStrokes / static_cast<double>(num_strokes)), kSizes[0], kSizes[1]);
}

StageSpots lay_layers(const ProfileView& profile, const double* usual, double size, double radius,
                      const std::vector<ShadowView>& shadows, const Draw& draw) {
    StageSpots kept;
    for (std::size_t layer = 0; layer < 2; ++layer) {
        std::vector<double> sizes(usual, usual + profile.steps);
        for (double& value : sizes) value *= layer == 0 ? size : kFine * std::min(size, 1.0);
        const double until = layer == 0 ? std::numeric_limits<double>::infinity() : kShadowReach * radius;
        const StageSpots all = place_spots(profile, {sizes.data(), kOverlap, until, layer}, draw);
        for (std::size_t i = 0; i < all.sizes.size(); ++i) {
            const bool is_shaded = std::ranges::any_of(shadows, [&](const ShadowView& shadow) {
                const Shade found = shadow.at(&all.points[3 * i]);
                return std::max(found.shade, found.contact) > kShaded;
            });
            if (is_shaded != (layer == 1)) continue;
            append(kept.points, all.points, i, 3);
            append(kept.around, all.around, i);
            append(kept.along, all.along, i);
            append(kept.sizes, all.sizes, i);
            append(kept.noise, all.noise, i, kSpotNoise);
        }
    }
    return kept;
}

void turn_to_world(const double* axes, const double* frame, double* quat) {
    double m[9] = {};
    for (std::size_t i = 0; i < 27; ++i) {
        const std::size_t row = i / 9, column = i / 3 % 3, k = i % 3;
        m[3 * row + column] += axes[3 * k + row] * frame[3 * k + column];
    }
    const double determinant =
        m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
    for (std::size_t row = 0; row < 3 && determinant < 0; ++row) m[3 * row + 1] = -m[3 * row + 1];
    write_quat(m, quat);
}

StageStrokes strokes_on(const Place& place, const SpotsView& spots, const double* frames, const double* lab,
                        const StrokeStyle& style, const Oklab& oklab) {
    const auto column = [&](std::size_t width) { return std::vector<double>(width * spots.count); };
    StageStrokes strokes{column(3), column(4), column(3), std::vector<double>(spots.count, kOpacity), column(3)};
    const double root = std::sqrt(style.aspect);
    for (std::size_t i = 0; i < spots.count; ++i) {
        const double* const noise = spots.noise + kSpotNoise * i;
        const double size = spots.sizes[i] * std::exp(kSizeJitter * noise[2]) / kStrokeSigmas;
        const double sides[3] = {style.longer != nullptr ? root * style.longer[i] : root, 1 / root, kThickness};
        std::array<double, 3> color;
        for (std::size_t k = 0; k < 3; ++k) {
            const double change = noise[3 + k] * style.jitter[k == 0 ? 0 : 1];
            color[k] = lab[3 * i + k] + (style.contrast != nullptr ? change * style.contrast[i] : change);
        }
        const auto rgb = oklab.rgb_of(color);
        for (std::size_t k = 0; k < 3; ++k) {
            double mean = place.foot[k];
            for (std::size_t axis = 0; axis < 3; ++axis) mean += spots.points[3 * i + axis] * place.axes[3 * axis + k];
            strokes.means[3 * i + k] = mean;
            strokes.scales[3 * i + k] = size * sides[k];
            strokes.sh[3 * i + k] = (std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0;
        }
        turn_to_world(place.axes.data(), frames + 9 * i, &strokes.quats[4 * i]);
    }
    return strokes;
}

}  // namespace brushgs
