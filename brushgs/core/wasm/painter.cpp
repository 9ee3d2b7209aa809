// What the worker of a painter page calls: the bytes of a scene file in, columns of strokes out. One scene at a time.
// Pointers are addresses in the memory of the module; numbers are as in scene_rows.hpp and scene_strokes.hpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

#include "brushgs/blending.hpp"
#include "brushgs/colors.hpp"
#include "brushgs/first_view.hpp"
#include "brushgs/framing.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/scene_rows.hpp"
#include "brushgs/scene_stage.hpp"
#include "brushgs/scene_strokes.hpp"
#include "brushgs/stroke_brushes.hpp"
#include "brushgs/stroke_relief.hpp"

#define BRUSHGS_EXPORT(name) extern "C" __attribute__((export_name(#name)))

extern "C" __attribute__((import_module("page"), import_name("tell"))) void tell_page(double share);

// The only thread never ends, so its variables are never destroyed.
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; }

namespace {

constexpr auto kLeastAlpha = static_cast<float>(brushgs::kMinAlpha);
constexpr double kLeastRadius = 1e-9, kLeastDistance = 0.05;  // see PageView.of of brushgs/outlets/page/view.py

brushgs::SceneColumns scene;  // without floaters
std::size_t num_read;
brushgs::Extent extent;
brushgs::ViewSample sample;
double level_axes[9];              // right, down, forward of a level view of the scene, from azimuth 0
brushgs::Framed framed;            // with the axis up that is level there
std::vector<std::uint8_t> crumbs;  // marks of the rows below it

struct Paint {
    brushgs::GaussianColumns strokes;
    std::vector<float> reliefs;  // [count, 2] thickness and gain, see brushgs/rendering/relief.py
    std::vector<std::uint8_t> brushes;
};
Paint painted;             // as it was made
Paint shown[2];            // on its stage, and the stage
double relief_numbers[3];  // thickness, gain and by_light
brushgs::BrushRows brushes;
double ground_color[3];  // display-encoded

double paint_of(const brushgs::GaussianColumns& strokes, std::size_t row) {
    std::array<double, 3> scales;
    for (std::size_t i = 0; i < 3; ++i) scales[i] = static_cast<double>(strokes.scales[3 * row + i]);
    std::ranges::sort(scales);
    return scales[1] * scales[2] * static_cast<double>(strokes.opacities[row]);
}

brushgs::PaintedStrokes<float> brushed(const brushgs::GaussianColumns& strokes, const double* cones_from_rgb,
                                       const double* lab_from_roots) {
    return {strokes.scales.data(), strokes.opacities.data(), strokes.sh.data(), strokes.count,
            strokes.sh_terms,      cones_from_rgb,           lab_from_roots};
}

brushgs::LightRange lights_of(const brushgs::GaussianColumns& strokes, const double* cones_from_rgb,
                              const double* lab_from_roots) {
    return strokes.count == 0 ? brushgs::LightRange{}
                              : brushgs::light_range(brushed(strokes, cones_from_rgb, lab_from_roots));
}

void choose(Paint& paint, double material, const double* cones_from_rgb, const double* lab_from_roots) {
    const brushgs::GaussianColumns& s = paint.strokes;
    paint.brushes =
        brushgs::choose_brushes<float>({s.means.data(), s.quats.data(), s.scales.data(), s.opacities.data(),
                                        s.sh.data(), s.count, s.sh_terms, cones_from_rgb, lab_from_roots, 1},
                                       brushes, material, 0);
}

// A toned ground, see `Tone` of brushgs/passes/add/backdrop.py: its lightness, the complement of the mean color of the
// scene, and a shift of a and b.
void tone(const brushgs::GaussianColumns& whole, double lightness, double complement, const double* warmth,
          const brushgs::Oklab& oklab) {
    const auto mean = brushgs::mean_lab(whole, oklab);
    const auto color = oklab.rgb_of({lightness, warmth[0] - complement * mean[1], warmth[1] - complement * mean[2]});
    std::ranges::transform(color, ground_color, [](double value) { return std::clamp(value, 0.0, 1.0); });
}

// Relief of paint, by the lights of the subject, relative to the usual one.
void raise(Paint& paint, brushgs::LightRange lights, double share, const double* cones_from_rgb,
           const double* lab_from_roots) {
    paint.reliefs.clear();
    if (paint.strokes.count == 0) return;
    const auto of_paint = brushed(paint.strokes, cones_from_rgb, lab_from_roots);
    std::vector<double> found(2 * of_paint.count);
    brushgs::relative_reliefs(of_paint, brushgs::median_log_size(of_paint.scales, of_paint.count), relief_numbers[2],
                              lights, found.data());
    for (std::size_t i = 0; i < found.size(); ++i)
        paint.reliefs.push_back(static_cast<float>(found[i] * share * relief_numbers[i % 2]));
}

// The strokes as a page holds them (brushgs/outlets/page/contents.py): those with most paint first, rotations of unit
// length.
void arrange(Paint& laid) {
    brushgs::GaussianColumns& strokes = laid.strokes;
    std::vector<double> paint(strokes.count);
    std::vector<std::uint32_t> rows(strokes.count);
    for (std::size_t row = 0; row < strokes.count; ++row) paint[row] = paint_of(strokes, row);
    std::iota(rows.begin(), rows.end(), 0U);
    std::ranges::stable_sort(rows, [&](std::uint32_t a, std::uint32_t b) { return paint[a] > paint[b]; });
    std::erase_if(rows, [&](std::uint32_t row) { return strokes.opacities[row] < kLeastAlpha; });
    strokes = brushgs::taken(strokes, rows);
    std::vector<float> raised;
    for (const std::uint32_t row : rows)
        raised.insert(raised.end(), {laid.reliefs[2 * row], laid.reliefs[2 * row + 1]});
    laid.reliefs = std::move(raised);
    laid.brushes = brushgs::taken_from(laid.brushes.data(), 1, rows);
    for (std::size_t row = 0; row < strokes.count; ++row) {
        const auto quat = brushgs::unit_quat(&strokes.quats[4 * row]);
        std::ranges::transform(quat, &strokes.quats[4 * row], [](double value) { return static_cast<float>(value); });
    }
}

brushgs::SceneView<float> view_of_scene() {
    return {scene.means.data(), scene.quats.data(), scene.scales.data(), scene.opacities.data(),
            scene.sh.data(),    scene.count,        scene.sh_terms};
}

// The scene without crumbs; `rest` holds it where there are any.
const brushgs::SceneColumns& without_crumbs(brushgs::SceneColumns& rest) {
    if (std::ranges::find(crumbs, 1) == crumbs.end()) return scene;
    static_cast<brushgs::GaussianColumns&>(rest) = brushgs::taken(scene, brushgs::marked(crumbs, 0));
    rest.is_antialiased = scene.is_antialiased;
    return rest;
}

struct Sides {
    double low, high;
    double length() const { return high - low; }
    double middle() const { return 0.5 * (low + high); }
};

// Of the framed points along an axis of a level view.
Sides sides_along(const double* axis) {
    Sides sides{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < framed.points.size(); i += 3) {
        const double place =
            axis[0] * framed.points[i] + axis[1] * framed.points[i + 1] + axis[2] * framed.points[i + 2];
        sides.low = std::min(sides.low, place), sides.high = std::max(sides.high, place);
    }
    return sides;
}

double elevation_of_framed() {
    return brushgs::default_elevation(sides_along(level_axes).length(), sides_along(level_axes + 3).length(),
                                      sides_along(level_axes + 6).length());
}

void move_to_middle(brushgs::GaussianColumns& strokes) {
    for (std::size_t i = 0; i < strokes.means.size(); ++i)
        strokes.means[i] = static_cast<float>(static_cast<double>(strokes.means[i]) - extent.center[i % 3]);
}

brushgs::PictureView view_of(const double* numbers) {
    brushgs::PictureView view;
    std::copy_n(numbers, 12, view.viewmat);
    view.fx = numbers[12], view.fy = numbers[13], view.width = numbers[14], view.height = numbers[15];
    view.near = numbers[16];
    return view;
}

}  // namespace

