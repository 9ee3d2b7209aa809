// Python: stages. Arrays of several ranks come back flat.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/stage.hpp"

namespace bindings {

namespace {

using brushgs::Outline;
using brushgs::ProfileView;
using Numbers = In<double, 1>;
using Rows = In<double, 2>;
using Vector = std::array<double, 3>;

ProfileView profile_of(const Numbers& rho, const Numbers& height, const Numbers& length) {
    return {rho.data(), height.data(), length.data(), rho.size(), 0, 0};
}

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

std::optional<nb::tuple> find_ground(const Rows& points, In<bool, 1> is_level, const Numbers& weights, const Rows& lab,
                                     double radius, double height) {
    const std::vector<std::uint8_t> level(is_level.data(), is_level.data() + is_level.size());
    auto found =
        brushgs::find_ground({points.data(), level.data(), weights.data(), lab.data(), weights.size(), radius, height});
    if (!found.is_found) return std::nullopt;
    return nb::make_tuple(found.level, to_array(std::move(found.coverage)), to_array(std::move(found.lab)), found.tone,
                          found.extent);
}

nb::tuple dissolving_at(const Rows& coverage, double radius, const Rows& points) {
    std::vector<double> shares;
    std::vector<std::uint8_t> under;
    for (std::size_t i = 0; i < points.shape(0); ++i) {
        const auto found = brushgs::dissolving_at(coverage.data(), radius, points.data() + 3 * i);
        shares.push_back(found.share);
        under.push_back(found.is_under);
    }
    return nb::make_tuple(to_array(std::move(shares)), to_array(std::move(under)));
}

nb::tuple cast_shadow(const Rows& points, const Numbers& weights, const Rows& lab, double radius, const Vector& lamp) {
    brushgs::ShadowMaps maps;
    {
        const nb::gil_scoped_release without_gil;
        maps = brushgs::cast_shadow({points.data(), weights.data(), lab.data(), weights.size(), radius, lamp.data()});
    }
    return nb::make_tuple(to_array(std::move(maps.shade)), to_array(std::move(maps.contact)),
                          to_array(std::move(maps.reflected)));
}

nb::object shadow_at(const Rows& shade, const Rows& contact, In<double, 3> reflected, double radius, const Vector& lamp,
                     const Rows& points) {
    const brushgs::ShadowView shadow{shade.data(), contact.data(), reflected.data(), radius, lamp.data()};
    std::vector<double> found;
    for (std::size_t i = 0; i < points.shape(0); ++i) {
        const brushgs::Shade at = shadow.at(points.data() + 3 * i);
        found.insert(found.end(), {at.shade, at.contact, at.reflected[0], at.reflected[1]});
    }
    return nb::cast(to_array(std::move(found)));
}

nb::tuple profile_around(double radius, double width, double height, double farthest, double least_table) {
    auto found = brushgs::profile_around(radius, width, height, farthest, least_table);
    return nb::make_tuple(to_array(std::move(found.rho)), to_array(std::move(found.height)),
                          to_array(std::move(found.length)), found.table, found.wall);
}

nb::object profile_slopes(const Numbers& rho, const Numbers& height, const Numbers& length, const Numbers& along) {
    const ProfileView profile = profile_of(rho, height, length);
    const auto slopes = brushgs::profile_slopes(profile);
    return nb::cast(
        to_array(brushgs::along_profile(profile, slopes.data(), {along.data(), along.data() + along.size()})));
}

nb::object stroke_sizes(const Numbers& rho, double radius, double width, double distance, double seen_width) {
    const ProfileView profile = profile_of(rho, rho, rho);
    return nb::cast(to_array(brushgs::stroke_sizes(profile, radius, width, {distance, seen_width})));
}

std::size_t count_spots(const Numbers& rho, const Numbers& length, const Numbers& cells, double until) {
    return brushgs::count_spots(profile_of(rho, rho, length), cells.data(), until);
}

nb::tuple place_spots(const Numbers& rho, const Numbers& height, const Numbers& length, const Numbers& cells,
                      double jitter, const Rows& noise) {
    auto found =
        brushgs::place_spots(profile_of(rho, height, length), cells.data(), noise.shape(0), jitter, noise.data());
    return nb::make_tuple(to_array(std::move(found.points)), to_array(std::move(found.around)),
                          to_array(std::move(found.along)));
}

nb::object surface_colors(const Rows& points, const Numbers& slopes, const Vector& table, const Vector& wall,
                          double slope, double reach, const std::optional<Rows>& ground_lab, double ground_extent) {
    std::vector<double> lab(points.size());
    brushgs::surface_colors({points.data(), slopes.data(), slopes.size()}, {table, wall, slope, 0}, reach,
                            data_or_null(ground_lab), ground_extent, lab.data());
    return nb::cast(to_array(std::move(lab)));
}

void shade_colors(const Rows& shades, const Numbers& shares, Out<double, 2> lab) {
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const double* const at = shades.data() + 4 * i;
        brushgs::shade_color({at[0], at[1], {at[2], at[3]}}, shares.data()[i], lab.data() + 3 * i);
    }
}

nb::object stage_frames(const Rows& points, const Numbers& slopes, const Numbers& around, const Numbers& turns,
                        In<double, 3> waves, double table, double radius, bool is_still) {
    std::vector<double> frames(9 * slopes.size());
    brushgs::stage_frames({{points.data(), slopes.data(), slopes.size()},
                           around.data(),
                           turns.data(),
                           waves.data(),
                           waves.data() + 4 * brushgs::kWaves,
                           table,
                           radius,
                           is_still},
                          frames.data());
    return nb::cast(to_array(std::move(frames)));
}

nb::tuple outline_in(In<double, 3> rgb, const Rows& alpha, const Rows& K, const Rows& rays, const Vector& eye,
                     const std::array<double, 4>& lengths, const Rows& cones_from_rgb, const Rows& lab_from_roots) {
    const auto [table, wall, radius, own] = lengths;
    auto found = brushgs::outline_in({.rgb = rgb.data(),
                                      .alpha = alpha.data(),
                                      .height = alpha.shape(0),
                                      .width = alpha.shape(1),
                                      .fx = K.data()[0],
                                      .fy = K.data()[4],
                                      .cx = K.data()[2],
                                      .cy = K.data()[5],
                                      .rays = rays.data(),
                                      .eye = eye.data(),
                                      .table = table,
                                      .wall = wall,
                                      .radius = radius,
                                      .own = own,
                                      .cones_from_rgb = cones_from_rgb.data(),
                                      .lab_from_roots = lab_from_roots.data()});
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
    return nb::make_tuple(found.table, found.wall, found.slope, found.reads);
}

double tones_read(const Numbers& lightness, const In<bool, 1>& is_table, const Numbers& lateral, double table,
                  double wall) {
    return brushgs::tones_read(outline_of(lightness, is_table, lateral), table, wall, 0);
}

void bind_surface(nb::module_& m) {
    m.def("profile_around", &profile_around, nb::kw_only(), "radius"_a, "width"_a, "height"_a, "farthest"_a,
          "least_table"_a, "Distances from the axis, heights and lengths of a profile, radius of its table, its wall.");
    m.def("profile_slopes", &profile_slopes, "rho"_a.noconvert(), "height"_a.noconvert(), "length"_a.noconvert(),
          "along"_a.noconvert(), "Angles of a surface with the level at lengths along its profile.");
    m.def("stroke_sizes", &stroke_sizes, "rho"_a.noconvert(), nb::kw_only(), "radius"_a, "width"_a, "distance"_a,
          "seen_width"_a, "Sizes of strokes along a profile.");
    m.def("count_spots", &count_spots, "rho"_a.noconvert(), "length"_a.noconvert(), "cells"_a.noconvert(), "until"_a,
          "The number of spots of these cells along a profile.");
    m.def("place_spots", &place_spots, "rho"_a.noconvert(), "height"_a.noconvert(), "length"_a.noconvert(),
          "cells"_a.noconvert(), "jitter"_a, "noise"_a.noconvert(),
          "Points, radians around the axis and lengths along the profile of spots with noise [n, 7].");
    m.def("surface_colors", &surface_colors, "points"_a.noconvert(), "slopes"_a.noconvert(), nb::kw_only(), "table"_a,
          "wall"_a, "slope"_a, "reach"_a, "ground_lab"_a.noconvert().none(), "ground_extent"_a,
          "OKLab of table and wall at points.");
    m.def("shade_colors", &shade_colors, "shades"_a.noconvert(), "shares"_a.noconvert(), "lab"_a.noconvert(),
          "Darkens and tints OKLab colors in shadow, by `shadow_at` and its strength at each.");
    m.def("stage_frames", &stage_frames, "points"_a.noconvert(), "slopes"_a.noconvert(), nb::kw_only(),
          "around"_a.noconvert(), "turns"_a.noconvert(), "waves"_a.noconvert(), "table"_a, "radius"_a, "is_still"_a,
          "Axes of strokes on a surface, in columns.");
}

}  // namespace

