#include "brushgs/scene_stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/colors.hpp"
#include "brushgs/draws.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/stage.hpp"
#include "brushgs/view_pictures.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

constexpr std::size_t kMostRows = 40'000;          // that are examined: of more every n-th
constexpr double kLamp[3] = {-0.75, 0.95, -0.55};  // toward it, local: the upper left, a little in front
constexpr double kLevel = 0.85;                    // minimum cosine between the normal of a level Gaussian and up
constexpr double kFringe = 1.5;     // radius of a ground with its torn border, relative to its covered area
constexpr double kOnGround = 1.15;  // radius of the table under a ground, in the same unit
constexpr int kSide = 160;          // pixels, longer side of the picture in which the outline is found
constexpr double kBorder = 0.08;    // of the smaller side of a picture, on each side
constexpr double kFull = 0.8;       // mean alpha of the border above which a scene fills its picture
constexpr double kFine = 0.55;      // size of strokes in the shadow, relative to others at that distance
constexpr double kOverlap = 9.6;    // strokes over each point
constexpr double kJitter = 0.35, kSizeJitter = 0.18;  // in widths of a cell; deviation of the logarithm of sizes
constexpr double kSigmas = 3.6;                       // size of a stroke in standard deviations
constexpr double kThickness = 0.01, kOpacity = 0.95;
constexpr double kShaded = 0.08;                      // minimum shade or contact of fine strokes
constexpr double kTableWave = 0.8, kWallWave = 0.35;  // frequencies of directions, in radii

// Where a subject stands, see Place of brushgs/passes/add/stage_place.py.
struct Place {
    double foot[3], axes[9];  // rows right, up, away
    double radius, width, height, lamp[3];

    template <class T>
    std::array<double, 3> local(const T* point) const {
        std::array<double, 3> found{};
        for (std::size_t i = 0; i < 9; ++i) found[i / 3] += axes[i] * (static_cast<double>(point[i % 3]) - foot[i % 3]);
        return found;
    }
    template <class T>
    Doubles all_local(const std::vector<T>& means) const {
        Doubles points;
        for (std::size_t i = 0; i < means.size(); i += 3) {
            const auto point = local(&means[i]);
            points.insert(points.end(), point.begin(), point.end());
        }
        return points;
    }
    void raise(double level) {
        for (std::size_t k = 0; k < 3; ++k) foot[k] += level * axes[3 + k];
        height -= level;
    }
};

Doubles paint_of(const GaussianColumns& gaussians, double step) {
    Doubles paint(gaussians.count);
    projected_areas(gaussians.scales.data(), gaussians.count, 0.0, 1, paint.data());
    for (std::size_t i = 0; i < paint.size(); ++i) paint[i] *= step * static_cast<double>(gaussians.opacities[i]);
    return paint;
}

Doubles labs_of(const GaussianColumns& gaussians, const Oklab& oklab) {
    Doubles lab;
    for (std::size_t i = 0; i < gaussians.count; ++i) {
        const float* const sh = gaussians.sh.data() + 3 * gaussians.sh_terms * i;
        const auto found = oklab.lab_of({base_color(sh, 0), base_color(sh, 1), base_color(sh, 2)});
        lab.insert(lab.end(), found.begin(), found.end());
    }
    return lab;
}

GaussianColumns every_nth(const GaussianColumns& gaussians, std::size_t step) {
    std::vector<std::uint32_t> rows;
    for (std::size_t row = 0; row < gaussians.count; row += step) rows.push_back(static_cast<std::uint32_t>(row));
    return taken(gaussians, rows);
}

// Whether the shortest axis of a Gaussian points up or down.
bool is_level(const GaussianColumns& gaussians, std::size_t row, const double* up) {
    const float* const scales = gaussians.scales.data() + 3 * row;
    const auto shortest = static_cast<std::size_t>(std::min_element(scales, scales + 3) - scales);
    const auto turned = rotation_of(unit_quat(&gaussians.quats[4 * row]));
    return std::abs(turned[shortest] * up[0] + turned[3 + shortest] * up[1] + turned[6 + shortest] * up[2]) > kLevel;
}

SceneView<float> view_of(const GaussianColumns& gaussians) {
    return {gaussians.means.data(), gaussians.quats.data(), gaussians.scales.data(), gaussians.opacities.data(),
            gaussians.sh.data(),    gaussians.count,        gaussians.sh_terms};
}

PlainView small_view(const PictureView& view, bool is_antialiased) {
    const double share = kSide / std::max(view.width, view.height);
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

double border_alpha(const ViewPicture& picture, int width, int height) {
    const int side = std::max(static_cast<int>(std::nearbyint(kBorder * std::min(width, height))), 1);
    double sum = 0, count = 0;
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            if (row >= side && row < height - side && column >= side && column < width - side) continue;
            sum += static_cast<double>(picture.alpha[static_cast<std::size_t>(row * width + column)]);
            ++count;
        }
    }
    return count > 0 ? sum / count : 0;
}

