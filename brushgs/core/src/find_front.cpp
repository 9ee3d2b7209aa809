// The front-back axis lies in the best mirror plane: within 30 degrees of the true one in 22 of 22 scenes. The front is
// the end that shows more: finer Gaussians, more colors and shapes, and more of the scene. (Left-right symmetry of
// pictures does not help: 6 of 22.)
#include <algorithm>
#include <cmath>
#include <numbers>

#include "brushgs/cpu.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/view_pictures.hpp"

namespace brushgs {

namespace {

using std::numbers::pi;

constexpr double kDegree = pi / 180;
constexpr std::size_t kViews = 16;  // around the subject
constexpr int kFrontSide = 112;     // pixels
constexpr double kViewElevation = 12 * kDegree;
constexpr double kOpaque = 0.3;           // alpha from which its depth is a surface; below, nothing is hidden
constexpr std::size_t kNeighbor = 3;      // pixel distance for coarse contrast: shapes, not noise
constexpr std::size_t kColors = 8;        // steps per channel, for entropy
constexpr double kSolid = 0.2;            // opacity from which a Gaussian should be visible
constexpr double kSkin = 0.04;            // radii behind the visible surface that still count as visible
constexpr double kNarrow = 8, kWide = 2;  // concentrations of the smoothing over azimuths: 20 and 40 degrees
constexpr double kSymmetric = 1.08;  // best over median likeness; below, there is no mirror plane and detail decides
constexpr double kOneSided = std::numbers::ln2;  // log ratio of visible shares of opposite views: a one-sided capture
constexpr double kLeastShare = 0.005;            // added to visible shares before they are compared
constexpr double kAlong =
    0.7;                   // least visible share of the ends, over the best: else the capture is not along the axis
constexpr int kFine = 48;  // candidate azimuths without an axis
constexpr double kBeside = 30 * kDegree;  // from the front, for comparing the two sides

// Fineness, color entropy, contrast and visible share of a view, and their weights in its score.
using Measures = std::array<double, 4>;
constexpr Measures kWeights{1, 1, 1, 2};

double azimuth_of(std::size_t view) { return 2 * pi * static_cast<double>(view) / static_cast<double>(kViews); }

// Entropy of the colors of a picture, bits.
double entropy(const SmallPicture& picture) {
    std::vector<int> counts(kColors * kColors * kColors);
    for (std::size_t pixel = 0; pixel < picture.alpha.size(); ++pixel) {
        if (!picture.is_seen(pixel)) continue;
        std::size_t color = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const float value = std::min(picture.straight(pixel, k), 0.999F) * static_cast<float>(kColors);
            color = color * kColors + static_cast<std::size_t>(value);
        }
        ++counts[color];
    }
    double sum = 0;
    for (const int count : counts) {
        if (count == 0) continue;
        const double share = count / static_cast<double>(picture.num_seen);
        sum -= share * std::log2(share);
    }
    return sum;
}

// Mean difference of pixels `kNeighbor` apart, away from the outline. Sides of the picture are taken to meet.
double coarse_contrast(const SmallPicture& picture) {
    const std::size_t side = picture.side;
    const auto at = [side](std::size_t y, std::size_t x) { return (y % side) * side + x % side; };
    const auto shade = [&](std::size_t pixel) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) sum += static_cast<double>(picture.straight(pixel, k)) * kLuminance[k];
        return sum;
    };
    double sum = 0, count = 0;
    for (std::size_t y = side; y < 2 * side; ++y) {
        for (std::size_t x = side; x < 2 * side; ++x) {
            bool is_within = picture.is_seen(at(y, x));
            for (const std::size_t step : {side - 2, side - 1, side + 1, side + 2})
                is_within = is_within && picture.is_seen(at(y + step, x)) && picture.is_seen(at(y, x + step));
            if (!is_within) continue;
            const double here = shade(at(y, x));
            sum += std::abs(here - shade(at(y - kNeighbor, x))) + std::abs(here - shade(at(y, x - kNeighbor)));
            ++count;
        }
    }
    return sum / std::max(count, 1.0);
}