BRUSHGS_EXPORT(allocate) void* allocate(std::size_t size) { return std::malloc(size); }
BRUSHGS_EXPORT(release) void release(void* memory) { std::free(memory); }

// Reads a scene, of gzip data the content, which had so many bytes; false if it is refused, see `fault`.
BRUSHGS_EXPORT(read) bool read(const char* bytes, std::size_t size, bool is_named_splat, std::size_t num_packed) {
    scene = {};
    painted = shown[0] = shown[1] = {};
    scene = brushgs::read_scene_rows({bytes, size}, is_named_splat, num_packed);
    if (!scene.fault.empty()) return false;
    num_read = scene.count;
    brushgs::clean_scene(scene);
    extent = brushgs::robust_extent(scene.means.data(), scene.count, 1);
    sample = brushgs::take_view_sample<float>(view_of_scene());
    crumbs.clear();
    return true;
}

BRUSHGS_EXPORT(fault) const char* fault() { return scene.fault.c_str(); }
BRUSHGS_EXPORT(fault_size) std::size_t fault_size() { return scene.fault.size(); }
BRUSHGS_EXPORT(num_gaussians) std::size_t num_gaussians() { return num_read; }
BRUSHGS_EXPORT(num_dropped) std::size_t num_dropped() { return scene.num_dropped; }
BRUSHGS_EXPORT(is_antialiased) bool is_antialiased() { return scene.is_antialiased; }
BRUSHGS_EXPORT(scene_middle) const double* scene_middle() { return extent.center; }