class Staging {
public:
    Staging(const SceneColumns& scene, const GaussianColumns& strokes, const StageOptions& options)
        : strokes_(strokes),
          options_(options),
          oklab_(options.cones_from_rgb, options.lab_from_roots),
          small_(small_view(options.view, scene.is_antialiased)) {
        find_site(scene);
        points_ = place_.all_local(strokes.means);
        for (std::size_t row = 0; row < 3; ++row) {  // the eye, and directions of the view
            for (std::size_t k = 0; k < 3; ++k) {
                eye_[k] -= options.view.viewmat[4 * row + k] * options.view.viewmat[4 * row + 3];
                for (std::size_t i = 0; i < 3; ++i)
                    rays_[3 * row + i] += options.view.viewmat[4 * row + k] * place_.axes[3 * i + k];
            }
        }
        eye_ = place_.local(eye_.data());
        const double table = ground_.is_found ? kOnGround * ground_.extent : 0;
        profile_ = profile_around(place_.radius, place_.width, place_.height, std::hypot(eye_[0], eye_[2]), table);
    }

    StagedStrokes run() {
        StagedStrokes staged{empty(0), strokes_.opacities, strokes_.sh};
        if (border_alpha(paint_view(view_of(strokes_), small_), small_.width, small_.height) >= kFull) return staged;
        tones_ = find_tones();
        staged.stage = laid();
        if (ground_.is_found) dissolve(staged);
        return staged;
    }

private:
    const GaussianColumns& strokes_;
    const StageOptions& options_;
    Oklab oklab_;
    PlainView small_;
    Place place_{};
    GroundMaps ground_;
    ShadowMaps shadow_;
    Doubles points_;  // of the strokes, local
    std::array<double, 3> eye_{};
    std::array<double, 9> rays_{};
    StageProfile profile_;
    StageTones tones_{};
    Draws draws_;

    static GaussianColumns empty(std::size_t count) {
        const auto column = [count](std::size_t width) { return std::vector<float>(width * count); };
        return {column(3), column(4), column(3), column(1), column(3), count, 1};
    }

    bool is_on_ground(double height) const { return std::abs(height) < kGroundBand * place_.radius; }

    void find_site(const SceneColumns& scene) {
        const std::size_t step = (scene.count + kMostRows - 1) / kMostRows;
        const GaussianColumns sample = every_nth(scene, std::max<std::size_t>(step, 1));
        Doubles weights = paint_of(sample, static_cast<double>(step));
        const Extent extent = robust_extent(sample.means.data(), sample.count, 1);
        std::copy_n(extent.center, 3, place_.foot);
        for (std::size_t i = 0; i < 9; ++i) place_.axes[i] = (i / 3 == 1 ? -1 : 1) * options_.level[i];
        place_.radius = extent.radius;
        const Standing standing = find_standing(place_.all_local(sample.means).data(), weights, extent.radius);
        for (std::size_t i = 0; i < 9; ++i) place_.foot[i % 3] += standing.middle[i / 3] * place_.axes[i];
        place_.width = standing.width, place_.height = standing.height;
        const double length = std::hypot(kLamp[0], kLamp[1], kLamp[2]);
        for (std::size_t k = 0; k < 3; ++k) place_.lamp[k] = kLamp[k] / length;
        const Doubles lab = labs_of(sample, oklab_);
        Doubles points = place_.all_local(sample.means);
        std::vector<std::uint8_t> level(sample.count);
        for (std::size_t i = 0; i < sample.count; ++i) level[i] = is_level(sample, i, place_.axes + 3);
        ground_ = find_ground(
            {points.data(), level.data(), weights.data(), lab.data(), sample.count, place_.radius, place_.height});
        if (ground_.is_found) {
            place_.raise(ground_.level);
            points = place_.all_local(sample.means);
            for (std::size_t i = 0; i < sample.count; ++i)
                if (is_on_ground(points[3 * i + 1])) weights[i] = 0;
        }
        shadow_ = cast_shadow({points.data(), weights.data(), lab.data(), sample.count, place_.radius, place_.lamp});
    }

