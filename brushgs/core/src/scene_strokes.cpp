#include "brushgs/scene_strokes.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/broken_color.hpp"
#include "brushgs/colors.hpp"
#include "brushgs/equal_rows.hpp"
#include "brushgs/features.hpp"
#include "brushgs/floaters.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/merge.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/prune.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/solid.hpp"
#include "brushgs/stroke_form.hpp"
#include "brushgs/visible_shares.hpp"
#include "brushgs/worth.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;
constexpr int kThreads = 1;  // a page has no more

GaussianColumns empty_strokes(std::size_t count, std::size_t sh_terms) {
    const auto column = [count](std::size_t width) { return std::vector<float>(width * count); };
    return {column(3), column(4), column(3), column(1), column(3 * sh_terms), count, sh_terms};
}

double finest_of(const SceneColumns& scene, const Extent& extent, const StrokeOptions& options) {
    return scene.is_antialiased ? 0 : options.finest * extent.radius;
}

// What pictures show of Gaussians.
struct Shown {
    Doubles areas;    // projected, world units squared over pi
    Doubles visible;  // shares of directions
    Doubles places;   // contracted positions [count, 3]

    double contribution(const GaussianColumns& scene, std::size_t row) const {
        return static_cast<double>(scene.opacities[row]) * areas[row] * visible[row];
    }
};

Shown shown_of(const GaussianColumns& scene, const Extent& extent, double finest) {
    Shown shown{Doubles(scene.count), Doubles(scene.count), Doubles(3 * scene.count)};
    Doubles factors(scene.count);
    projected_areas(scene.scales.data(), scene.count, finest, kThreads, shown.areas.data());
    visible_shares<float>({scene.means.data(), scene.opacities.data(), shown.areas.data(), scene.count, extent,
                           kThreads, shown.visible.data()});
    contract_all(scene.means.data(), scene.count, extent, kThreads, shown.places.data(), factors.data());
    return shown;
}

Doubles contributions_of(const GaussianColumns& scene, const Shown& shown) {
    Doubles found(scene.count);
    for (std::size_t i = 0; i < scene.count; ++i) found[i] = shown.contribution(scene, i);
    return found;
}

// Weights of the Gaussians in k-means, by their contribution to pictures and the detail of color around them.
Doubles weights_of(const GaussianColumns& scene, const Shown& shown) {
    Doubles detail(scene.count), weights(scene.count);
    color_detail(scene.sh.data(), scene.sh_terms, shown.places.data(), scene.count, kThreads, detail.data());
    cluster_weights(contributions_of(scene, shown).data(), detail.data(), scene.count, weights.data());
    return weights;
}

// What `brushgs.prune(gaussians, at_least=num_strokes)` keeps.
SceneColumns pruned(const SceneColumns& scene, const Extent& extent, const StrokeOptions& options) {
    const std::size_t count = scene.count;
    const auto share = static_cast<std::size_t>(std::floor(options.keep * static_cast<double>(count) + 0.5));
    std::size_t num_kept = std::max({std::size_t{1}, options.num_strokes, share});
    if (num_kept >= count) return scene;
    const Shown shown = shown_of(scene, extent, finest_of(scene, extent, options));
    const Doubles weights = contributions_of(scene, shown);
    Doubles ranked(count);
    spread_weights(weights.data(), shown.places.data(), count, kThreads, ranked.data());
    num_kept = std::max(num_kept, count - count_spare(weights.data(), ranked.data(), count, kThreads));
    std::vector<std::uint8_t> is_kept(count);
    mark_highest(ranked.data(), count, num_kept, is_kept.data());
    SceneColumns kept;
    kept.is_antialiased = scene.is_antialiased;
    static_cast<GaussianColumns&>(kept) = taken(scene, marked(is_kept));
    return kept;
}

GaussianColumns merged(const GaussianColumns& scene, const Extent& extent, double finest, const StrokeOptions& options,
                       void (*tell)(double share)) {
    const Shown shown = shown_of(scene, extent, finest);
    std::vector<float> points(kFeatures * scene.count);
    cluster_features<float>({scene.means.data(), scene.scales.data(), scene.sh.data(), scene.count, scene.sh_terms,
                             extent, options.color_weight, kThreads},
                            points.data());
    const Doubles weights = weights_of(scene, shown);
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
         shown.areas.data(),
         shown.visible.data(),
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

StrokeQuery<float> query_of(const GaussianColumns& strokes, double finest) {
    return {strokes.means.data(),
            strokes.quats.data(),
            strokes.scales.data(),
            strokes.opacities.data(),
            strokes.count,
            finest,
            kThreads};
}

// What `brushgs.orient(strokes, gaussians)` makes of strokes.
void turn_along_form(const GaussianColumns& gaussians, const double* xyz_over_white, GaussianColumns& strokes) {
    if (strokes.count == 0) return;
    const StrokeForm form =
        form_of<float>({strokes.means.data(), strokes.quats.data(), strokes.scales.data(), strokes.sh.data(),
                        strokes.count, strokes.sh_terms, xyz_over_white, kThreads});
    const FormField field =
        form_field<float>(form,
                          {gaussians.means.data(), gaussians.scales.data(), gaussians.opacities.data(),
                           gaussians.sh.data(), gaussians.count, gaussians.sh_terms, xyz_over_white},
                          false);
    std::vector<float> quats(4 * strokes.count), scales(3 * strokes.count);
    turn_strokes(form, field.pairs.data(), field.weights.data(), {}, strokes.quats.data(), quats.data(), scales.data());
    strokes.quats = std::move(quats);
    strokes.scales = std::move(scales);
}

// What `grade` and `use_pigments` of a look make of colors.
void color(const StrokeOptions& options, GaussianColumns& strokes) {
    grade(options.grading, options.cones_from_rgb, options.lab_from_roots, strokes.count, strokes.sh_terms,
          strokes.sh.data());
    if (options.num_pigments == 0) return;
    Doubles rgb(3 * strokes.count);
    mix_pigments<float>({strokes.scales.data(), strokes.opacities.data(), strokes.sh.data(), strokes.count,
                         strokes.sh_terms, options.cones_from_rgb, options.lab_from_roots},
                        {options.num_pigments, options.pure, options.draws, static_cast<int>(options.num_steps),
                         options.gain, kThreads},
                        rgb.data());
    strokes.sh_terms = 1;
    strokes.sh.clear();
    for (const double value : rgb) strokes.sh.push_back(static_cast<float>((value - 0.5) / kBand0));
}

}  // namespace

