#include "brushgs/view_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/blending.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/project.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/subject.hpp"

namespace brushgs {

namespace {

// A picture costs 0.2 us per row and hardly anything per pixel. With 100,000 rows up and front of 13 scenes are the
// same, in 2.5 times the time; probabilities differ by at most 0.03, the chair's by 0.2.
constexpr std::size_t kMostPainted = 30'000;
constexpr double kFaintest = 0.02;  // opacity: below, haze
constexpr double kDistance = 4;     // of the camera from the middle, in radii
constexpr double kFilled = 0.95;    // share of the picture filled by the sphere around the sample
constexpr double kNear = 0.02;      // radii
constexpr double kLowPass = 0.3;    // pixels squared, as in training
// Sizes (geometric mean of the two larger scales, over the radius) shown as shades 0 and 1.
constexpr double kFinest = 1e-4, kCoarsest = 0.3;
constexpr double kClipped = 0.999;  // quantile at which weights are clipped, against a few huge Gaussians

BoxColumns<float> boxes_of(const ViewSample& sample, const ViewCamera& camera) {
    ProjectParams params{};
    for (std::size_t row = 0; row < 3; ++row) std::copy_n(&camera.axes[3 * row], 3, params.view.viewmat + 4 * row);
    params.view.viewmat[11] = kDistance;
    params.view.fx = params.view.fy = camera.focal();
    params.view.width = params.view.height = camera.side;
    params.view.cx = params.view.cy = 0.5 * camera.side;
    params.view.near = kNear;
    params.num_sigmas = kGaussianSigmas;
    params.low_pass = kLowPass;
    params.num_threads = 1;
    return project<float>({sample.means.data(), sample.quats.data(), sample.scales.data(), sample.opacities.data(),
                           sample.sh.data(), sample.count, 1},
                          params);
}

// `reliefs` as of the boxes of a picture with a height, else null.
void rasterize_plain(const BoxColumns<float>& boxes, int width, int height, const Picture<float>& frame,
                     const float* reliefs = nullptr) {
    BoxView<float> view{};
    view.count = boxes.count;
    view.centers = boxes.centers;
    view.half_extents = boxes.half_extents;
    view.angles = boxes.angles;
    view.colors = boxes.colors;
    view.opacities = boxes.opacities;
    view.depths = boxes.depths;
    view.layers = {frame.layers.count, {{boxes.depths, 1}}};
    view.reliefs = reliefs;
    rasterize<float>({.kernel = Kernel::gaussian,
                      .width = width,
                      .height = height,
                      .num_threads = 1,
                      .min_transmittance = kMinTransmittance,
                      .levels = {},
                      .level_of_box = {}},
                     view, frame);
}

void count_seen(SmallPicture& picture) {
    for (std::size_t pixel = 0; pixel < picture.alpha.size(); ++pixel)
        picture.num_seen += picture.is_seen(pixel) ? 1 : 0;
}

template <class T>
double larger_two(const T* scales) {
    std::array<double, 3> sorted{static_cast<double>(scales[0]), static_cast<double>(scales[1]),
                                 static_cast<double>(scales[2])};
    std::ranges::sort(sorted);
    return sorted[1] * sorted[2];
}

// The rows with extent that are visible in a box.
template <class T>
std::vector<std::uint32_t> visible_rows(const SceneView<T>& scene, const double* low, const double* high,
                                        double radius) {
    std::vector<std::uint32_t> rows;
    for (std::size_t row = 0; row < scene.count; ++row) {
        const T* mean = scene.means + 3 * row;
        const T* scales = scene.scales + 3 * row;
        bool is_inside = static_cast<double>(scene.opacities[row]) > kFaintest &&
                         static_cast<double>(std::max({scales[0], scales[1], scales[2]})) < radius;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto place = static_cast<double>(mean[axis]);
            is_inside = is_inside && place >= low[axis] && place <= high[axis];
        }
        if (is_inside) rows.push_back(static_cast<std::uint32_t>(row));
    }
    return rows;
}

}  // namespace

Axes axes_around(const double* level, double azimuth, double elevation) {
    Axes axes;
    const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
    for (std::size_t k = 0; k < 3; ++k) {
        const double right = level[k], up = -level[3 + k], front = -level[6 + k], toward = ca * front + sa * right;
        axes[k] = ca * right - sa * front;
        axes[3 + k] = se * toward - ce * up;
        axes[6 + k] = -ce * toward - se * up;
    }
    return axes;
}

template <class T>
void add_row(const SceneView<T>& scene, std::size_t row, double growth, ViewSample& sample) {
    std::array<double, 3> scales;
    ++sample.count;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        sample.places.push_back((static_cast<double>(scene.means[3 * row + axis]) - sample.center[axis]) /
                                sample.radius);
        sample.means.push_back(static_cast<float>(sample.places.back()));
        scales[axis] = static_cast<double>(scene.scales[3 * row + axis]) / sample.radius;
        sample.scales.push_back(static_cast<float>(scales[axis] * growth));
        sample.sh.push_back(static_cast<float>(scene.sh[3 * scene.sh_terms * row + axis]));
    }
    sample.areas.push_back(larger_two(scales.data()));
    for (std::size_t k = 0; k < 4; ++k) sample.quats.push_back(static_cast<float>(scene.quats[4 * row + k]));
    sample.opacities.push_back(static_cast<float>(scene.opacities[row]));
}