    StageTones find_tones() const {
        std::vector<std::uint32_t> rows;
        for (std::size_t i = 0; i < strokes_.count; ++i)
            if (!ground_.is_found || !is_on_ground(points_[3 * i + 1])) rows.push_back(static_cast<std::uint32_t>(i));
        const GaussianColumns subject = taken(strokes_, rows);
        const ViewPicture picture = paint_view(view_of(subject), small_);
        const Doubles rgb(picture.rgb.begin(), picture.rgb.end()), alpha(picture.alpha.begin(), picture.alpha.end());
        const Outline outline = outline_in({.rgb = rgb.data(),
                                            .alpha = alpha.data(),
                                            .height = static_cast<std::size_t>(small_.height),
                                            .width = static_cast<std::size_t>(small_.width),
                                            .fx = small_.fx,
                                            .fy = small_.fy,
                                            .cx = small_.cx,
                                            .cy = small_.cy,
                                            .rays = rays_.data(),
                                            .eye = eye_.data(),
                                            .table = profile_.table,
                                            .wall = profile_.wall,
                                            .radius = place_.radius,
                                            .own = ground_.is_found ? kFringe * ground_.extent : 0,
                                            .cones_from_rgb = options_.cones_from_rgb,
                                            .lab_from_roots = options_.lab_from_roots});
        return choose_tones(outline, {.mean = mean_of(subject),
                                      .low = 0,
                                      .high = 1,
                                      .ground = ground_.is_found ? ground_.tone.data() : nullptr,
                                      .values = options_.values});
    }

    std::array<double, 3> mean_of(const GaussianColumns& subject) const {
        const Doubles paint = paint_of(subject, 1), lab = labs_of(subject, oklab_);
        std::array<double, 3> mean{};
        double sum = 0;
        for (std::size_t i = 0; i < subject.count; ++i) {
            sum += paint[i];
            for (std::size_t k = 0; k < 3; ++k) mean[k] += paint[i] * lab[3 * i + k];
        }
        if (!(sum > 0)) return oklab_.lab_of({0.5, 0.5, 0.5});
        for (double& value : mean) value /= sum;
        return mean;
    }

    struct Laid {
        StageSpots spots;
        Doubles sizes, noise;
    };
    Laid lay(double size, double until, bool is_fine) {
        const ProfileView profile(profile_);
        const double distance = std::hypot(eye_[0], eye_[1], eye_[2]);
        const StageEye eye{distance, distance * options_.view.width / options_.view.fx};
        Doubles sizes = stroke_sizes(profile, place_.radius, place_.width, eye), cells = sizes;
        for (std::size_t i = 0; i < sizes.size(); ++i) sizes[i] *= size, cells[i] = sizes[i] * sizes[i] / kOverlap;
        const std::size_t count = count_spots(profile, cells.data(), until);
        Laid all{{}, {}, Doubles(kSpotNoise * count)}, kept;
        for (double& value : all.noise) value = draws_.next_normal();
        all.spots = place_spots(profile, cells.data(), count, kJitter, all.noise.data());
        all.sizes = along_profile(profile, sizes.data(), all.spots.along);
        for (std::size_t i = 0; i < count; ++i) {
            const double* const point = &all.spots.points[3 * i];
            const Shade shade = shadow_view().at(point);
            const bool is_shaded = options_.shadow > 0 && std::max(shade.shade, shade.contact) > kShaded;
            if (is_shaded != is_fine) continue;
            kept.spots.points.insert(kept.spots.points.end(), point, point + 3);
            kept.spots.around.push_back(all.spots.around[i]);
            kept.spots.along.push_back(all.spots.along[i]);
            kept.sizes.push_back(all.sizes[i]);
            const double* const noise = &all.noise[kSpotNoise * i];
            kept.noise.insert(kept.noise.end(), noise, noise + kSpotNoise);
        }
        return kept;
    }

    ShadowView shadow_view() const {
        return {shadow_.shade.data(), shadow_.contact.data(), shadow_.reflected.data(), place_.radius, place_.lamp};
    }

    GaussianColumns laid() {
        const double ratio = std::sqrt(options_.usual_strokes / static_cast<double>(strokes_.count));
        const double size = std::clamp(ratio, options_.least_size, options_.most_size) * options_.size;
        Laid all = lay(size, std::numeric_limits<double>::infinity(), false);
        const Laid fine = lay(kFine * std::min(size, 1.0), kShadowReach * place_.radius, true);
        const auto join = [](Doubles& to, const Doubles& more) { to.insert(to.end(), more.begin(), more.end()); };
        join(all.spots.points, fine.spots.points);
        join(all.spots.around, fine.spots.around);
        join(all.spots.along, fine.spots.along);
        join(all.sizes, fine.sizes);
        join(all.noise, fine.noise);
        return strokes_at(all);
    }