void bind_stage(nb::module_& m) {
    m.attr("SHADOW_REACH") = brushgs::kShadowReach;
    m.attr("SHADOW_SIDE") = brushgs::kShadowSide;
    m.attr("OUTLINE_READS") = brushgs::kOutlineReads;
    m.attr("NUM_WAVES") = brushgs::kWaves;
    m.attr("SPOT_NOISE") = brushgs::kSpotNoise;
    m.def("map_blurred", &map_blurred, "values"_a.noconvert(), "sigma"_a, "A map blurred by a Gaussian of cells.");
    m.def("map_sums", &map_sums, "level"_a.noconvert(), "values"_a.noconvert(), "side"_a, "half"_a,
          "Sums of values at level points [n, 2] in cells.");
    m.def("map_samples", &map_samples, "values"_a.noconvert(), "half"_a, "level"_a.noconvert(),
          "Bilinear samples of a map at level points [n, 2].");
    m.def("find_standing", &find_standing, "points"_a.noconvert(), "weights"_a.noconvert(), "radius"_a,
          "The foot, half the width and the height of a subject.");
    m.attr("GROUND_REACH") = brushgs::kGroundReach;
    m.attr("GROUND_SIDE") = brushgs::kGroundSide;
    m.attr("GROUND_BAND") = brushgs::kGroundBand;
    m.def("find_ground", &find_ground, "points"_a.noconvert(), "is_level"_a.noconvert(), "weights"_a.noconvert(),
          "lab"_a.noconvert(), "radius"_a, "height"_a,
          "Height, coverage, OKLab [3, side, side], tone at the border and extent of a ground; or None.");
    m.def("dissolving_at", &dissolving_at, "coverage"_a.noconvert(), "radius"_a, "points"_a.noconvert(),
          "Shares of strokes that are table, and whether they lie under it.");
    m.def("cast_shadow", &cast_shadow, "points"_a.noconvert(), "weights"_a.noconvert(), "lab"_a.noconvert(), "radius"_a,
          "lamp"_a, "Maps of shade, contact and reflected color, a and b.");
    m.def("shadow_at", &shadow_at, "shade"_a.noconvert(), "contact"_a.noconvert(), "reflected"_a.noconvert(),
          "radius"_a, "lamp"_a, "points"_a.noconvert(), "Shade, contact, reflected a and b at points.");
    m.def("outline_in", &outline_in, "rgb"_a.noconvert(), "alpha"_a.noconvert(), nb::kw_only(), "K"_a.noconvert(),
          "rays"_a.noconvert(), "eye"_a, "lengths"_a, "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(),
          "Lightness, table and place of the wall of an outline; lengths: table, wall, radius, own ground.");
    m.def("choose_tones", &choose_tones, "lightness"_a.noconvert(), "is_table"_a.noconvert(), "lateral"_a.noconvert(),
          nb::kw_only(), "mean"_a, "low"_a, "high"_a, "ground"_a.noconvert().none(), "values"_a,
          "OKLab of table and wall, slope of the wall, and share of the outline that stands out.");
    m.def("tones_read", &tones_read, "lightness"_a.noconvert(), "is_table"_a.noconvert(), "lateral"_a.noconvert(),
          "table"_a, "wall"_a, "Share of an outline that stands out before these lightnesses.");
    bind_surface(m);
}

}  // namespace bindings
