#include "brushgs/scene_strokes.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/features.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/merge.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/visible_shares.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;
constexpr int kThreads = 1;  // a page has no more

GaussianColumns empty_strokes(std::size_t count, std::size_t sh_terms) {
    const auto column = [count](std::size_t width) { return std::vector<float>(width * count); };
    return {column(3), column(4), column(3), column(1), column(3 * sh_terms), count, sh_terms};
}

// Weights of the Gaussians in k-means, by their contribution to pictures and the detail of color around them.
Doubles weights_of(const GaussianColumns& scene, const Extent& extent, const Doubles& areas, const Doubles& visible) {
    Doubles places(3 * scene.count), factors(scene.count), detail(scene.count), weights(scene.count);
    contract_all(scene.means.data(), scene.count, extent, kThreads, places.data(), factors.data());
    color_detail(scene.sh.data(), scene.sh_terms, places.data(), scene.count, kThreads, detail.data());
    Doubles& contributions = factors;  // which are not needed
    for (std::size_t i = 0; i < scene.count; ++i) {
        contributions[i] = static_cast<double>(scene.opacities[i]) * areas[i] * visible[i];
    }
    cluster_weights(contributions.data(), detail.data(), scene.count, weights.data());
    return weights;
}

}  // namespace

Reach reach_in(const PictureView& view, const float* means, std::size_t count) {
    constexpr double within = 0.98;
    Doubles across, down;
    for (std::size_t i = 0; i < count; ++i) {
        double seen[3];
        for (std::size_t row = 0; row < 3; ++row) {
            const double* m = view.viewmat + 4 * row;
            seen[row] = m[3];
            for (std::size_t k = 0; k < 3; ++k) seen[row] += m[k] * static_cast<double>(means[3 * i + k]);
        }
        if (seen[2] <= view.near) continue;
        across.push_back(std::abs(view.fx * seen[0] / seen[2]));
        down.push_back(std::abs(view.fy * seen[1] / seen[2]));
    }
    if (across.empty() || 2 * across.size() < count) return {};
    return {std::max(std::min(percentile(across, within), view.width / 2), 1.0),
            std::max(std::min(percentile(down, within), view.height / 2), 1.0)};
}

GaussianColumns strokes_of_scene(const SceneColumns& scene, const Extent& extent, const StrokeOptions& options,
                                 void (*tell)(double share)) {
    if (scene.count <= options.num_strokes) return scene;
    const double finest = scene.is_antialiased ? 0 : options.finest * extent.radius;
    Doubles areas(scene.count), visible(scene.count);
    projected_areas(scene.scales.data(), scene.count, finest, kThreads, areas.data());
    visible_shares<float>(
        {scene.means.data(), scene.opacities.data(), areas.data(), scene.count, extent, kThreads, visible.data()});
    tell(0.3);
    std::vector<float> points(kFeatures * scene.count);
    cluster_features<float>({scene.means.data(), scene.scales.data(), scene.sh.data(), scene.count, scene.sh_terms,
                             extent, options.color_weight, kThreads},
                            points.data());
    const Doubles weights = weights_of(scene, extent, areas, visible);
    tell(0.4);
    const Clusters found = find_clusters(
        {points.data(), weights.data(), scene.count, kFeatures},
        {options.num_strokes, options.draws, static_cast<int>(options.num_steps), options.gain, kThreads});
    tell(0.9);
    GaussianColumns strokes = empty_strokes(found.num_clusters, scene.sh_terms);
    cover_members<float>(
        {{scene.means.data(), scene.quats.data(), scene.scales.data(), scene.opacities.data(), scene.sh.data()},
         scene.count,
         scene.sh_terms,
         areas.data(),
         visible.data(),
         found.labels.get(),
         found.num_clusters,
         options.overlap,
         true,
         finest,
         kThreads},
        {strokes.means.data(), strokes.quats.data(), strokes.scales.data(), strokes.opacities.data(),
         strokes.sh.data()});
    return strokes;
}

}  // namespace brushgs