    GaussianColumns strokes_at(const Laid& all) {
        const ProfileView profile(profile_);
        const std::size_t count = all.sizes.size();
        const Doubles angles = profile_slopes(profile), slopes = along_profile(profile, angles.data(), all.spots.along);
        const StagePoints at{all.spots.points.data(), slopes.data(), count};
        const Doubles lab = colors_at(at, all.noise), frames = frames_at(at, all);
        GaussianColumns found = empty(count);
        const double root = std::sqrt(options_.aspect), sides[3] = {root, 1 / root, kThickness};
        for (std::size_t i = 0; i < count; ++i) {
            const double size = all.sizes[i] * std::exp(kSizeJitter * all.noise[kSpotNoise * i + 2]) / kSigmas;
            const auto rgb = oklab_.rgb_of({lab[3 * i], lab[3 * i + 1], lab[3 * i + 2]});
            for (std::size_t k = 0; k < 3; ++k) {
                double mean = place_.foot[k];
                for (std::size_t axis = 0; axis < 3; ++axis)
                    mean += at.points[3 * i + axis] * place_.axes[3 * axis + k];
                found.means[3 * i + k] = static_cast<float>(mean);
                found.scales[3 * i + k] = static_cast<float>(size * sides[k]);
                found.sh[3 * i + k] = static_cast<float>((std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0);
            }
            found.opacities[i] = static_cast<float>(kOpacity);
            turn(&frames[9 * i], &found.quats[4 * i]);
        }
        return found;
    }

    // The quaternion of local axes, which are left-handed.
    void turn(const double* frame, float* quat) const {
        double m[9] = {};
        for (std::size_t i = 0; i < 27; ++i) {
            const std::size_t row = i / 9, column = i / 3 % 3, k = i % 3;
            m[3 * row + column] += place_.axes[3 * k + row] * frame[3 * k + column];
        }
        const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                                   m[2] * (m[3] * m[7] - m[4] * m[6]);
        for (std::size_t row = 0; row < 3 && determinant < 0; ++row) m[3 * row + 1] = -m[3 * row + 1];
        write_quat(m, quat);
    }

    Doubles colors_at(const StagePoints& at, const Doubles& noise) const {
        constexpr std::size_t cells = kGroundSide * kGroundSide;
        const LevelGrid grid{kGroundSide, kGroundReach * place_.radius};
        Doubles lab(3 * at.count), own;
        for (std::size_t i = 0; i < 3 * at.count && ground_.is_found; ++i) {
            const double* const point = at.points + i / 3 * 3;
            own.push_back(grid.sample(ground_.lab.data() + i % 3 * cells, point[0], point[2]));
        }
        surface_colors(at, tones_, profile_.wall, own.empty() ? nullptr : own.data(), ground_.extent, lab.data());
        const double jitter[3] = {options_.lightness, options_.chroma, options_.chroma};
        for (std::size_t i = 0; i < at.count; ++i) {
            const double* const point = at.points + 3 * i;
            const double covered = ground_.is_found ? grid.sample(ground_.coverage.data(), point[0], point[2]) : 0;
            if (options_.shadow > 0) shade_color(shadow_view().at(point), options_.shadow * (1 - covered), &lab[3 * i]);
            for (std::size_t k = 0; k < 3; ++k) lab[3 * i + k] += noise[kSpotNoise * i + 3 + k] * jitter[k];
        }
        return lab;
    }

    Doubles frames_at(const StagePoints& at, const Laid& all) {
        Doubles frames(9 * at.count), turns, waves;
        for (std::size_t i = 0; i < at.count; ++i) turns.push_back(all.noise[kSpotNoise * i + 6]);
        for (std::size_t wave = 0; wave < 2 * kWaves; ++wave) {
            for (std::size_t k = 0; k < 3; ++k)
                waves.push_back((wave < kWaves ? kTableWave : kWallWave) * draws_.next_normal());
            waves.push_back(2 * std::numbers::pi * draws_.next());
        }
        stage_frames({at, all.spots.around.data(), turns.data(), waves.data(), waves.data() + 4 * kWaves,
                      profile_.table, place_.radius, true},
                     frames.data());
        return frames;
    }

    void dissolve(StagedStrokes& staged) const {
        const auto rgb = oklab_.rgb_of(tones_.table);
        const std::size_t width = 3 * strokes_.sh_terms;
        for (std::size_t i = 0; i < strokes_.count; ++i) {
            const Dissolving found = dissolving_at(ground_.coverage.data(), place_.radius, &points_[3 * i]);
            if (found.is_under) staged.opacities[i] = 0;
            for (std::size_t k = 0; k < width; ++k) {
                double value = static_cast<double>(staged.sh[width * i + k]) * (1 - found.share);
                if (k < 3) value += found.share * (std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0;
                staged.sh[width * i + k] = static_cast<float>(value);
            }
        }
    }
};

}  // namespace

StagedStrokes staged_strokes(const SceneColumns& scene, const GaussianColumns& strokes, const StageOptions& options) {
    if (scene.count == 0 || strokes.count == 0) return {{}, strokes.opacities, strokes.sh};
    return Staging(scene, strokes, options).run();
}

}  // namespace brushgs
