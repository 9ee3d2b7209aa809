// The surface of a stage: table, cove and wall, and the places, directions and colors of strokes on it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kSteps = 400;             // of a profile
constexpr double kBeyondEye = 1.5;              // distance of the wall, relative to the farthest camera
constexpr double kTable = 3.0;                  // radius of the level table, relative to the subject
constexpr double kOnGround = 1.15;              // radius of the table under a ground, relative to its covered area
constexpr double kRise = 0.85, kTop = 1.1;      // heights of the cove and of the wall above it, in its distances
constexpr double kGolden = 2.3999632297286535;  // the golden angle, pi (3 - sqrt(5)): no two spots line up
// Sizes of strokes, the root of length times width, in widths of the picture: near the subject and far from it, by
// distance in its radii; and the minimum, in radii, even for a close camera.
constexpr double kNearSize = 0.12, kFarSize = 0.26, kFar = 3.0, kLeastSize = 0.1;
constexpr double kJitter = 0.35;  // of places, in widths of a cell
struct Sway {
    double most, frequency;  // radians; in radii of the subject
};
constexpr Sway kTableSway{0.16, 0.8}, kWallSway{0.9, 0.35};  // of directions, in broad waves
constexpr double kLoose = 0.16;                              // radians, of every stroke
constexpr double kLevelUpTo = 0.7;         // share of the table beyond which strokes turn along its edge
constexpr double kBlend[2] = {0.02, 0.6};  // slopes of the cove over which table blends into wall, radians
constexpr double kUpper = 0.10, kFarTable = 0.04, kFront = 0.03;  // darkening of the wall upward, of the table
constexpr double kDarkest = 0.52, kContact = 0.30;  // reduction of lightness by full shadow and full contact
constexpr double kCooler[2] = {-0.003, -0.016};     // change of a and b in full shadow
constexpr double kReflected = 0.5;                  // share of the color of near objects in their reflection

// As numpy.interp; x ascends.
double interpolated(const double* x, const double* y, std::size_t count, double at) {
    if (!(at > x[0])) return y[0];
    if (at >= x[count - 1]) return y[count - 1];
    const auto next = static_cast<std::size_t>(std::upper_bound(x, x + count, at) - x);
    const double slope = (y[next] - y[next - 1]) / (x[next] - x[next - 1]);
    return slope * (at - x[next - 1]) + y[next - 1];
}

// As numpy.gradient.
double gradient(const double* values, std::size_t count, std::size_t i) {
    if (i == 0) return values[1] - values[0];
    if (i == count - 1) return values[i] - values[i - 1];
    return (values[i + 1] - values[i - 1]) / 2;
}

// [steps] the area of the cell of a stroke, and the number of cells from the axis to each step.
struct Cells {
    std::vector<double> areas, counts;

    Cells(const ProfileView& profile, const double* sizes, double overlap) {
        double sum = 0;
        for (std::size_t i = 0; i < profile.steps; ++i) {
            const double ring = 2 * std::numbers::pi * profile.rho[i] * gradient(profile.length, profile.steps, i);
            areas.push_back(sizes[i] * sizes[i] / overlap);
            counts.push_back(sum += ring / areas[i]);
        }
    }
};

// Smooth noise of standard deviation 1 at a point, of random numbers [kWaves, 4].
double wave_at(const double* point, double unit, double frequency, const double* waves) {
    double sum = 0;
    for (std::size_t i = 0; i < kWaves; ++i) {
        const double* wave = waves + 4 * i;
        double at = 0;
        for (std::size_t k = 0; k < 3; ++k) at += point[k] / unit * (frequency * wave[k]);
        sum += std::sin(at + 2 * std::numbers::pi * wave[3]);
    }
    return sum / std::sqrt(0.5 * static_cast<double>(kWaves));
}

using Vector = std::array<double, 3>;

Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Around the axis, seen from one side level up to a share of the table; on the surface.
Vector base_direction(double rho_of_table, bool is_still, const Vector& around, const Vector& normal) {
    const double share = (rho_of_table - kLevelUpTo) / (1 - kLevelUpTo);
    const double seam = std::clamp(share, 0.0, 1.0), side = around[0] < 0 ? -1 : 1;
    Vector base;
    double off = 0, squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double level = is_still ? (k == 0 ? 1.0 : 0.0) : around[k];
        base[k] = (1 - seam) * level + seam * around[k] * side;
        off += base[k] * normal[k];
    }
    for (std::size_t k = 0; k < 3; ++k) base[k] -= off * normal[k], squares += base[k] * base[k];
    for (double& value : base) value /= std::max(std::sqrt(squares), 1e-9);
    return base;
}

