// Python: stages. Arrays of several ranks come back flat. The tuples are those of brushgs/passes/add: `Place`,
// `Ground`, `Shadow`, `Surface`, `Spots` and `Tones`.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/stage.hpp"

namespace bindings {

namespace {

using brushgs::Outline;
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

nb::tuple tuple_of(brushgs::StageSpots&& spots) {
    return nb::make_tuple(to_array(std::move(spots.points)), to_array(std::move(spots.around)),
                          to_array(std::move(spots.along)), to_array(std::move(spots.sizes)),
                          to_array(std::move(spots.noise)));
}

brushgs::Oklab oklab_of(const Matrices& from) { return {std::get<0>(from).data(), std::get<1>(from).data()}; }

nb::object map_blurred(const Rows& values, double sigma) {
    std::vector<double> map(values.data(), values.data() + values.size());
    brushgs::blur_map(values.shape(0), values.shape(1), sigma, map.data());
    return nb::cast(to_array(std::move(map)));
}

nb::object map_sums(const Rows& level, const Numbers& values, std::size_t side, double half) {
    std::vector<double> sums(side * side);
    for (std::size_t i = 0; i < values.size(); ++i)
        brushgs::LevelGrid{side, half}.add(level.data()[2 * i], level.data()[2 * i + 1], values.data()[i], sums.data());
    return nb::cast(to_array(std::move(sums)));
}

nb::object map_samples(const Rows& values, double half, const Rows& level) {
    std::vector<double> found(level.shape(0));
    const brushgs::LevelGrid grid{values.shape(0), half};
    for (std::size_t i = 0; i < found.size(); ++i)
        found[i] = grid.sample(values.data(), level.data()[2 * i], level.data()[2 * i + 1]);
    return nb::cast(to_array(std::move(found)));
}

nb::tuple find_standing(const Rows& points, const Numbers& weights, double radius) {
    const auto found = brushgs::find_standing(points.data(), {weights.data(), weights.data() + weights.size()}, radius);
    return nb::make_tuple(std::to_array(found.middle), found.width, found.height);
}

nb::object ground_tuple(brushgs::GroundMaps&& found) {
    if (!found.is_found) return nb::none();
    return nb::make_tuple(found.level, to_array(std::move(found.coverage)), to_array(std::move(found.lab)),
                          to_array(std::vector(found.tone.begin(), found.tone.end())), found.extent);
}

nb::object find_ground(const Rows& points, In<bool, 1> is_level, const Numbers& weights, const Rows& lab, double radius,
                       double height) {
    const std::vector<std::uint8_t> level(is_level.data(), is_level.data() + is_level.size());
    return ground_tuple(brushgs::find_ground(
        {points.data(), level.data(), weights.data(), lab.data(), weights.size(), radius, height}));
}

nb::tuple cast_shadow(const Rows& points, const Numbers& weights, const Rows& lab, const Place& place) {
    const brushgs::Place at = place_of(place);
    brushgs::ShadowMaps maps;
    {
        const nb::gil_scoped_release without_gil;
        maps = brushgs::cast_shadow(
            {points.data(), weights.data(), lab.data(), weights.size(), at.radius, at.lamp.data()});
    }
    return nb::make_tuple(to_array(std::move(maps.shade)), to_array(std::move(maps.contact)),
                          to_array(std::move(maps.reflected)));
}

nb::object shadow_at(const Shadow& shadow, const Rows& points) {
    const brushgs::ShadowView view = shadow_of(shadow);
    std::vector<double> found;
    for (std::size_t i = 0; i < points.shape(0); ++i) {
        const brushgs::Shade at = view.at(points.data() + 3 * i);
        found.insert(found.end(), {at.shade, at.contact, at.reflected[0], at.reflected[1]});
    }
    return nb::cast(to_array(std::move(found)));
}

nb::tuple profile_around(double radius, double width, double height, double farthest, double ground_extent) {
    auto found = brushgs::profile_around(radius, width, height, farthest, ground_extent);
    return nb::make_tuple(to_array(std::move(found.rho)), to_array(std::move(found.height)),
                          to_array(std::move(found.length)), found.table, found.wall);
}

nb::object slopes_at(const Surface& surface, const Numbers& along) {
    return nb::cast(to_array(brushgs::slopes_at(profile_of(surface), along.data(), along.size())));
}

nb::object stroke_sizes(const Surface& surface, double radius, double width, double distance, double seen_width) {
    return nb::cast(to_array(brushgs::stroke_sizes(profile_of(surface), radius, width, {distance, seen_width})));
}

std::size_t count_spots(const Surface& surface, const Numbers& sizes, double overlap, double until) {
    return brushgs::count_spots(profile_of(surface), sizes.data(), overlap, until);
}

nb::tuple place_spots(const Surface& surface, const Numbers& sizes, double overlap, const Rows& noise) {
    return tuple_of(brushgs::place_spots(profile_of(surface), sizes.data(), overlap, noise.shape(0), noise.data()));
}

brushgs::LayerQuery layers_of(const Surface& surface, const Numbers& usual, double size, double radius) {
    return {profile_of(surface), usual.data(), size, radius, {}};
}

auto count_layers(const Surface& surface, const Numbers& usual, double size, double radius) {
    return brushgs::count_layers(layers_of(surface, usual, size, radius));
}

nb::tuple lay_layers(const Surface& surface, const Numbers& usual, double size, double radius,
                     const std::array<Rows, 2>& noise, const std::vector<Shadow>& shadows) {
    auto query = layers_of(surface, usual, size, radius);
    for (const Shadow& shadow : shadows) query.shadows.push_back(shadow_of(shadow));
    return tuple_of(brushgs::lay_layers(query, {noise[0].data(), noise[1].data()}));
}

nb::object surface_colors(const Surface& surface, const Spots& spots, const Tones& tones,
                          const std::optional<Ground>& ground) {
    const auto& [table, wall, slope, reads] = tones;
    brushgs::StageTones all{{}, {}, slope, reads};
    std::copy_n(table.data(), 3, all.table.begin());
    std::copy_n(wall.data(), 3, all.wall.begin());
    const auto own = ground_of(ground);
    return nb::cast(to_array(brushgs::surface_colors(profile_of(surface), spots_of(spots), all, pointer_to(own))));
}

void shade_colors(const Spots& spots, const Shadow& shadow, double strength, const std::optional<Ground>& ground,
                  Out<double, 2> lab) {
    const auto own = ground_of(ground);
    brushgs::shade_colors(spots_of(spots), shadow_of(shadow), strength, pointer_to(own), lab.data());
}

nb::object stage_frames(const Surface& surface, const Spots& spots, const Cube& waves, double radius, bool is_still) {
    return nb::cast(
        to_array(brushgs::stage_frames(profile_of(surface), spots_of(spots), waves.data(), radius, is_still)));
}

nb::object turned_quats(const Rows& axes, const Cube& frames) {
    std::array<double, 9> all;
    std::copy_n(axes.data(), 9, all.begin());
    std::vector<double> quats(4 * frames.shape(0));
    for (std::size_t i = 0; i < frames.shape(0); ++i) brushgs::turn_to_world(all, frames.data() + 9 * i, &quats[4 * i]);
    return nb::cast(to_array(std::move(quats)));
}

nb::tuple strokes_on(const Place& place, const Spots& spots, const Cube& frames, const Rows& lab,
                     const std::array<double, 3>& style, const std::optional<Numbers>& contrast,
                     const std::optional<Numbers>& longer, const Matrices& oklab) {
    auto made = brushgs::strokes_on<double>(
        place_of(place), spots_of(spots), frames.data(), lab.data(),
        {style[0], {style[1], style[2]}, data_or_null(contrast), data_or_null(longer)}, oklab_of(oklab));
    return nb::make_tuple(to_array(std::move(made.means)), to_array(std::move(made.quats)),
                          to_array(std::move(made.scales)), to_array(std::move(made.opacities)),
                          to_array(std::move(made.sh)));
}

nb::tuple outline_in(const Cube& rgb, const Rows& alpha, const Rows& viewmat, const Rows& K, const Place& place,
                     const Surface& surface, double ground_extent, const Matrices& oklab) {
    auto found = brushgs::outline_in({.rgb = rgb.data(),
                                      .alpha = alpha.data(),
                                      .height = alpha.shape(0),
                                      .width = alpha.shape(1),
                                      .viewmat = viewmat.data(),
                                      .fx = K.data()[0],
                                      .fy = K.data()[4],
                                      .cx = K.data()[2],
                                      .cy = K.data()[5]},
                                     place_of(place), profile_of(surface), ground_extent, oklab_of(oklab));
    return nb::make_tuple(to_array(std::move(found.lightness)), to_array(std::move(found.is_table)),
                          to_array(std::move(found.lateral)));
}

Outline outline_of(const Numbers& lightness, In<bool, 1> is_table, const Numbers& lateral) {
    return {{lightness.data(), lightness.data() + lightness.size()},
            {is_table.data(), is_table.data() + is_table.size()},
            {lateral.data(), lateral.data() + lateral.size()}};
}

nb::tuple choose_tones(const Numbers& lightness, const In<bool, 1>& is_table, const Numbers& lateral,
                       const Vector& mean, double low, double high, const std::optional<Numbers>& ground,
                       double values) {
    const auto found = brushgs::choose_tones(outline_of(lightness, is_table, lateral),
                                             {mean, low, high, data_or_null(ground), values});
    return nb::make_tuple(to_array(std::vector(found.table.begin(), found.table.end())),
                          to_array(std::vector(found.wall.begin(), found.wall.end())), found.slope, found.reads);
}

double tones_read(const Numbers& lightness, const In<bool, 1>& is_table, const Numbers& lateral, double table,
                  double wall) {
    return brushgs::tones_read(outline_of(lightness, is_table, lateral), table, wall, 0);
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
    return nb::make_tuple(
        nb::make_tuple(to_array(std::vector(foot.begin(), foot.end())), axes, radius, width, height, lamp),
        ground_tuple(std::move(site.ground)), to_array(std::move(site.points)), to_array(std::move(site.weights)),
        to_array(std::move(site.lab)));
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

template <class T>
void def_scenes(nb::module_& m) {
    m.def("find_site", &find_site<T>, "means"_a.noconvert(), "quats"_a.noconvert(), "scales"_a.noconvert(),
          "opacities"_a.noconvert(), "sh"_a.noconvert(), "axes"_a.noconvert(), "lamp"_a.noconvert(),
          "oklab"_a.noconvert(),
          "The place of a scene, its ground as of `find_ground`, and of a sample local points, paint and OKLab.");
    m.def("dissolve", &dissolve<T>, "means"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(),
          "ground"_a.noconvert(), "table"_a.noconvert().none(), "oklab"_a.noconvert(),
          "Blends opacities and SH of strokes on a ground into a table, OKLab, or into bare paper.");
    m.def("mean_lab", &mean_lab<T>, "sh"_a.noconvert(), "weights"_a.noconvert(), "oklab"_a.noconvert(),
          "The mean color of Gaussians, OKLab.");
    m.def("border_alpha", &border_alpha<T>, "alpha"_a.noconvert(), "Mean alpha of the border of a picture.");
}

void bind_surface(nb::module_& m) {
    m.def("profile_around", &profile_around, nb::kw_only(), "radius"_a, "width"_a, "height"_a, "farthest"_a,
          "ground_extent"_a, "The surface around a subject.");
    m.def("slopes_at", &slopes_at, "surface"_a.noconvert(), "along"_a.noconvert(),
          "Angles of a surface with the level at lengths along its profile.");
    m.def("stroke_sizes", &stroke_sizes, "surface"_a.noconvert(), nb::kw_only(), "radius"_a, "width"_a, "distance"_a,
          "seen_width"_a, "Sizes of strokes along a profile.");
    m.def("size_beside", &brushgs::size_beside, "num_strokes"_a, "The size of strokes beside so many of a subject.");
    m.def("count_spots", &count_spots, "surface"_a.noconvert(), "sizes"_a.noconvert(), "overlap"_a, "until"_a,
          "The number of spots of strokes of these sizes along the profile.");
    m.def("place_spots", &place_spots, "surface"_a.noconvert(), "sizes"_a.noconvert(), "overlap"_a,
          "noise"_a.noconvert(), "Spots with noise [n, 7].");
    m.def("count_layers", &count_layers, "surface"_a.noconvert(), "usual"_a.noconvert(), "size"_a, "radius"_a,
          "The number of spots in the layers of broad strokes and of fine ones.");
    m.def("lay_layers", &lay_layers, "surface"_a.noconvert(), "usual"_a.noconvert(), "size"_a, "radius"_a,
          "noise"_a.noconvert(), "shadows"_a.noconvert(), "Spots of broad strokes in the light, fine ones in shadow.");
    m.def("surface_colors", &surface_colors, "surface"_a.noconvert(), "spots"_a.noconvert(), "tones"_a.noconvert(),
          "ground"_a.noconvert().none(), "OKLab of table and wall at spots.");
    m.def("shade_colors", &shade_colors, "spots"_a.noconvert(), "shadow"_a.noconvert(), "strength"_a,
          "ground"_a.noconvert().none(), "lab"_a.noconvert(), "Darkens and tints OKLab colors in shadow.");
    m.def("stage_frames", &stage_frames, "surface"_a.noconvert(), "spots"_a.noconvert(), "waves"_a.noconvert(),
          "radius"_a, "is_still"_a, "Axes of strokes on a surface, in columns.");
    m.def("turned_quats", &turned_quats, "axes"_a.noconvert(), "frames"_a.noconvert(),
          "World quaternions of local axes in columns, of which the second may be flipped.");
    m.def("strokes_on", &strokes_on, "place"_a.noconvert(), "spots"_a.noconvert(), "frames"_a.noconvert(),
          "lab"_a.noconvert(), nb::kw_only(), "style"_a, "contrast"_a.noconvert().none(), "longer"_a.noconvert().none(),
          "oklab"_a.noconvert(), "Columns of strokes; style: aspect, jitter of lightness, and of a and b.");
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
    m.attr("SPOT_NOISE") = brushgs::kSpotNoise;
    def_scenes<float>(m);
    def_scenes<double>(m);
    m.def("map_blurred", &map_blurred, "values"_a.noconvert(), "sigma"_a, "A map blurred by a Gaussian of cells.");
    m.def("map_sums", &map_sums, "level"_a.noconvert(), "values"_a.noconvert(), "side"_a, "half"_a,
          "Sums of values at level points [n, 2] in cells.");
    m.def("map_samples", &map_samples, "values"_a.noconvert(), "half"_a, "level"_a.noconvert(),
          "Bilinear samples of a map at level points [n, 2].");
    m.def("find_standing", &find_standing, "points"_a.noconvert(), "weights"_a.noconvert(), "radius"_a,
          "The foot, half the width and the height of a subject.");
    m.def("find_ground", &find_ground, "points"_a.noconvert(), "is_level"_a.noconvert(), "weights"_a.noconvert(),
          "lab"_a.noconvert(), "radius"_a, "height"_a,
          "Height, coverage, OKLab [3, side, side], tone at the border and extent of a ground; or None.");
    m.def("cast_shadow", &cast_shadow, "points"_a.noconvert(), "weights"_a.noconvert(), "lab"_a.noconvert(),
          "place"_a.noconvert(), "Maps of shade, contact and reflected color, a and b.");
    m.def("shadow_at", &shadow_at, "shadow"_a.noconvert(), "points"_a.noconvert(),
          "Shade, contact, reflected a and b at points.");
    m.def("outline_in", &outline_in, "rgb"_a.noconvert(), "alpha"_a.noconvert(), nb::kw_only(), "viewmat"_a.noconvert(),
          "K"_a.noconvert(), "place"_a.noconvert(), "surface"_a.noconvert(), "ground_extent"_a, "oklab"_a.noconvert(),
          "Lightness, table and place of the wall of an outline.");
    m.def("choose_tones", &choose_tones, "lightness"_a.noconvert(), "is_table"_a.noconvert(), "lateral"_a.noconvert(),
          nb::kw_only(), "mean"_a, "low"_a, "high"_a, "ground"_a.noconvert().none(), "values"_a,
          "OKLab of table and wall, slope of the wall, and share of the outline that stands out.");
    m.def("tones_read", &tones_read, "lightness"_a.noconvert(), "is_table"_a.noconvert(), "lateral"_a.noconvert(),
          "table"_a, "wall"_a, "Share of an outline that stands out before these lightnesses.");
    bind_surface(m);
}

}  // namespace bindings
