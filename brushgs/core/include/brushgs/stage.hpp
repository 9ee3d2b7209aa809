// A stage, table and wall around a subject: maps of level ground, the shadow of the subject, the surface, its tones,
// and places, directions and colors of its strokes. brushgs/passes/add says why. Points [count, 3] are local: right, up
// and away from the foot of the subject, world units.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

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
constexpr double kGroundBand = 0.07;     // half the thickness of a ground, in radii

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

// Of a stroke on a stage with a ground: the share of its color that is that of the table, and whether it lies below.
struct Dissolving {
    double share;
    bool is_under;
};
Dissolving dissolving_at(const double* coverage, double radius, const double* point);

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
// Maps [kShadowSide, kShadowSide] by right and away.
struct ShadowMaps {
    std::vector<double> shade;      // share of the light that is blocked
    std::vector<double> contact;    // nearness of paint above the ground
    std::vector<double> reflected;  // [2, side, side] OKLab a and b of near objects, times their nearness
};
ShadowMaps cast_shadow(const ShadowQuery& query);

struct Shade {
    double shade, contact, reflected[2];
};
struct ShadowView {
    const double *shade, *contact, *reflected;
    double radius;
    const double* lamp;

    Shade at(const double* point) const;
};

// A profile: distance from the axis, height over the table, and length along it from the axis.
struct StageProfile {
    std::vector<double> rho, height, length;
    double table, wall;  // radius of the level part, distance of the wall
};
StageProfile profile_around(double radius, double width, double height, double farthest, double least_table);

struct ProfileView {
    const double *rho, *height, *length;
    std::size_t steps;
    double table, wall;

    explicit ProfileView(const StageProfile& from)
        : rho(from.rho.data()),
          height(from.height.data()),
          length(from.length.data()),
          steps(from.rho.size()),
          table(from.table),
          wall(from.wall) {}
    ProfileView(const double* r, const double* h, const double* l, std::size_t n, double t, double w)
        : rho(r), height(h), length(l), steps(n), table(t), wall(w) {}
};

// What a stage is seen by.
struct StageEye {
    double distance;    // of the camera from the foot
    double seen_width;  // of a picture at the subject, world units
};
// [steps] the size of strokes along a profile.
std::vector<double> stroke_sizes(const ProfileView& profile, double radius, double width, const StageEye& eye);

constexpr std::size_t kSpotNoise = 7;  // random numbers of a stroke, two of them of its place

// The number of spots of these cells [steps], areas along the profile, as far as `until` from the axis.
std::size_t count_spots(const ProfileView& profile, const double* cells, double until);

struct StageSpots {
    std::vector<double> points, around, along;  // [count, 3], [count] radians, [count] along the profile
};
// Spots along a spiral, evenly spread where cells are equal; noise [count, kSpotNoise] of standard deviation 1.
StageSpots place_spots(const ProfileView& profile, const double* cells, std::size_t count, double jitter,
                       const double* noise);

// [count] linear interpolation of [steps] values along the profile.
std::vector<double> along_profile(const ProfileView& profile, const double* values, const std::vector<double>& along);
// [steps] angles of the surface with the level, radians.
std::vector<double> profile_slopes(const ProfileView& profile);

struct StageTones {
    std::array<double, 3> table, wall;  // OKLab
    double slope;                       // change of the wall's lightness from its middle to the right
    double reads;                       // share of the outline that stands out
};

// Points on a stage.
struct StagePoints {
    const double* points;  // [count, 3]
    const double* slopes;  // [count] of the surface there
    std::size_t count;
};

// Writes [count, 3] OKLab of table and wall; `ground_lab` [count, 3] of the scene's own ground, or null.
void surface_colors(const StagePoints& at, const StageTones& tones, double wall, const double* ground_lab,
                    double ground_extent, double* lab);

// Darkens and tints a color of the stage in shadow; `share` is its strength, 0 to 1.
void shade_color(const Shade& shade, double share, double* lab);

constexpr std::size_t kWaves = 6;

struct FrameQuery {
    StagePoints at;
    const double* around;       // [count] radians
    const double* turns;        // [count] random numbers of standard deviation 1
    const double* table_waves;  // [kWaves, 4] directions and phases
    const double* wall_waves;
    double table, radius;  // of the level part, of the subject
    bool is_still;         // seen from one side: strokes of the table are level there
};
// Writes [count, 3, 3] axes in columns: along, across, off the surface.
void stage_frames(const FrameQuery& query, double* frames);

constexpr double kOutlineReads = 0.15;  // OKLab lightness difference at which a silhouette stands out

// Pixels of the outline of a subject.
struct Outline {
    std::vector<double> lightness;       // OKLab, inside
    std::vector<std::uint8_t> is_table;  // whether the table is behind
    std::vector<double> lateral;         // place of the wall behind, -1 to 1
};

struct OutlineView {
    const double* rgb;    // [height, width, 3] premultiplied
    const double* alpha;  // [height, width]
    std::size_t height, width;
    double fx, fy, cx, cy;  // pixels
    const double* rays;     // [3, 3] local directions of right, down and forward, in rows
    const double* eye;      // [3] local
    double table, wall, radius, own;
    const double *cones_from_rgb, *lab_from_roots;  // [3, 3]
};
Outline outline_in(const OutlineView& view);

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