// Share of solid Gaussians that are not behind the visible surface.
double visible_share(const ViewSample& sample, const ViewCamera& camera, const SmallPicture& picture) {
    double visible = 0, solid = 0;
    for (std::size_t row = 0; row < sample.count; ++row) {
        if (!(static_cast<double>(sample.opacities[row]) > kSolid)) continue;
        ++solid;
        const auto seen = camera.project(&sample.places[3 * row]);  // in front of the camera, which is outside
        const auto x = static_cast<int>(seen[0]), y = static_cast<int>(seen[1]);
        if (x < 0 || x >= camera.side || y < 0 || y >= camera.side) continue;
        const std::size_t pixel = static_cast<std::size_t>(y) * picture.side + static_cast<std::size_t>(x);
        const bool hides = static_cast<double>(picture.alpha[pixel]) > kOpaque;
        if (!hides || seen[2] <= static_cast<double>(picture.depth[pixel]) + kSkin) ++visible;
    }
    return visible / std::max(solid, 1.0);
}

Measures measures_from(const ViewSample& sample, const Axes& axes, const std::vector<float>& sizes) {
    const ViewCamera camera{axes, kFrontSide};
    const SmallPicture picture = paint_with_shade(sample, camera, sizes);
    if (picture.num_seen == 0) return {};
    double coarse = 0;
    for (std::size_t pixel = 0; pixel < picture.alpha.size(); ++pixel)
        if (picture.is_seen(pixel)) coarse += static_cast<double>(picture.shade(pixel));
    return {-coarse / static_cast<double>(picture.num_seen), entropy(picture), coarse_contrast(picture),
            visible_share(sample, camera, picture)};
}

// Scores of the views around a subject.
struct Around {
    std::array<double, kViews> scores{};  // detail of each, in standard deviations
    std::array<double, kViews> shares{};  // visible share of the Gaussians

    // The value near an azimuth.
    static double near(const std::array<double, kViews>& values, double azimuth, double concentration) {
        double sum = 0, total = 0;
        for (std::size_t view = 0; view < kViews; ++view) {
            const double weight = std::exp(concentration * (std::cos(azimuth_of(view) - azimuth) - 1));
            sum += weight * values[view];
            total += weight;
        }
        return sum / total;
    }
    double score(double azimuth, double concentration = kNarrow) const { return near(scores, azimuth, concentration); }
    double share(double azimuth) const { return near(shares, azimuth, kNarrow); }
};

Around look_around(const ViewSample& sample, const double* level, int num_threads) {
    const auto sizes = shades_of_size(sample);
    std::array<Measures, kViews> found;
    parallel_for(kViews, num_threads, [&](std::size_t view) {
        found[view] = measures_from(sample, axes_around(level, azimuth_of(view), kViewElevation), sizes);
    });
    Around around;
    double total = 0;
    for (std::size_t k = 0; k < kWeights.size(); ++k) {
        double mean = 0, squares = 0;
        for (const Measures& one : found) mean += one[k] / kViews;
        for (const Measures& one : found) squares += (one[k] - mean) * (one[k] - mean) / kViews;
        const double deviation = std::max(std::sqrt(squares), 1e-9);
        for (std::size_t view = 0; view < kViews; ++view)
            around.scores[view] += kWeights[k] * (found[view][k] - mean) / deviation;
        total += kWeights[k];
    }
    for (std::size_t view = 0; view < kViews; ++view) {
        around.scores[view] /= total;
        around.shares[view] = found[view].back();
    }
    return around;
}

// The azimuth of the front and its margin, for the axis of a mirror plane of some strength.
std::array<double, 2> side_of(const Around& around, double axis, double strength) {
    const double difference = around.score(axis) - around.score(axis + pi);
    double azimuth = difference > 0 ? axis : axis + pi, margin = std::abs(difference);
    if (strength < kSymmetric) {
        double best = -HUGE_VAL;
        for (int i = 0; i < kFine; ++i) {
            const double fine = 2 * pi * i / kFine, score = around.score(fine, kWide);
            if (score > best) best = score, azimuth = fine;
        }
    }
    const double one = around.share(axis), other = around.share(axis + pi);
    const double one_sided = std::log(one + kLeastShare) - std::log(other + kLeastShare);
    if (std::abs(one_sided) >= kOneSided) {
        azimuth = one_sided > 0 ? axis : axis + pi;
        margin = std::max(margin, 1.0);
        std::array<double, kViews> smoothed;
        for (std::size_t view = 0; view < kViews; ++view) smoothed[view] = around.share(azimuth_of(view));
        const auto most = std::ranges::max_element(smoothed);
        if (std::max(one, other) < kAlong * *most)
            azimuth = azimuth_of(static_cast<std::size_t>(most - smoothed.begin()));
    }
    // Where it is not sure, the end nearer to azimuth 0 is taken: not one beyond 100 degrees from it.
    if (margin < kFrontMargin && std::cos(azimuth) < -0.2) azimuth += pi;
    return {azimuth, margin};
}

