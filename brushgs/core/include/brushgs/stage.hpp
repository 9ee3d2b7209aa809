// A stage, table and wall around a subject: where that stands, maps of level ground, the shadow of the subject, the
// surface, its tones, and its strokes. brushgs/passes/add says why. Points [count, 3] are local: right, up and away
// from the foot of the subject, world units.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "brushgs/colors.hpp"
#include "brushgs/first_view.hpp"

namespace brushgs {

constexpr double kGroundBand = 0.07;  // half the thickness of a ground, in radii

// Whether what is so high belongs to a ground, not to objects on it.
inline bool is_on_ground(double height, double radius) { return std::abs(height) < kGroundBand * radius; }

// Where a subject stands.
struct Place {
    std::array<double, 3> foot;    // the origin of local coordinates, world units
    std::array<double, 9> axes;    // rows right, up and away, world axes; left-handed
    double radius, width, height;  // of the subject; half the larger level size
    std::array<double, 3> lamp;    // unit vector toward the light, local, above the ground

    template <class T>
    std::array<double, 3> local(const T* point) const {
        std::array<double, 3> found{};
        for (std::size_t i = 0; i < 9; ++i) found[i / 3] += axes[i] * (static_cast<double>(point[i % 3]) - foot[i % 3]);
        return found;
    }
    template <class T>
    std::vector<double> all_local(const T* points, std::size_t count) const {
        std::vector<double> found;
        for (std::size_t i = 0; i < count; ++i) {
            const auto point = local(points + 3 * i);
            found.insert(found.end(), point.begin(), point.end());
        }
        return found;
    }
    // The local position of a camera, of its matrix [3, 4] from the world.
    std::array<double, 3> eye_of(const double* viewmat) const;
};

// Square cells of level ground around the foot.
struct LevelGrid {
    std::size_t side;  // cells along each side
    double half;       // half a side, world units

    double cell() const { return 2 * half / static_cast<double>(side); }
    double cell_at(double place) const { return (place / half + 1) * (static_cast<double>(side) / 2); }
    // A bilinear sample of [side, side] values; beyond, those at the border.
    double sample(const double* values, double right, double away) const;
    // Adds a value to the cell of a point, if it has one.
    void add(double right, double away, double value, double* sums) const;
};

// Blurs a map by a Gaussian of `sigma` cells; zero outside.
void blur_map(std::size_t rows, std::size_t columns, double sigma, double* values);

// The ground under a subject, of all its points, and its sizes.
struct Standing {
    double middle[3];      // of the foot
    double width, height;  // half the larger level size; at least a share of the radius
};
Standing find_standing(const double* points, std::vector<double> weights, double radius);

constexpr std::size_t kGroundSide = 96;  // cells of a map
constexpr double kGroundReach = 2.0;     // half its side, in radii of the subject

struct GroundQuery {
    const double* points;          // [count, 3]
    const std::uint8_t* is_level;  // [count] whether its normal is upright
    const double* weights;         // [count] the paint of each
    const double* lab;             // [count, 3] OKLab
    std::size_t count;
    double radius, height;  // of the subject
};
// The ground that a scene brings: maps [kGroundSide, kGroundSide] by right and away.
struct GroundMaps {
    bool is_found = false;
    double level = 0;              // its height over the foot
    std::vector<double> coverage;  // 1 inside, 0.5 at the border
    std::vector<double> lab;       // [3, side, side] OKLab inside, spread beyond the border
    std::array<double, 3> tone{};  // OKLab along the border
    double extent = 0;             // radius of the covered area, world units
};
GroundMaps find_ground(const GroundQuery& query);

struct GroundView {
    const double *coverage, *lab;
    double extent;
    LevelGrid grid;

