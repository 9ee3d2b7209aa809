#include "brushgs/scene_stage.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/draws.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/stage.hpp"
#include "brushgs/view_pictures.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

SceneView<float> view_of(const GaussianColumns& gaussians) {
    return {gaussians.means.data(), gaussians.quats.data(), gaussians.scales.data(), gaussians.opacities.data(),
            gaussians.sh.data(),    gaussians.count,        gaussians.sh_terms};
}

PlainView small_view(const PictureView& view, bool is_antialiased) {
    const double share = kOutlineSide / std::max(view.width, view.height);
    PlainView small{};
    std::copy_n(view.viewmat, 12, small.viewmat);
    small.width = std::max(static_cast<int>(std::nearbyint(share * view.width)), 1);
    small.height = std::max(static_cast<int>(std::nearbyint(share * view.height)), 1);
    const double factor = small.height / view.height;
    small.fx = view.fx * factor, small.fy = view.fy * factor;
    small.cx = 0.5 * small.width, small.cy = 0.5 * small.height;
    small.near = view.near;
    small.is_antialiased = is_antialiased;
    return small;
}

class Staging {
public:
    Staging(const SceneColumns& scene, const GaussianColumns& strokes, const StageOptions& options)
        : strokes_(strokes),
          options_(options),
          oklab_(options.cones_from_rgb, options.lab_from_roots),
          small_(small_view(options.view, scene.is_antialiased)) {
        double axes[9], lamp[3];
        for (std::size_t i = 0; i < 9; ++i) axes[i] = (i / 3 == 1 ? -1 : 1) * options.level[i];
        const double length = std::hypot(kLamp[0], kLamp[1], kLamp[2]);
        for (std::size_t k = 0; k < 3; ++k) lamp[k] = kLamp[k] / length;
        site_ = find_site(view_of(scene), axes, lamp, oklab_);
        eye_ = site_.place.eye_of(options.view.viewmat);
        profile_ = profile_around(site_.place, std::hypot(eye_[0], eye_[2]), site_.ground.extent);
    }

    StagedStrokes run() {
        StagedStrokes staged{{}, strokes_.opacities, strokes_.sh};
        const auto height = static_cast<std::size_t>(small_.height), width = static_cast<std::size_t>(small_.width);
        if (border_alpha(paint_view(view_of(strokes_), small_).alpha.data(), height, width) >= kFullBorder)
            return staged;
        const GroundMaps& found = site_.ground;
        const GroundView ground(found.coverage.data(), found.lab.data(), found.extent, site_.place.radius);
        const GroundView* const own = found.is_found ? &ground : nullptr;
        const StageTones tones = find_tones(height, width);
        staged.stage = laid(tones, own);
        if (own != nullptr)
            dissolve<float>(
                site_.place, ground, tones.table.data(), oklab_,
                {strokes_.means.data(), strokes_.count, strokes_.sh_terms, staged.opacities.data(), staged.sh.data()});
        return staged;
    }

private:
    const GaussianColumns& strokes_;
    const StageOptions& options_;
    Oklab oklab_;
    PlainView small_;
    StageSite site_;
    std::array<double, 3> eye_{};
    StageProfile profile_;

    StageTones find_tones(std::size_t height, std::size_t width) const {
        const Place& place = site_.place;
        std::vector<std::uint32_t> rows;
        for (std::uint32_t i = 0; i < strokes_.count; ++i)
            if (!site_.ground.is_found || !is_on_ground(place.local(&strokes_.means[3 * i])[1], place.radius))
                rows.push_back(i);
        const GaussianColumns subject = taken(strokes_, rows);
        const ViewPicture picture = paint_view(view_of(subject), small_);
        const Doubles rgb(picture.rgb.begin(), picture.rgb.end()), alpha(picture.alpha.begin(), picture.alpha.end());
        const Outline outline = outline_in(
            {rgb.data(), alpha.data(), height, width, small_.viewmat, small_.fx, small_.fy, small_.cx, small_.cy},
            place, profile_.view(), site_.ground.extent, oklab_);
        return choose_tones(outline, {.mean = mean_lab(subject, oklab_),
                                      .low = 0,
                                      .high = 1,
                                      .ground = site_.ground.is_found ? site_.ground.tone.data() : nullptr,
                                      .values = options_.values});
    }

    GaussianColumns laid(const StageTones& tones, const GroundView* ground) const {
        const Place& place = site_.place;
        const ProfileView profile = profile_.view();
        const ShadowMaps maps = cast_shadow({site_.points.data(), site_.weights.data(), site_.lab.data(),
                                             site_.weights.size(), place.radius, place.lamp.data()});
        const ShadowView shadow = maps.view(place);
        const double distance = std::hypot(eye_[0], eye_[1], eye_[2]);
        const Doubles usual = stroke_sizes(profile, place, distance, distance * options_.view.width / options_.view.fx);
        const double size = size_beside(strokes_.count) * options_.size;
        const std::vector<ShadowView> shadows(options_.shadow > 0 ? 1 : 0, shadow);
        Draws draws;
        const StageSpots all =
            lay_layers(profile, usual.data(), size, place.radius, shadows, [&](std::size_t, std::size_t count) {
                Doubles noise(kSpotNoise * count);
                for (double& value : noise) value = draws.next_normal();
                return noise;
            });
        const SpotsView spots = all.view();
        Doubles waves(8 * kWaves);
        for (std::size_t i = 0; i < waves.size(); ++i) waves[i] = i % 4 == 3 ? draws.next() : draws.next_normal();
        Doubles lab = surface_colors(profile, spots, tones, ground);
        if (options_.shadow > 0) shade_colors(spots, shadow, options_.shadow, ground, lab.data());
        const Doubles frames = stage_frames(profile, spots, waves.data(), place.radius, true);
        const auto [means, quats, scales, opacities, sh] =
            strokes_on(place, spots, frames.data(), lab.data(),
                       {options_.aspect, {options_.lightness, options_.chroma}, nullptr, nullptr}, oklab_);
        const auto floats = [](const Doubles& values) { return std::vector<float>(values.begin(), values.end()); };
        return {floats(means), floats(quats), floats(scales), floats(opacities), floats(sh), spots.count, 1};
    }
};

}  // namespace

std::array<double, 3> mean_lab(const GaussianColumns& gaussians, const Oklab& oklab) {
    const Doubles paint = paint_of(gaussians.scales.data(), gaussians.opacities.data(), gaussians.count, 1);
    return mean_lab(gaussians.sh.data(), gaussians.sh_terms, paint.data(), gaussians.count, oklab);
}

StagedStrokes staged_strokes(const SceneColumns& scene, const GaussianColumns& strokes, const StageOptions& options) {
    if (scene.count == 0 || strokes.count == 0) return {{}, strokes.opacities, strokes.sh};
    return Staging(scene, strokes, options).run();
}

}  // namespace brushgs