// [count] linear interpolation of [steps] values along the profile.
std::vector<double> along_profile(const ProfileView& profile, const double* values, const double* along,
                                  std::size_t count) {
    std::vector<double> found(count);
    std::transform(along, along + count, found.begin(),
                   [&](double at) { return interpolated(profile.length, values, profile.steps, at); });
    return found;
}

double smooth_step(double x) {
    x = std::clamp(x, 0.0, 1.0);
    return x * x * (3 - 2 * x);
}

}  // namespace

StageProfile profile_around(const Place& place, double farthest, double ground_extent) {
    const double usual = kTable * std::max({1.2 * place.width, place.radius, 0.8 * place.height});
    const double table = std::max(usual, kOnGround * ground_extent);
    const double wall = std::max(kBeyondEye * farthest, 1.6 * table), rise = kRise * wall;
    constexpr std::size_t level = kSteps / 4, cove = kSteps / 2, upright = kSteps / 4;
    StageProfile profile{{}, {}, {}, table, wall};
    const auto add = [&](double rho, double up) {
        const double step = profile.rho.empty() ? 0 : std::hypot(rho - profile.rho.back(), up - profile.height.back());
        profile.length.push_back(profile.length.empty() ? 0 : profile.length.back() + step);
        profile.rho.push_back(rho);
        profile.height.push_back(up);
    };
    for (std::size_t i = 0; i < level; ++i) add(static_cast<double>(i) * (table / level), 0);
    for (std::size_t i = 0; i < cove; ++i) {
        const double turn = static_cast<double>(i) * (std::numbers::pi / 2 / (cove - 1));
        add(table + (wall - table) * std::sin(turn), rise * (1 - std::cos(turn)));
    }
    for (std::size_t i = 1; i <= upright; ++i) add(wall, rise + static_cast<double>(i) * (kTop * wall / upright));
    return profile;
}

std::vector<double> slopes_at(const ProfileView& profile, const double* along, std::size_t count) {
    std::vector<double> slopes(profile.steps);
    for (std::size_t i = 0; i < profile.steps; ++i)
        slopes[i] = std::atan2(gradient(profile.height, profile.steps, i), gradient(profile.rho, profile.steps, i));
    return along_profile(profile, slopes.data(), along, count);
}

std::vector<double> stroke_sizes(const ProfileView& profile, const Place& place, double distance, double seen_width) {
    std::vector<double> sizes(profile.steps);
    for (std::size_t i = 0; i < profile.steps; ++i) {
        const double rho = profile.rho[i], away = std::clamp((rho - place.width) / (kFar * place.radius), 0.0, 1.0);
        const double share = kNearSize + (kFarSize - kNearSize) * away;
        const double seen = share * seen_width * std::hypot(1.0, rho / std::max(distance, 1e-300));
        sizes[i] = std::max(seen, kLeastSize * place.radius);
    }
    return sizes;
}

StageSpots place_spots(const ProfileView& profile, const SpotQuery& query, const Draw& draw) {
    const Cells cells(profile, query.sizes, query.overlap);
    const std::size_t steps = profile.steps;
    const auto last =
        static_cast<std::size_t>(std::lower_bound(profile.rho, profile.rho + steps, query.until) - profile.rho);
    const auto count = static_cast<std::size_t>(cells.counts[std::min(last, steps - 1)]);
    StageSpots spots{std::vector<double>(3 * count),
                     std::vector<double>(count),
                     std::vector<double>(count),
                     {},
                     draw(query.layer, count)};
    const std::vector<double>& noise = spots.noise;
    for (std::size_t i = 0; i < count; ++i) {
        const double place = static_cast<double>(i) + 0.5;
        double along = interpolated(cells.counts.data(), profile.length, steps, place), around = place * kGolden;
        const double rho = interpolated(profile.length, profile.rho, steps, along);
        const double width = std::sqrt(interpolated(profile.length, cells.areas.data(), steps, along));
        along = std::clamp(along + kJitter * width * noise[kSpotNoise * i], 0.0, profile.length[steps - 1]);
        around += kJitter * width / std::max(rho, width) * noise[kSpotNoise * i + 1];
        const double moved = interpolated(profile.length, profile.rho, steps, along);
        spots.points[3 * i] = moved * std::cos(around);
        spots.points[3 * i + 1] = interpolated(profile.length, profile.height, steps, along);
        spots.points[3 * i + 2] = moved * std::sin(around);
        spots.along[i] = along;
        spots.around[i] = around;
    }
    spots.sizes = along_profile(profile, query.sizes, spots.along.data(), count);
    return spots;
}

