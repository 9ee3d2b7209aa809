#include <algorithm>
#include <cmath>

#include "brushgs/extent.hpp"
#include "brushgs/framing.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/quats.hpp"

namespace brushgs {

namespace {

constexpr double kHangs = 0.006;         // of the object's height, minimum reach of a crumb below its foot
constexpr double kVisibleReach = 2;      // standard deviations, visible extent of a Gaussian
constexpr double kSmeared = 2;           // medians of all vertical extents, minimum of a smeared Gaussian
constexpr std::size_t kSample = 20'000;  // rows of that median
// Below the center of a crumb is a quarter of its paint and more; below Gaussians of the foot of a boot, which ends
// there, a tenth and less.
constexpr double kAbove = 0.7;    // standard deviations by which the center of a crumb may lie above the foot
constexpr double kCoarse = 0.01;  // of the height: a leg completely below the foot is finer,
constexpr double kFaint = 0.1;    // and its opacity is not below this
constexpr double kMost = 0.15;    // of the paint

// Standard deviations of a Gaussian along up, and across it.
struct Extents {
    double upright, level;
};

template <class T>
Extents extents_of(const SceneView<T>& scene, std::size_t row, const double* up) {
    const auto turned = rotation_of(unit_quat(scene.quats + 4 * row));
    double upright = 0, sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto scale = static_cast<double>(scene.scales[3 * row + axis]);
        const double along = turned[axis] * up[0] + turned[3 + axis] * up[1] + turned[6 + axis] * up[2];
        upright += along * along * scale * scale;
        sum += scale * scale;
    }
    return {std::sqrt(upright), std::sqrt(0.5 * std::max(sum - upright, 0.0))};
}

}  // namespace

template <class T>
std::vector<std::uint8_t> find_crumbs(const SceneView<T>& scene, const double* up, double foot, double height) {
    std::vector<std::uint8_t> found(scene.count);
    if (scene.count == 0) return found;
    std::vector<double> extents;
    const std::size_t step = (scene.count + kSample - 1) / kSample;
    for (std::size_t row = 0; row < scene.count; row += step) extents.push_back(extents_of(scene, row, up).upright);
    const double usual = percentile(extents, 0.5) / height;
    const std::vector<double> paint = paint_of(scene.scales, scene.opacities, scene.count, 1);
    double sum = 0, of_crumbs = 0;
    for (std::size_t row = 0; row < scene.count; ++row) {
        const T *mean = scene.means + 3 * row, *scales = scene.scales + 3 * row;
        const auto opacity = static_cast<double>(scene.opacities[row]);
        sum += paint[row];
        double above = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) above += static_cast<double>(mean[axis]) * up[axis];
        above = (above - foot) / height;
        if (!(above < kAbove / height * static_cast<double>(std::max({scales[0], scales[1], scales[2]})))) continue;
        const Extents extent = extents_of(scene, row, up);
        const double upright = extent.upright / height, level = extent.level / height;
        const bool hangs =
            above < kAbove * upright && above - kVisibleReach * upright < -kHangs && upright > kSmeared * usual;
        const bool is_below = above + upright < 0;
        if (!hangs || (is_below && !(level > kCoarse) && !(opacity < kFaint))) continue;
        found[row] = 1;
        of_crumbs += paint[row];
    }
    if (of_crumbs > kMost * sum) std::ranges::fill(found, std::uint8_t{0});
    return found;
}

template std::vector<std::uint8_t> find_crumbs<float>(const SceneView<float>&, const double*, double, double);
template std::vector<std::uint8_t> find_crumbs<double>(const SceneView<double>&, const double*, double, double);

}  // namespace brushgs