    GroundView(const double* covered, const double* colors, double reach, double radius)
        : coverage(covered), lab(colors), extent(reach), grid{kGroundSide, kGroundReach * radius} {}
    double covered_at(const double* point) const { return grid.sample(coverage, point[0], point[2]); }
    double lab_at(const double* point, std::size_t channel) const {
        return grid.sample(lab + channel * kGroundSide * kGroundSide, point[0], point[2]);
    }
};

// What strokes become on a stage that continues the ground of their scene: it blends into the table toward its border,
// and what lies under the table is invisible.
template <class T>
struct OnGround {
    const T* means;  // [count, 3] world units
    std::size_t count, sh_terms;
    T *opacities, *sh;  // [count], [count, sh_terms, 3] are changed
};
// `table` [3] OKLab, or null for bare paper, where the ground fades out.
template <class T>
void dissolve(const Place& place, const GroundView& ground, const double* table, const Oklab& oklab,
              const OnGround<T>& strokes);

constexpr double kLamp[3] = {-0.75, 0.95, -0.55};  // toward the usual lamp, local: the upper left, a little in front

// A sample of a scene, n of its Gaussians, where it stands.
struct StageSite {
    Place place;                               // on the ground that the scene brings, if it does
    GroundMaps ground;                         // that ground
    std::vector<double> points, weights, lab;  // [n, 3]; [n] the paint of each, 0 for a ground; [n, 3] OKLab
};
// `axes` [3, 3] are those of the place, `lamp` [3] is its.
template <class T>
StageSite find_site(const SceneView<T>& scene, const double* axes, const double* lamp, const Oklab& oklab);

// Casts the shadow of a point on the ground: right and away.
inline std::array<double, 2> cast_point(const double* point, const double* lamp) {
    return {point[0] - point[1] * (lamp[0] / lamp[1]), point[2] - point[1] * (lamp[2] / lamp[1])};
}

constexpr std::size_t kShadowSide = 256;  // cells of a map
constexpr double kShadowReach = 3.2;      // half its side, in radii of the subject

struct ShadowQuery {
    const double* points;   // [count, 3]
    const double* weights;  // [count] the paint of each; 0 for those without a shadow
    const double* lab;      // [count, 3] OKLab
    std::size_t count;
    double radius;       // of the subject
    const double* lamp;  // [3] unit vector toward it, above the ground
};
struct Shade {
    double shade, contact, reflected[2];
};
struct ShadowView {
    const double *shade, *contact, *reflected;
    double radius;
    const double* lamp;

    Shade at(const double* point) const;
};
// Maps [kShadowSide, kShadowSide] by right and away.
struct ShadowMaps {
    std::vector<double> shade;      // share of the light that is blocked
    std::vector<double> contact;    // nearness of paint above the ground
    std::vector<double> reflected;  // [2, side, side] OKLab a and b of near objects, times their nearness

    ShadowView view(const Place& place) const {
        return {shade.data(), contact.data(), reflected.data(), place.radius, place.lamp.data()};
    }
};
ShadowMaps cast_shadow(const ShadowQuery& query);

// A profile: distance from the axis, height over the table, and length along it from the axis.
struct ProfileView {
    const double *rho, *height, *length;
    std::size_t steps;
    double table, wall;  // radius of the level part, distance of the wall
};
struct StageProfile {
    std::vector<double> rho, height, length;
    double table, wall;

    ProfileView view() const { return {rho.data(), height.data(), length.data(), rho.size(), table, wall}; }
};
// `farthest` is the level distance of the farthest camera, `ground_extent` that of the scene's own ground, or 0.
StageProfile profile_around(const Place& place, double farthest, double ground_extent);

// [steps] the size of strokes along a profile, for a camera at a distance from the foot whose pictures show a width of
// it there.
std::vector<double> stroke_sizes(const ProfileView& profile, const Place& place, double distance, double seen_width);

// The size of strokes for a subject of so many.
double size_beside(std::size_t num_strokes);

constexpr double kStrokeSigmas = 3.6;  // size of a stroke in standard deviations
constexpr std::size_t kSpotNoise = 7;  // random numbers of a stroke, two of them of its place
// Gives [count, kSpotNoise] random numbers of deviation 1 for the strokes of a layer.
using Draw = std::function<std::vector<double>(std::size_t layer, std::size_t count)>;

// Places of strokes.
struct SpotsView {
    const double *points, *around, *along;  // [count, 3], [count] radians around the axis, [count] along the profile
    const double *sizes, *noise;            // [count] root of length times width; [count, kSpotNoise]
    std::size_t count;
};
struct StageSpots {
    std::vector<double> points, around, along, sizes, noise;