// Mirror symmetry of a subject about vertical planes: most things are symmetric left to right.

constexpr std::size_t kBins = 28;                                      // voxels along a side of the cube of two radii
constexpr std::array<double, 5> kShifts{-0.06, -0.03, 0, 0.03, 0.06};  // of the plane from the center of mass, radii
constexpr double kLargest = 0.98;                                      // quantile at which weights are clipped

// Voxel of a coordinate in -1 to 1.
std::size_t bin_of(double coordinate) {
    return static_cast<std::size_t>(std::clamp((coordinate + 1) * kBins / 2, 0.0, kBins - 1.0));
}

// Overlap of what voxels hold with what those of the mirror image hold, the first of three axes turned; 0 to 1.
double overlap_of(std::vector<double>& voxels) {
    constexpr std::size_t slice = kBins * kBins;
    double common = 0, total = 0;
    for (double& held : voxels) total += held = std::sqrt(held);
    for (std::size_t across = 0; across < kBins; ++across) {
        const double *here = &voxels[across * slice], *there = &voxels[(kBins - 1 - across) * slice];
        for (std::size_t i = 0; i < slice; ++i) common += std::min(here[i], there[i]);
    }
    return common / total;
}

double median(std::array<double, kMirrorPlanes> values) {
    std::vector<double> copy(values.begin(), values.end());
    return percentile(copy, 0.5);
}

}  // namespace

std::array<double, kMirrorPlanes> mirror_likeness(const std::vector<double>& places, const std::vector<double>& weights,
                                                  int num_threads) {
    std::array<double, kMirrorPlanes> likeness;
    likeness.fill(1);
    const std::size_t count = weights.size();
    const auto held = clipped(weights, kLargest);
    double total = 0, center[2] = {0, 0};
    for (std::size_t i = 0; i < count; ++i) {
        total += held[i];
        center[0] += held[i] * places[3 * i];
        center[1] += held[i] * places[3 * i + 2];
    }
    if (!(total > 0)) return likeness;
    parallel_for(kMirrorPlanes, num_threads, [&](std::size_t plane) {
        std::vector<std::size_t> rest(count);  // the voxel of each place, but for the direction across the plane
        std::vector<double> across(count);
        likeness[plane] = 0;
        const double angle = pi * static_cast<double>(plane) / static_cast<double>(kMirrorPlanes);
        const double c = std::cos(angle), s = std::sin(angle);
        for (std::size_t i = 0; i < count; ++i) {
            const double x = places[3 * i] - center[0] / total, z = places[3 * i + 2] - center[1] / total;
            across[i] = x * c + z * s;
            rest[i] = bin_of(x * s - z * c) * kBins + bin_of(places[3 * i + 1]);
        }
        for (const double shift : kShifts) {
            std::vector<double> voxels(kBins * kBins * kBins);
            for (std::size_t i = 0; i < count; ++i)
                voxels[bin_of(across[i] - shift) * kBins * kBins + rest[i]] += held[i];
            likeness[plane] = std::max(likeness[plane], overlap_of(voxels));
        }
    });
    return likeness;
}

Front find_front(const ViewSample& sample, const double* level, int num_threads) {
    const Around around = look_around(sample, level, num_threads);
    std::vector<double> places(3 * sample.count);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double *axis = level + 3 * (i % 3), *place = &sample.places[i - i % 3];
        places[i] = axis[0] * place[0] + axis[1] * place[1] + axis[2] * place[2];
    }
    const auto likeness = mirror_likeness(places, painted_weights(sample), num_threads);
    const auto best = std::ranges::max_element(likeness);
    const double axis = pi * static_cast<double>(best - likeness.begin()) / static_cast<double>(kMirrorPlanes);
    const double strength = *best / std::max(median(likeness), 1e-9);
    const auto [azimuth, margin] = side_of(around, axis, strength);
    const bool is_right = around.score(azimuth + kBeside) >= around.score(azimuth - kBeside);
    return {azimuth, is_right ? kLean : -kLean, margin, strength};
}

}  // namespace brushgs