std::vector<double> surface_colors(const ProfileView& profile, const SpotsView& spots, const StageTones& tones,
                                   const GroundView* ground) {
    const auto slopes = slopes_at(profile, spots.along, spots.count);
    const double wall = profile.wall;
    std::vector<double> lab(3 * spots.count);
    for (std::size_t i = 0; i < spots.count; ++i) {
        const double *point = spots.points + 3 * i, right = point[0], height = point[1], away = point[2];
        std::array<double, 3> table = tones.table, upright = tones.wall;
        const double far = std::clamp(away / wall, -1.0, 1.0);
        table[0] -= far > 0 ? kFarTable * far : -kFront * far;
        if (ground != nullptr) {  // near a ground, the table is like it
            const double near = std::clamp(1.5 - std::hypot(right, away) / ground->extent, 0.0, 1.0);
            for (std::size_t k = 0; k < 3; ++k)
                table[k] += near * (ground->lab_at(point, k) - tones.table[k]) * (k == 0 ? 1 : 0.8);
        }
        upright[0] += tones.slope * std::clamp(right / wall, -1.0, 1.0);
        upright[0] -= kUpper * std::clamp(height / wall, 0.0, 1.0);
        const double share = smooth_step((slopes[i] - kBlend[0]) / (kBlend[1] - kBlend[0]));
        for (std::size_t k = 0; k < 3; ++k) lab[3 * i + k] = table[k] + share * (upright[k] - table[k]);
    }
    return lab;
}

void shade_colors(const SpotsView& spots, const ShadowView& shadow, double strength, const GroundView* ground,
                  double* lab) {
    for (std::size_t i = 0; i < spots.count; ++i, lab += 3) {
        const double* const point = spots.points + 3 * i;
        const double share = strength * (1 - (ground != nullptr ? ground->covered_at(point) : 0));
        const Shade shade = shadow.at(point);
        for (std::size_t k = 0; k < 2; ++k)
            lab[1 + k] += share * kReflected * shade.reflected[k] + share * shade.shade * kCooler[k];
        lab[0] *= (1 - kDarkest * share * shade.shade) * (1 - kContact * share * shade.contact);
    }
}

std::vector<double> stage_frames(const ProfileView& profile, const SpotsView& spots, const double* waves, double radius,
                                 bool is_still) {
    const auto slopes = slopes_at(profile, spots.along, spots.count);
    std::vector<double> frames(9 * spots.count);
    for (std::size_t i = 0; i < spots.count; ++i) {
        const double* const point = spots.points + 3 * i;
        const double slope = slopes[i], cos = std::cos(spots.around[i]), sin = std::sin(spots.around[i]);
        const Vector normal{-std::sin(slope) * cos, std::cos(slope), -std::sin(slope) * sin};
        const double of_table = std::hypot(point[0], point[2]) / profile.table;
        const Vector base = base_direction(of_table, is_still, {-sin, 0, cos}, normal), across = cross(normal, base);
        const Sway sway = slope < kBlend[1] ? kTableSway : kWallSway;
        const double wave = wave_at(point, radius, sway.frequency, waves + (slope < kBlend[1] ? 0 : 4 * kWaves));
        const double turn = sway.most * wave + kLoose * spots.noise[kSpotNoise * i + 6];
        Vector along;
        for (std::size_t k = 0; k < 3; ++k) along[k] = std::cos(turn) * base[k] + std::sin(turn) * across[k];
        const Vector aside = cross(normal, along);
        for (std::size_t k = 0; k < 3; ++k) {
            frames[9 * i + 3 * k] = along[k];
            frames[9 * i + 3 * k + 1] = aside[k];
            frames[9 * i + 3 * k + 2] = normal[k];
        }
    }
    return frames;
}

}  // namespace brushgs