// Writes the probability that each axis is up, and returns the number of the axis to take.
BRUSHGS_EXPORT(up) std::size_t up(double* chances) {
    brushgs::PerAxis found{};
    if (scene.up < 0)
        found = brushgs::up_chances(sample, 1);
    else
        found[static_cast<std::size_t>(scene.up)] = 1;  // the file says so
    std::ranges::copy(found, chances);
    return brushgs::believed_axis(found);
}

// Stands the scene upright, by the axes of a level view [3, 3] from azimuth 0; true if other crumbs than before are
// dropped.
BRUSHGS_EXPORT(stand) bool stand(const double* level) {
    std::copy_n(level, 9, level_axes);
    framed = brushgs::framed_points(view_of_scene(), level);
    const Sides down = sides_along(level + 3);
    std::vector<std::uint8_t> found(scene.count);
    if (!framed.has_surroundings && elevation_of_framed() != brushgs::kFlatElevation && down.length() > 0) {
        const double up[3] = {-level[3], -level[4], -level[5]};
        found = brushgs::find_crumbs(view_of_scene(), up, -down.high, down.length());
    }
    const bool is_changed = found != crumbs;
    crumbs = std::move(found);
    return is_changed;
}

// Azimuth and elevation of the first view, and 1 if the subject is flat.
BRUSHGS_EXPORT(front) void front(double* numbers) {
    brushgs::Front found{};
    if (sample.count > 0) found = brushgs::find_front(sample, level_axes, 1);
    numbers[0] = found.azimuth + found.lean;
    numbers[1] = elevation_of_framed();
    numbers[2] = numbers[1] == brushgs::kFlatElevation ? 1 : 0;
}

// Of the axes of a camera [3, 3], and tangents of half its angles of view: the numbers become the place from which it
// shows the scene, its distance, the place on its axis to turn around, and the radius of the scene around that.
BRUSHGS_EXPORT(frame) void frame(double* numbers) {
    std::vector<double> points;
    for (std::size_t i = 0; i < framed.points.size(); ++i) {
        const double *axis = numbers + 3 * (i % 3), *point = &framed.points[i - i % 3];
        points.push_back(axis[0] * point[0] + axis[1] * point[1] + axis[2] * point[2]);
    }
    const brushgs::Eye eye = brushgs::fit_eye(points.data(), points.size() / 3, numbers + 9);
    double place[3] = {}, middle[3] = {}, ahead = 0, squares = 0;
    for (std::size_t axis = 0; axis < 9; axis += 3) {
        const double across = eye.place[axis / 3], center = sides_along(level_axes + axis).middle();
        for (std::size_t k = 0; k < 3; ++k) {
            place[k] += across * numbers[axis + k];
            middle[k] += center * level_axes[axis + k];
        }
    }
    for (std::size_t i = 0; i < framed.points.size(); i += 3) {
        const double* const point = &framed.points[i];
        squares = std::max(squares, std::pow(point[0] - middle[0], 2) + std::pow(point[1] - middle[1], 2) +
                                        std::pow(point[2] - middle[2], 2));
    }
    for (std::size_t k = 0; k < 3; ++k) ahead += (middle[k] - place[k]) * numbers[6 + k];
    const double radius = std::max(std::sqrt(squares), kLeastRadius);
    ahead = std::max(ahead, kLeastDistance * radius);
    for (std::size_t k = 0; k < 3; ++k) middle[k] = place[k] + ahead * numbers[6 + k];
    std::copy_n(place, 3, numbers);
    numbers[3] = eye.distance;
    std::copy_n(middle, 3, numbers + 4);
    numbers[7] = radius;
}

// Of a view (the numbers of `PictureView`): its first two become how far the subject reaches, zeros if that is not
// known.
BRUSHGS_EXPORT(reach) void reach(double* view) {
    const brushgs::Reach found = brushgs::reach_in(view_of(view), framed.points);
    view[0] = found.across, view[1] = found.down;
}