Reach reach_in(const PictureView& view, const std::vector<double>& points) {
    constexpr double within = 0.98;
    Doubles across, down;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        double seen[3];
        for (std::size_t row = 0; row < 3; ++row) {
            const double* m = view.viewmat + 4 * row;
            seen[row] = m[3];
            for (std::size_t k = 0; k < 3; ++k) seen[row] += m[k] * points[i + k];
        }
        if (seen[2] <= view.near) continue;
        across.push_back(std::abs(view.fx * seen[0] / seen[2]));
        down.push_back(std::abs(view.fy * seen[1] / seen[2]));
    }
    if (across.empty() || 6 * across.size() < points.size()) return {};
    return {std::max(std::min(percentile(across, within), view.width / 2), 1.0),
            std::max(std::min(percentile(down, within), view.height / 2), 1.0)};
}

void clean_scene(SceneColumns& scene) {
    const auto grouped = [&scene](bool by_all) {
        std::vector<std::uint64_t> hashes(scene.count);
        std::size_t place = 1;
        const auto add = [&](const std::vector<float>& column, std::size_t width) {
            hash_rows(column.data(), scene.count, width, place, hashes.data());
            place += width;
        };
        add(scene.means, 3);
        if (by_all)
            add(scene.quats, 4), add(scene.scales, 3), add(scene.opacities, 1), add(scene.sh, 3 * scene.sh_terms);
        return group_equal(hashes.data(), scene.count, kThreads);
    };
    const EqualRows places = grouped(false);
    const Floaters found = find_floaters<float>(
        {scene.means.data(), scene.quats.data(), scene.scales.data(), scene.opacities.data(), scene.count, kThreads},
        places.first, places.groups);
    LateCopies dropped = late_copies(places.groups);
    if (dropped.any) dropped = late_copies(grouped(true).groups);
    for (std::size_t i = 0; found.sure.is_seen && i < scene.count; ++i) dropped.rows[i] |= found.sure.rows[i];
    const auto kept = marked(dropped.rows, 0);
    if (kept.size() < scene.count) static_cast<GaussianColumns&>(scene) = taken(scene, kept);
}

GaussianColumns strokes_of_scene(const SceneColumns& scene, const Extent& extent, const StrokeOptions& options,
                                 void (*tell)(double share)) {
    const SceneColumns kept = pruned(scene, extent, options);
    tell(0.2);
    const Extent extent_kept = robust_extent(kept.means.data(), kept.count, kThreads);
    const double finest = finest_of(kept, extent_kept, options);
    GaussianColumns strokes;
    if (kept.count > options.num_strokes) {
        strokes = merged(kept, extent_kept, finest, options, tell);
        const auto rows = marked(worth_keeping(query_of(strokes, finest)));
        if (!rows.empty()) strokes = taken(strokes, rows);
    } else {
        strokes = kept;
    }
    const StrokeQuery<float> query = query_of(strokes, finest);
    std::vector<float> scales(3 * strokes.count), opacities(strokes.count);
    make_solid(query, options.solid, scales.data(), opacities.data());
    strokes.scales = std::move(scales);
    strokes.opacities = std::move(opacities);
    turn_along_form(kept, options.xyz_over_white, strokes);
    color(options, strokes);
    break_colors<float>({.means = strokes.means.data(),
                         .scales = strokes.scales.data(),
                         .opacities = strokes.opacities.data(),
                         .count = strokes.count,
                         .sh_terms = strokes.sh_terms,
                         .cones_from_rgb = options.cones_from_rgb,
                         .lab_from_roots = options.lab_from_roots,
                         .lightness = options.lightness,
                         .chroma = options.chroma,
                         .follows = options.follows,
                         .seed = 0,
                         .num_threads = kThreads},
                        strokes.sh.data());
    return strokes;
}

}  // namespace brushgs
