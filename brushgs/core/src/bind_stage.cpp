// Python: stages. Arrays of several ranks come back flat. The tuples are those of brushgs/passes/add: `Place`,
// `Ground`, `Shadow`, `Surface`, `Spots`, `Tones` and `Outline`.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/stage.hpp"

namespace bindings {

namespace {

using brushgs::ProfileView;
using Numbers = In<double, 1>;
using Rows = In<double, 2>;
using Cube = In<double, 3>;
using Vector = std::array<double, 3>;
using Place = std::tuple<Numbers, Rows, double, double, double, Numbers>;
using Ground = std::tuple<Place, Rows, Cube, Numbers, double>;
using Shadow = std::tuple<Place, Rows, Rows, Cube>;
using Surface = std::tuple<Numbers, Numbers, Numbers, double, double>;
using Spots = std::tuple<Rows, Numbers, Numbers, Numbers, Rows>;
using Tones = std::tuple<Numbers, Numbers, double, double>;
using Outline = std::tuple<Numbers, In<bool, 1>, Numbers>;
using Matrices = std::tuple<Rows, Rows>;  // of OKLab

brushgs::Place place_of(const Place& from) {
    const auto& [foot, axes, radius, width, height, lamp] = from;
    brushgs::Place place{{}, {}, radius, width, height, {}};
    std::copy_n(foot.data(), 3, place.foot.begin());
    std::copy_n(axes.data(), 9, place.axes.begin());
    std::copy_n(lamp.data(), 3, place.lamp.begin());
    return place;
}

std::optional<brushgs::GroundView> ground_of(const std::optional<Ground>& from) {
    if (!from) return std::nullopt;
    const auto& [place, coverage, lab, tone, extent] = *from;
    return brushgs::GroundView(coverage.data(), lab.data(), extent, std::get<2>(place));
}

const brushgs::GroundView* pointer_to(const std::optional<brushgs::GroundView>& ground) {
    return ground ? &*ground : nullptr;
}

brushgs::ShadowView shadow_of(const Shadow& from) {
    const auto& [place, shade, contact, reflected] = from;
    return {shade.data(), contact.data(), reflected.data(), std::get<2>(place), std::get<5>(place).data()};
}

ProfileView profile_of(const Surface& from) {
    const auto& [rho, height, length, table, wall] = from;
    return {rho.data(), height.data(), length.data(), rho.size(), table, wall};
}

brushgs::SpotsView spots_of(const Spots& from) {
    const auto& [points, around, along, sizes, noise] = from;
    return {points.data(), around.data(), along.data(), sizes.data(), noise.data(), sizes.size()};
}

std::vector<double> vector_of(const Numbers& values) { return {values.data(), values.data() + values.size()}; }

auto array_of(const Vector& values) { return to_array(std::vector(values.begin(), values.end())); }

// Columns that become arrays.
template <class... Columns>
nb::tuple arrays(Columns&&... columns) {
    return nb::make_tuple(to_array(std::forward<Columns>(columns))...);
}

nb::tuple tuple_of(brushgs::StageSpots&& spots) {
    return arrays(std::move(spots.points), std::move(spots.around), std::move(spots.along), std::move(spots.sizes),
                  std::move(spots.noise));
}

brushgs::Draw draw_of(const nb::callable& draw) {
    return [draw](std::size_t layer, std::size_t count) {
        const auto noise = nb::cast<Rows>(draw(layer, count));
        return std::vector<double>(noise.data(), noise.data() + noise.size());
    };
}

brushgs::Oklab oklab_of(const Matrices& from) { return {std::get<0>(from).data(), std::get<1>(from).data()}; }

auto map_blurred(const Rows& values, double sigma) {
    std::vector<double> map(values.data(), values.data() + values.size());
    brushgs::blur_map(values.shape(0), values.shape(1), sigma, map.data());
    return to_array(std::move(map));
}

auto map_sums(const Rows& level, const Numbers& values, std::size_t side, double half) {
    std::vector<double> sums(side * side);
    for (std::size_t i = 0; i < values.size(); ++i)
        brushgs::LevelGrid{side, half}.add(level.data()[2 * i], level.data()[2 * i + 1], values.data()[i], sums.data());
    return to_array(std::move(sums));
}

auto map_samples(const Rows& values, double half, const Rows& level) {
    std::vector<double> found(level.shape(0));
    const brushgs::LevelGrid grid{values.shape(0), half};
    for (std::size_t i = 0; i < found.size(); ++i)
        found[i] = grid.sample(values.data(), level.data()[2 * i], level.data()[2 * i + 1]);
    return to_array(std::move(found));
}

nb::object ground_tuple(brushgs::GroundMaps&& found) {
    if (!found.is_found) return nb::none();
    return nb::make_tuple(found.level, to_array(std::move(found.coverage)), to_array(std::move(found.lab)),
                          array_of(found.tone), found.extent);
}

nb::tuple cast_shadow(const Rows& points, const Numbers& weights, const Rows& lab, const Place& place) {
    const brushgs::Place at = place_of(place);
    brushgs::ShadowMaps maps;
    {
        const nb::gil_scoped_release without_gil;
        maps = brushgs::cast_shadow(
            {points.data(), weights.data(), lab.data(), weights.size(), at.radius, at.lamp.data()});
    }
    return arrays(std::move(maps.shade), std::move(maps.contact), std::move(maps.reflected));
}

auto shadow_at(const Shadow& shadow, const Rows& points) {
    const brushgs::ShadowView view = shadow_of(shadow);
    std::vector<double> found;
    for (std::size_t i = 0; i < points.shape(0); ++i) {
        const brushgs::Shade at = view.at(points.data() + 3 * i);
        found.insert(found.end(), {at.shade, at.contact, at.reflected[0], at.reflected[1]});
    }
    return to_array(std::move(found));
}

nb::tuple profile_around(const Place& place, double farthest, double ground_extent) {
    auto found = brushgs::profile_around(place_of(place), farthest, ground_extent);
    return nb::make_tuple(to_array(std::move(found.rho)), to_array(std::move(found.height)),
                          to_array(std::move(found.length)), found.table, found.wall);
}

auto slopes_at(const Surface& surface, const Numbers& along) {
    return to_array(brushgs::slopes_at(profile_of(surface), along.data(), along.size()));
}

auto stroke_sizes(const Surface& surface, const Place& place, double distance, double seen_width) {
    return to_array(brushgs::stroke_sizes(profile_of(surface), place_of(place), distance, seen_width));
}

nb::tuple place_spots(const Surface& surface, const Numbers& sizes, double overlap, double until,
                      const nb::callable& draw) {
    return tuple_of(brushgs::place_spots(profile_of(surface), {sizes.data(), overlap, until}, draw_of(draw)));
}

nb::tuple lay_layers(const Surface& surface, const Numbers& usual, double size, double radius,
                     const std::vector<Shadow>& shadows, const nb::callable& draw) {
    std::vector<brushgs::ShadowView> views;
    for (const Shadow& shadow : shadows) views.push_back(shadow_of(shadow));
    return tuple_of(brushgs::lay_layers(profile_of(surface), usual.data(), size, radius, views, draw_of(draw)));
}

auto surface_colors(const Surface& surface, const Spots& spots, const Tones& tones,
                    const std::optional<Ground>& ground) {
    const auto& [table, wall, slope, reads] = tones;
    brushgs::StageTones all{{}, {}, slope, reads};
    std::copy_n(table.data(), 3, all.table.begin());
    std::copy_n(wall.data(), 3, all.wall.begin());
    const auto own = ground_of(ground);
    return to_array(brushgs::surface_colors(profile_of(surface), spots_of(spots), all, pointer_to(own)));
}

void shade_colors(const Spots& spots, const Shadow& shadow, double strength, const std::optional<Ground>& ground,
                  Out<double, 2> lab) {
    const auto own = ground_of(ground);
    brushgs::shade_colors(spots_of(spots), shadow_of(shadow), strength, pointer_to(own), lab.data());
}

auto stage_frames(const Surface& surface, const Spots& spots, const Cube& waves, double radius, bool is_still) {
    return to_array(brushgs::stage_frames(profile_of(surface), spots_of(spots), waves.data(), radius, is_still));
}

auto turned_quats(const Rows& axes, const Cube& frames) {
    std::vector<double> quats(4 * frames.shape(0));
    for (std::size_t i = 0; i < frames.shape(0); ++i)
        brushgs::turn_to_world(axes.data(), frames.data() + 9 * i, &quats[4 * i]);
    return to_array(std::move(quats));
}

nb::tuple strokes_on(const Place& place, const Spots& spots, const Cube& frames, const Rows& lab, const Vector& style,
                     const std::optional<Numbers>& contrast, const std::optional<Numbers>& longer,
                     const Matrices& oklab) {
    auto made = brushgs::strokes_on(place_of(place), spots_of(spots), frames.data(), lab.data(),
                                    {style[0], {style[1], style[2]}, data_or_null(contrast), data_or_null(longer)},
                                    oklab_of(oklab));
    return arrays(std::move(made.means), std::move(made.quats), std::move(made.scales), std::move(made.opacities),
                  std::move(made.sh));
}

nb::tuple outline_in(const Cube& rgb, const Rows& alpha, const Rows& viewmat, const Rows& K, const Place& place,
                     const Surface& surface, double ground_extent, const Matrices& oklab) {
    const double* const k = K.data();
    auto found = brushgs::outline_in(
        {rgb.data(), alpha.data(), alpha.shape(0), alpha.shape(1), viewmat.data(), k[0], k[4], k[2], k[5]},
        place_of(place), profile_of(surface), ground_extent, oklab_of(oklab));
    return arrays(std::move(found.lightness), std::move(found.is_table), std::move(found.lateral));
}

brushgs::Outline outline_of(const Outline& from) {
    const auto& [lightness, is_table, lateral] = from;
    return {vector_of(lightness), {is_table.data(), is_table.data() + is_table.size()}, vector_of(lateral)};
}

nb::tuple choose_tones(const Outline& outline, const Vector& mean, double low, double high,
                       const std::optional<Numbers>& ground, double values) {
    const auto found = brushgs::choose_tones(outline_of(outline), {mean, low, high, data_or_null(ground), values});
    return nb::make_tuple(array_of(found.table), array_of(found.wall), found.slope, found.reads);
}

double tones_read(const Outline& outline, double table, double wall) {
    return brushgs::tones_read(outline_of(outline), table, wall, 0);
}

template <class T>
nb::tuple find_site(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, const Rows& axes,
                    const Numbers& lamp, const Matrices& oklab) {
    brushgs::StageSite site;
    {
        const nb::gil_scoped_release without_gil;
        site = brushgs::find_site<T>(
            {means.data(), quats.data(), scales.data(), opacities.data(), sh.data(), opacities.size(), sh.shape(1)},
            axes.data(), lamp.data(), oklab_of(oklab));
    }
    const auto& [foot, _, radius, width, height, __] = site.place;
    return nb::make_tuple(nb::make_tuple(array_of(foot), axes, radius, width, height, lamp),
                          ground_tuple(std::move(site.ground)), to_array(std::move(site.points)),
                          to_array(std::move(site.weights)), to_array(std::move(site.lab)));
}

template <class T>
void dissolve(In<T, 2> means, Out<T, 1> opacities, Out<T, 3> sh, const Ground& ground,
              const std::optional<Numbers>& table, const Matrices& oklab) {
    brushgs::dissolve<T>(place_of(std::get<0>(ground)), *ground_of(ground), data_or_null(table), oklab_of(oklab),
                         {means.data(), opacities.size(), sh.shape(1), opacities.data(), sh.data()});
}

template <class T>
Vector mean_lab(In<T, 3> sh, const Numbers& weights, const Matrices& oklab) {
    return brushgs::mean_lab(sh.data(), sh.shape(1), weights.data(), weights.size(), oklab_of(oklab));
}

template <class T>
double border_alpha(In<T, 2> alpha) {
    return brushgs::border_alpha(alpha.data(), alpha.shape(0), alpha.shape(1));
}

// An argument that is not converted, unless it is a number or three.
template <class T>
auto argument(const char* name) {
    using Plain = std::decay_t<T>;
    if constexpr (std::is_arithmetic_v<Plain> || std::is_same_v<Plain, Vector>)
        return nb::arg(name);
    else
        return nb::arg(name).noconvert();
}

// Defines a function with arguments of these names.
template <class Result, class... Args, class... Names>
void def(nb::module_& m, const char* name, Result (*function)(Args...), const char* doc, Names... names) {
    m.def(name, function, doc, argument<Args>(names)...);
}

template <class T>
void def_scenes(nb::module_& m) {
    def(m, "find_site", &find_site<T>,
        "The place of a scene, its ground, and of a sample local points, paint and OKLab.", "means", "quats", "scales",
        "opacities", "sh", "axes", "lamp", "oklab");
    def(m, "dissolve", &dissolve<T>, "Blends strokes on a ground into a table, OKLab, or into bare paper.", "means",
        "opacities", "sh", "ground", "table", "oklab");
    def(m, "mean_lab", &mean_lab<T>, "The mean color of Gaussians, OKLab.", "sh", "weights", "oklab");
    def(m, "border_alpha", &border_alpha<T>, "Mean alpha of the border of a picture.", "alpha");
}

}  // namespace

void bind_stage(nb::module_& m) {
    m.attr("STAGE_LAMP") = std::to_array(brushgs::kLamp);
    m.attr("SHADOW_REACH") = brushgs::kShadowReach;
    m.attr("SHADOW_SIDE") = brushgs::kShadowSide;
    m.attr("GROUND_REACH") = brushgs::kGroundReach;
    m.attr("GROUND_SIDE") = brushgs::kGroundSide;
    m.attr("GROUND_BAND") = brushgs::kGroundBand;
    m.attr("OUTLINE_READS") = brushgs::kOutlineReads;
    m.attr("OUTLINE_SIDE") = brushgs::kOutlineSide;
    m.attr("FULL_BORDER") = brushgs::kFullBorder;
    m.attr("NUM_WAVES") = brushgs::kWaves;
    m.attr("STROKE_SIGMAS") = brushgs::kStrokeSigmas;
    m.attr("SPOT_NOISE") = brushgs::kSpotNoise;
    def_scenes<float>(m);
    def_scenes<double>(m);
    def(m, "map_blurred", &map_blurred, "A map blurred by a Gaussian of cells.", "values", "sigma");
    def(m, "map_sums", &map_sums, "Sums of values at level points [n, 2] in cells.", "level", "values", "side", "half");
    def(m, "map_samples", &map_samples, "Bilinear samples of a map at level points [n, 2].", "values", "half", "level");
    def(m, "cast_shadow", &cast_shadow, "Maps of shade, contact and reflected color, a and b.", "points", "weights",
        "lab", "place");
    def(m, "shadow_at", &shadow_at, "Shade, contact, reflected a and b at points.", "shadow", "points");
    def(m, "profile_around", &profile_around, "The surface around a subject.", "place", "farthest", "ground_extent");
    def(m, "slopes_at", &slopes_at, "Angles of a surface with the level at lengths along its profile.", "surface",
        "along");
    def(m, "stroke_sizes", &stroke_sizes, "Sizes of strokes along a profile.", "surface", "place", "distance",
        "seen_width");
    def(m, "size_beside", &brushgs::size_beside, "The size of strokes beside so many of a subject.", "num_strokes");
    def(m, "place_spots", &place_spots, "Spots of strokes; draw(layer, count) gives noise [count, 7].", "surface",
        "sizes", "overlap", "until", "draw");
    def(m, "lay_layers", &lay_layers, "Spots of broad strokes in the light, fine ones in shadow.", "surface", "usual",
        "size", "radius", "shadows", "draw");
    def(m, "surface_colors", &surface_colors, "OKLab of table and wall at spots.", "surface", "spots", "tones",
        "ground");
    def(m, "shade_colors", &shade_colors, "Darkens and tints OKLab colors in shadow.", "spots", "shadow", "strength",
        "ground", "lab");
    def(m, "stage_frames", &stage_frames, "Axes of strokes on a surface, in columns.", "surface", "spots", "waves",
        "radius", "is_still");
    def(m, "turned_quats", &turned_quats, "World quaternions of local axes in columns; the second may be flipped.",
        "axes", "frames");
    def(m, "strokes_on", &strokes_on, "Columns of strokes; style: aspect, jitter of lightness, and of a and b.",
        "place", "spots", "frames", "lab", "style", "contrast", "longer", "oklab");
    def(m, "outline_in", &outline_in, "Lightness, table and place of the wall of an outline.", "rgb", "alpha",
        "viewmat", "K", "place", "surface", "ground_extent", "oklab");
    def(m, "choose_tones", &choose_tones,
        "Table and wall, slope of the wall, and share of the outline that stands out.", "outline", "mean", "low",
        "high", "ground", "values");
    def(m, "tones_read", &tones_read, "Share of an outline that stands out before these lightnesses.", "outline",
        "table", "wall");
}

}  // namespace bindings