// Makes the strokes of the scene that was read, with their relief and brushes, and the color of a toned ground. The
// numbers are those of `StrokeOptions` from `finest` to `chroma`, its matrices, `follows`, `grading` and pigments, the
// relief's thickness, gain and by_light, the ground's lightness, complement and warmth, the share of surfaces that
// brushes are chosen by, for each kind of brushes their number and rows, and the draws.
BRUSHGS_EXPORT(paint) void paint(std::size_t num_strokes, const double* numbers) {
    painted = shown[0] = shown[1] = {};
    const double *cones_from_rgb = numbers + 9, *lab_from_roots = numbers + 18, *look = numbers + 37;
    const double *light = look + 9, *ground = light + 3, *kit = ground + 5;
    std::copy_n(light, 3, relief_numbers);
    for (auto* const rows : {&brushes.of_long, &brushes.of_short, &brushes.of_others, &brushes.of_large,
                             &brushes.of_smooth, &brushes.of_rough}) {
        rows->assign(kit + 1, kit + 1 + static_cast<std::size_t>(*kit));
        kit += 1 + rows->size();
    }
    const brushgs::StrokeOptions options{.num_strokes = num_strokes,
                                         .finest = numbers[0],
                                         .color_weight = numbers[1],
                                         .num_steps = numbers[2],
                                         .gain = numbers[3],
                                         .overlap = numbers[4],
                                         .keep = numbers[5],
                                         .solid = numbers[6],
                                         .lightness = numbers[7],
                                         .chroma = numbers[8],
                                         .follows = numbers[36],
                                         .grading = {look[0], look[1], look[2], {look[3], look[4]}, {look[5], look[6]}},
                                         .num_pigments = static_cast<std::size_t>(look[7]),
                                         .pure = look[8],
                                         .cones_from_rgb = cones_from_rgb,
                                         .lab_from_roots = lab_from_roots,
                                         .xyz_over_white = numbers + 27,
                                         .draws = kit};
    brushgs::SceneColumns rest;
    const brushgs::SceneColumns& whole = without_crumbs(rest);
    tone(whole, ground[0], ground[1], ground + 2, brushgs::Oklab(cones_from_rgb, lab_from_roots));
    painted.strokes = brushgs::strokes_of_scene(whole, brushgs::robust_extent(whole.means.data(), whole.count, 1),
                                                options, tell_page);
    raise(painted, lights_of(painted.strokes, cones_from_rgb, lab_from_roots), 1, cones_from_rgb, lab_from_roots);
    choose(painted, ground[4], cones_from_rgb, lab_from_roots);
    arrange(painted);
}

BRUSHGS_EXPORT(ground) const double* ground() { return ground_color; }

// Shows what was painted; with numbers on a stage: those of `PictureView`, the axes of its level view, the other
// numbers of `StageOptions` with its matrices, and the relief of the stage relative to that of the strokes.
BRUSHGS_EXPORT(show) void show(const double* numbers) {
    shown[0] = painted;
    shown[1] = {};
    if (numbers != nullptr) {
        const double *look = numbers + 26, *cones_from_rgb = look + 6, *lab_from_roots = look + 15;
        brushgs::SceneColumns rest;
        brushgs::StagedStrokes staged = brushgs::staged_strokes(without_crumbs(rest), painted.strokes,
                                                                {.view = view_of(numbers),
                                                                 .level = numbers + 17,
                                                                 .size = look[0],
                                                                 .aspect = look[1],
                                                                 .lightness = look[2],
                                                                 .chroma = look[3],
                                                                 .shadow = look[4],
                                                                 .values = look[5],
                                                                 .cones_from_rgb = cones_from_rgb,
                                                                 .lab_from_roots = lab_from_roots});
        shown[0].strokes.opacities = std::move(staged.opacities);
        shown[0].strokes.sh = std::move(staged.sh);
        shown[1].strokes = std::move(staged.stage);
        raise(shown[1], lights_of(painted.strokes, cones_from_rgb, lab_from_roots), look[24], cones_from_rgb,
              lab_from_roots);
        choose(shown[1], 0, cones_from_rgb, lab_from_roots);
        for (Paint& paint : shown) arrange(paint);
    }
    for (Paint& paint : shown) move_to_middle(paint.strokes);
}

// Columns of what is shown: of the strokes, 0, or their stage, 1.
BRUSHGS_EXPORT(num_strokes) std::size_t num_strokes(std::size_t part) { return shown[part].strokes.count; }
BRUSHGS_EXPORT(sh_terms) std::size_t sh_terms(std::size_t part) { return shown[part].strokes.sh_terms; }
BRUSHGS_EXPORT(means) const float* means(std::size_t part) { return shown[part].strokes.means.data(); }
BRUSHGS_EXPORT(quats) const float* quats(std::size_t part) { return shown[part].strokes.quats.data(); }
BRUSHGS_EXPORT(scales) const float* scales(std::size_t part) { return shown[part].strokes.scales.data(); }
BRUSHGS_EXPORT(opacities) const float* opacities(std::size_t part) { return shown[part].strokes.opacities.data(); }
BRUSHGS_EXPORT(relief) const float* relief(std::size_t part) { return shown[part].reliefs.data(); }
BRUSHGS_EXPORT(sh) const float* sh(std::size_t part) { return shown[part].strokes.sh.data(); }
BRUSHGS_EXPORT(brushes) const std::uint8_t* brushes_of(std::size_t part) { return shown[part].brushes.data(); }