    SpotsView view() const {
        return {points.data(), around.data(), along.data(), sizes.data(), noise.data(), sizes.size()};
    }
};
// Spots along a spiral as far as `until` from the axis, evenly spread where sizes [steps] are equal: so many strokes
// over each point.
struct SpotQuery {
    const double* sizes;
    double overlap, until;
    std::size_t layer = 0;
};
StageSpots place_spots(const ProfileView& profile, const SpotQuery& query, const Draw& draw);

// Two layers of strokes of the usual sizes [steps] times `size`: broad ones in the light, fine ones in shadow, which
// keep its shape.
StageSpots lay_layers(const ProfileView& profile, const double* usual, double size, double radius,
                      const std::vector<ShadowView>& shadows, const Draw& draw);

// [count] angles of the surface with the level, radians.
std::vector<double> slopes_at(const ProfileView& profile, const double* along, std::size_t count);

struct StageTones {
    std::array<double, 3> table, wall;  // OKLab
    double slope;                       // change of the wall's lightness from its middle to the right
    double reads;                       // share of the outline that stands out
};

// [count, 3] OKLab of table and wall; `ground` may be null.
std::vector<double> surface_colors(const ProfileView& profile, const SpotsView& spots, const StageTones& tones,
                                   const GroundView* ground);

// Darkens and tints colors [count, 3] of the stage in shadow of a strength from 0 to 1; a ground has its shadow
// already.
void shade_colors(const SpotsView& spots, const ShadowView& shadow, double strength, const GroundView* ground,
                  double* lab);

constexpr std::size_t kWaves = 6;

// [count, 3, 3] axes in columns: along, across, off the surface. `waves` [2, kWaves, 4] are random numbers, three of
// deviation 1 and one from 0 to 1. `is_still`: seen from one side, strokes of the table are level there.
std::vector<double> stage_frames(const ProfileView& profile, const SpotsView& spots, const double* waves, double radius,
                                 bool is_still);

// Writes the quaternion of local axes [3, 3] in columns; the second may be flipped, as those of places are left-handed.
void turn_to_world(const double* axes, const double* frame, double* quat);

struct StrokeStyle {
    double aspect;                    // length over width
    double jitter[2];                 // deviations of OKLab lightness, and of a and b, from stroke to stroke
    const double *contrast, *longer;  // [count] factors on these and on lengths, or null
};
struct StageStrokes {
    std::vector<double> means, quats, scales, opacities, sh;  // see GaussianColumns
};
// Strokes on spots, of frames [count, 3, 3] and colors [count, 3] OKLab.
StageStrokes strokes_on(const Place& place, const SpotsView& spots, const double* frames, const double* lab,
                        const StrokeStyle& style, const Oklab& oklab);

constexpr double kOutlineReads = 0.15;  // OKLab lightness difference at which a silhouette stands out

// Pixels of the outline of a subject.
struct Outline {
    std::vector<double> lightness;       // OKLab, inside
    std::vector<std::uint8_t> is_table;  // whether the table is behind
    std::vector<double> lateral;         // place of the wall behind, -1 to 1
};

constexpr int kOutlineSide = 160;  // pixels, longer side of the picture in which it is found

struct OutlineView {
    const double* rgb;    // [height, width, 3] premultiplied
    const double* alpha;  // [height, width]
    std::size_t height, width;
    const double* viewmat;  // [3, 4] camera from world
    double fx, fy, cx, cy;  // pixels
};
Outline outline_in(const OutlineView& view, const Place& place, const ProfileView& profile, double ground_extent,
                   const Oklab& oklab);

constexpr double kFullBorder = 0.8;  // alpha of the border above which a scene fills its picture

// Mean alpha of the border of a picture.
template <class T>
double border_alpha(const T* alpha, std::size_t height, std::size_t width);

// The mean color of Gaussians, OKLab; a middle gray of what has no weight.
template <class T>
std::array<double, 3> mean_lab(const T* sh, std::size_t sh_terms, const double* weights, std::size_t count,
                               const Oklab& oklab);

struct ToneChoice {
    std::array<double, 3> mean;  // OKLab of the subject
    double low, high;            // lightness of the wall
    const double* ground;        // [3] OKLab of the scene's own, or null
    double values;               // 0 to 1: how far values of the picture are opened
};
StageTones choose_tones(const Outline& outline, const ToneChoice& choice);
// Share of an outline that stands out before a table and a wall of this lightness.
double tones_read(const Outline& outline, double table, double wall, double slope);

}  // namespace brushgs