template <class T>
ViewSample take_view_sample(const SceneView<T>& scene) {
    ViewSample sample;
    const Subject subject = find_subject(scene.means, scene.opacities, scene.count, false);
    double low[3], high[3], squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto place = [&](std::uint32_t row) { return scene.means[3 * std::size_t{row} + axis]; };
        const auto [first, last] = std::ranges::minmax_element(subject.rows, {}, place);
        low[axis] = static_cast<double>(place(*first));
        high[axis] = static_cast<double>(place(*last));
        sample.center[axis] = 0.5 * (low[axis] + high[axis]);
        squares += (high[axis] - low[axis]) * (high[axis] - low[axis]);
    }
    sample.radius = 0.5 * std::sqrt(squares);
    if (!(sample.radius > 0)) return sample;
    const auto rows = visible_rows(scene, low, high, sample.radius);
    const auto chosen = thinned(rows.size(), kMostPainted);
    sample.num_rows = rows.size();
    const double growth = std::sqrt(static_cast<double>(rows.size()) / static_cast<double>(chosen.size()));
    for (const std::uint32_t place : chosen) add_row(scene, rows[place], growth, sample);
    return sample;
}

double ViewCamera::focal() const { return kFilled * 0.5 * side * kDistance; }

std::array<double, 3> ViewCamera::project(const double* point) const {
    std::array<double, 3> seen;
    for (std::size_t row = 0; row < 3; ++row) {
        seen[row] = axes[3 * row] * point[0] + axes[3 * row + 1] * point[1] + axes[3 * row + 2] * point[2];
    }
    const double depth = seen[2] + kDistance;
    return {focal() * seen[0] / depth + 0.5 * side, focal() * seen[1] / depth + 0.5 * side, depth};
}

SmallPicture::SmallPicture(int length)
    : side(static_cast<std::size_t>(length)), rgb(3 * side * side), alpha(side * side) {}

float SmallPicture::unmixed(float premultiplied, std::size_t pixel) const {
    return std::clamp(premultiplied / std::max(alpha[pixel], 1e-3F), 0.0F, 1.0F);
}

ViewPicture paint_view(const SceneView<float>& scene, const PlainView& view) {
    ProjectParams params{};
    std::copy_n(view.viewmat, 12, params.view.viewmat);
    params.view.fx = view.fx, params.view.fy = view.fy, params.view.cx = view.cx, params.view.cy = view.cy;
    params.view.width = view.width, params.view.height = view.height, params.view.near = view.near;
    params.num_sigmas = kGaussianSigmas;
    params.low_pass = kLowPass;
    params.num_threads = 1;
    params.antialiased = view.is_antialiased;
    while (static_cast<std::size_t>((params.sh_degree + 2) * (params.sh_degree + 2)) <= scene.sh_terms)
        ++params.sh_degree;
    const auto boxes = project<float>(
        {scene.means, scene.quats, scene.scales, scene.opacities, scene.sh, scene.count, scene.sh_terms}, params);
    const std::size_t pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    ViewPicture picture{std::vector<float>(3 * pixels), std::vector<float>(pixels)};
    rasterize_plain(boxes, view.width, view.height, {picture.rgb.data(), picture.alpha.data(), {}});
    return picture;
}

SmallPicture paint_shades(const ViewSample& sample, const ViewCamera& camera, const std::vector<float>& red,
                          const std::vector<float>& green) {
    const BoxColumns<float> boxes = boxes_of(sample, camera);
    for (std::size_t i = 0; i < boxes.count; ++i) {
        const auto row = static_cast<std::size_t>(boxes.ids[i]);
        boxes.colors[3 * i] = red[row];
        boxes.colors[3 * i + 1] = green[row];
    }
    SmallPicture picture(camera.side);
    rasterize_plain(boxes, camera.side, camera.side, {picture.rgb.data(), picture.alpha.data(), {}});
    count_seen(picture);
    return picture;
}

SmallPicture paint_with_shade(const ViewSample& sample, const ViewCamera& camera, const std::vector<float>& shades) {
    const BoxColumns<float> boxes = boxes_of(sample, camera);
    // The shade is painted as the height of paint: one picture takes 0.6 of the time of two.
    std::vector<float> heights(2 * boxes.count);
    for (std::size_t i = 0; i < boxes.count; ++i) heights[2 * i] = shades[static_cast<std::size_t>(boxes.ids[i])];
    SmallPicture picture(camera.side);
    picture.depth.resize(picture.alpha.size());
    picture.shades.resize(picture.alpha.size());
    rasterize_plain(boxes, camera.side, camera.side,
                    {picture.rgb.data(), picture.alpha.data(), {1, {{picture.depth.data(), 1}}}, picture.shades.data()},
                    heights.data());
    count_seen(picture);
    return picture;
}

std::vector<float> shades_of_size(const ViewSample& sample) {
    std::vector<float> shades(sample.count);
    std::ranges::transform(sample.areas, shades.begin(), [](double area) {
        const double size = std::sqrt(std::max(area, kFinest * kFinest));
        return static_cast<float>(std::clamp(std::log(size / kFinest) / std::log(kCoarsest / kFinest), 0.0, 1.0));
    });
    return shades;
}

std::vector<double> painted_weights(const ViewSample& sample) {
    std::vector<double> weights(sample.count);
    for (std::size_t i = 0; i < sample.count; ++i)
        weights[i] = static_cast<double>(sample.opacities[i]) * sample.areas[i];
    return clipped(std::move(weights), kClipped);
}

std::vector<double> clipped(std::vector<double> values, double quantile) {
    std::vector<double> copy = values;
    const double most = percentile(copy, quantile);
    for (double& value : values) value = std::min(value, most);
    return values;
}

template void add_row<float>(const SceneView<float>&, std::size_t, double, ViewSample&);
template void add_row<double>(const SceneView<double>&, std::size_t, double, ViewSample&);
template ViewSample take_view_sample<float>(const SceneView<float>&);
template ViewSample take_view_sample<double>(const SceneView<double>&);

}  // namespace brushgs
