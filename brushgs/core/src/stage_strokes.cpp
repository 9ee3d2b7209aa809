// The strokes of a stage: their places, large and quiet, small only in the shadow; and what they become.
#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr double kUsualStrokes = 6000;    // of a painting, at which the strokes of a stage have their usual size
constexpr double kSizes[2] = {0.6, 1.8};  // least and most of it, however many the subject has
constexpr double kFine = 0.55;            // size of strokes in the shadow, relative to others at that distance
constexpr double kShaded = 0.08;          // minimum shade or contact of fine strokes
constexpr double kSizeJitter = 0.18;      // deviation of the logarithm of sizes
constexpr double kSigmas = 3.6;           // size of a stroke in standard deviations
constexpr double kThickness = 0.01, kOpacity = 0.95;

// Of the layer of broad strokes, and of fine ones.
struct Layer {
    std::vector<double> sizes;
    double until;
};
std::array<Layer, 2> layers_of(const LayerQuery& query) {
    std::array<Layer, 2> layers{Layer{{}, std::numeric_limits<double>::infinity()},
                                Layer{{}, kShadowReach * query.radius}};
    for (std::size_t i = 0; i < query.profile.steps; ++i) {
        layers[0].sizes.push_back(query.usual[i] * query.size);
        layers[1].sizes.push_back(query.usual[i] * kFine * std::min(query.size, 1.0));
    }
    return layers;
}

}  // namespace

double size_beside(std::size_t num_strokes) {
    return std::clamp(std::sqrt(kUsualStrokes / static_cast<double>(num_strokes)), kSizes[0], kSizes[1]);
}

std::array<std::size_t, 2> count_layers(const LayerQuery& query) {
    const auto [broad, fine] = layers_of(query);
    return {count_spots(query.profile, broad.sizes.data(), kOverlap, broad.until),
            count_spots(query.profile, fine.sizes.data(), kOverlap, fine.until)};
}

StageSpots lay_layers(const LayerQuery& query, const std::array<const double*, 2>& noise) {
    const auto layers = layers_of(query);
    const auto counts = count_layers(query);
    StageSpots kept;
    const auto add = [](std::vector<double>& to, const std::vector<double>& from, std::size_t i, std::size_t width) {
        const double* const first = from.data() + width * i;
        to.insert(to.end(), first, first + width);
    };
    for (std::size_t layer = 0; layer < 2; ++layer) {
        const StageSpots all =
            place_spots(query.profile, layers[layer].sizes.data(), kOverlap, counts[layer], noise[layer]);
        for (std::size_t i = 0; i < all.sizes.size(); ++i) {
            const bool is_shaded = std::ranges::any_of(query.shadows, [&](const ShadowView& shadow) {
                const Shade found = shadow.at(&all.points[3 * i]);
                return std::max(found.shade, found.contact) > kShaded;
            });
            if (is_shaded != (layer == 1)) continue;
            add(kept.points, all.points, i, 3);
            add(kept.around, all.around, i, 1);
            add(kept.along, all.along, i, 1);
            add(kept.sizes, all.sizes, i, 1);
            add(kept.noise, all.noise, i, kSpotNoise);
        }
    }
    return kept;
}

template <class T>
StageStrokes<T> strokes_on(const Place& place, const SpotsView& spots, const double* frames, const double* lab,
                           const StrokeStyle& style, const Oklab& oklab) {
    StageStrokes<T> strokes{std::vector<T>(3 * spots.count), std::vector<T>(4 * spots.count),
                            std::vector<T>(3 * spots.count), std::vector<T>(spots.count, static_cast<T>(kOpacity)),
                            std::vector<T>(3 * spots.count)};
    const double root = std::sqrt(style.aspect);
    for (std::size_t i = 0; i < spots.count; ++i) {
        const double* const noise = spots.noise + kSpotNoise * i;
        const double size = spots.sizes[i] * std::exp(kSizeJitter * noise[2]) / kSigmas;
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
            strokes.means[3 * i + k] = static_cast<T>(mean);
            strokes.scales[3 * i + k] = static_cast<T>(size * sides[k]);
            strokes.sh[3 * i + k] = static_cast<T>((std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0);
        }
        turn_to_world(place.axes, frames + 9 * i, &strokes.quats[4 * i]);
    }
    return strokes;
}

template <class T>
void dissolve(const Place& place, const GroundView& ground, const double* table, const Oklab& oklab,
              const OnGround<T>& strokes) {
    std::array<double, 3> rgb{};
    if (table != nullptr) rgb = oklab.rgb_of({table[0], table[1], table[2]});
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const Dissolving found = ground.dissolving_at(place.local(strokes.means + 3 * i).data(), place.radius);
        const double kept = found.is_under ? 0 : static_cast<double>(strokes.opacities[i]);
        strokes.opacities[i] = static_cast<T>(table != nullptr ? kept : kept * (1 - found.share));
        T* const sh = strokes.sh + 3 * strokes.sh_terms * i;
        for (std::size_t k = 0; k < 3 * strokes.sh_terms && table != nullptr; ++k) {
            double value = static_cast<double>(sh[k]) * (1 - found.share);
            if (k < 3) value += found.share * (std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0;
            sh[k] = static_cast<T>(value);
        }
    }
}

#define BRUSHGS_INSTANTIATE(T)                                                                           \
    template StageStrokes<T> strokes_on<T>(const Place&, const SpotsView&, const double*, const double*, \
                                           const StrokeStyle&, const Oklab&);                            \
    template void dissolve<T>(const Place&, const GroundView&, const double*, const Oklab&, const OnGround<T>&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
