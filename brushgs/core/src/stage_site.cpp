// Where a subject stands.
#include <algorithm>
#include <cmath>

#include "brushgs/extent.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kMostRows = 40'000;  // that are examined: of more every n-th
constexpr double kLevel = 0.85;            // minimum cosine between the normal of a level Gaussian and up
constexpr double kSigmas = 2.0;            // visible extent of a single Gaussian

// Whether the shortest axis of a Gaussian points up or down.
template <class T>
bool is_level(const T* quat, const T* scales, const double* up) {
    const auto shortest = static_cast<std::size_t>(std::min_element(scales, scales + 3) - scales);
    const auto turned = rotation_of(unit_quat(quat));
    return std::abs(turned[shortest] * up[0] + turned[3 + shortest] * up[1] + turned[6 + shortest] * up[2]) > kLevel;
}

}  // namespace

std::array<double, 3> Place::eye_of(const double* viewmat) const {
    double eye[3] = {};
    for (std::size_t i = 0; i < 9; ++i) eye[i % 3] -= viewmat[4 * (i / 3) + i % 3] * viewmat[4 * (i / 3) + 3];
    return local(eye);
}

template <class T>
StageSite find_site(const SceneView<T>& scene, const double* axes, const double* lamp, const Oklab& oklab) {
    const std::size_t step = std::max<std::size_t>((scene.count + kMostRows - 1) / kMostRows, 1);
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < scene.count; row += step) rows.push_back(row);
    const std::size_t count = rows.size();
    const auto means = taken_from(scene.means, 3, rows), scales = taken_from(scene.scales, 3, rows);
    StageSite site{{}, {}, {}, std::vector<double>(count), {}};
    Place& place = site.place;
    std::copy_n(axes, 9, place.axes.begin());
    std::copy_n(lamp, 3, place.lamp.begin());
    projected_areas(scales.data(), count, 0.0, 1, site.weights.data());
    for (std::size_t i = 0; i < count; ++i) {
        site.weights[i] *= static_cast<double>(scene.opacities[rows[i]]);
        site.weights[i] *= static_cast<double>(step);
        const T* const sh = scene.sh + 3 * scene.sh_terms * rows[i];
        const auto lab = oklab.lab_of(base_rgb(sh));
        site.lab.insert(site.lab.end(), lab.begin(), lab.end());
    }
    const Extent extent = robust_extent(means.data(), count, 1);
    std::copy_n(extent.center, 3, place.foot.begin());
    place.radius = extent.radius;
    if (std::equal(means.begin() + 3, means.end(), means.begin())) {  // all at one place
        const double size = kSigmas * static_cast<double>(*std::ranges::max_element(scales));
        if (size > 0) place.radius = size;
    }
    const Standing standing = find_standing(place.all_local(means.data(), count).data(), site.weights, place.radius);
    place.width = standing.width, place.height = standing.height;
    const auto raise = [&](const double* middle) {
        for (std::size_t i = 0; i < 9; ++i) place.foot[i % 3] += middle[i / 3] * place.axes[i];
        site.points = place.all_local(means.data(), count);
    };
    raise(standing.middle);
    std::vector<std::uint8_t> level(count);
    for (std::size_t i = 0; i < count; ++i)
        level[i] = is_level(scene.quats + 4 * rows[i], scene.scales + 3 * rows[i], axes + 3);
    site.ground = find_ground(
        {site.points.data(), level.data(), site.weights.data(), site.lab.data(), count, place.radius, place.height});
    if (!site.ground.is_found) return site;
    const double up[3] = {0, site.ground.level, 0};
    raise(up);
    place.height -= site.ground.level;
    for (std::size_t i = 0; i < count; ++i)
        if (is_on_ground(site.points[3 * i + 1], place.radius)) site.weights[i] = 0;
    return site;
}

template StageSite find_site<float>(const SceneView<float>&, const double*, const double*, const Oklab&);
template StageSite find_site<double>(const SceneView<double>&, const double*, const double*, const Oklab&);

}  // namespace brushgs
