// The module that Python imports, and what of scenes becomes strokes; see bindings.hpp.
#include "bindings.hpp"

#include <algorithm>

#include "brushgs/blending.hpp"
#include "brushgs/broken_color.hpp"
#include "brushgs/coats.hpp"
#include "brushgs/coverage.hpp"
#include "brushgs/cpu.hpp"
#include "brushgs/equal_rows.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/features.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/floaters.hpp"
#include "brushgs/fragment_layers.hpp"
#include "brushgs/fragments.hpp"
#include "brushgs/frame_pool.hpp"
#include "brushgs/light.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/merge.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/project.hpp"
#include "brushgs/prune.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/solid.hpp"
#include "brushgs/streamlines.hpp"
#include "brushgs/stroke_levels.hpp"
#include "brushgs/stroke_relief.hpp"
#include "brushgs/trace.hpp"
#include "brushgs/track.hpp"
#include "brushgs/visible_shares.hpp"
#include "brushgs/wet.hpp"
#include "brushgs/worth.hpp"

namespace nb = nanobind;
using namespace nb::literals;

#if defined(__clang__)
#define BRUSHGS_COMPILER "Clang " __clang_version__
#else
#define BRUSHGS_COMPILER "GCC " __VERSION__
#endif

namespace bindings {

namespace {

// Scenes, and what of them becomes a stroke

brushgs::Extent extent_of(const In<double, 1>& center, double radius) {
    return {.center = {center(0), center(1), center(2)}, .radius = radius};
}

template <class T>
nb::tuple robust_extent(In<T, 2> points, int num_threads) {
    brushgs::Extent found{};
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::robust_extent(points.data(), points.shape(0), num_threads);
    }
    return nb::make_tuple(to_array(std::vector<double>(found.center, found.center + 3)), found.radius);
}

template <class T>
nb::object visible_shares(In<T, 2> means, In<T, 1> opacities, In<double, 1> areas, int num_threads) {
    const std::size_t count = means.shape(0);
    auto shares = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::visible_shares(
            brushgs::VisibleShares<T>{.means = means.data(),
                                      .opacities = opacities.data(),
                                      .areas = areas.data(),
                                      .count = count,
                                      .extent = brushgs::robust_extent(means.data(), count, num_threads),
                                      .num_threads = num_threads,
                                      .shares = shares.get()});
    }
    return row(shares, count);
}

template <class T>
nb::tuple contracted(In<T, 2> means, In<double, 1> center, double radius, int num_threads) {
    const std::size_t count = means.shape(0);
    auto places = brushgs::make_buffer<double>(3 * count), factors = brushgs::make_buffer<double>(count);
    const auto extent = extent_of(center, radius);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::contract_all(means.data(), count, extent, num_threads, places.get(), factors.get());
    }
    return nb::make_tuple(table(places, count, 3), table(factors, count, 1));
}

template <class T>
nb::object cluster_features(In<T, 2> means, In<T, 2> scales, In<T, 3> sh, In<double, 1> center, double radius,
                            double color_weight, int num_threads) {
    const std::size_t count = means.shape(0);
    auto points = brushgs::make_buffer<float>(brushgs::kFeatures * count);
    const brushgs::FeatureQuery<T> query{.means = means.data(),
                                         .scales = scales.data(),
                                         .sh = sh.data(),
                                         .count = count,
                                         .sh_terms = sh.shape(1),
                                         .extent = extent_of(center, radius),
                                         .color_weight = color_weight,
                                         .num_threads = num_threads};
    {
        const nb::gil_scoped_release without_gil;
        brushgs::cluster_features(query, points.get());
    }
    return table(points, count, brushgs::kFeatures);
}

template <class T>
void feature_spans(In<T, 2> quats, In<float, 2> points, Out<float, 3> spans, int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::feature_spans(quats.data(), points.data(), quats.shape(0), points.shape(1), num_threads, spans.data());
}

template <class T>
nb::object color_detail(In<T, 3> sh, In<double, 2> places, int num_threads) {
    const std::size_t count = places.shape(0);
    auto detail = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::color_detail(sh.data(), sh.shape(1), places.data(), count, num_threads, detail.get());
    }
    return row(detail, count);
}

nb::object cluster_weights(In<double, 1> contributions, In<double, 1> detail) {
    const std::size_t count = contributions.shape(0);
    auto weights = brushgs::make_buffer<double>(count);
    brushgs::cluster_weights(contributions.data(), detail.data(), count, weights.get());
    return row(weights, count);
}

void hash_rows(In<float, 2> columns, std::size_t place, Out<std::uint64_t, 1> hashes) {
    const nb::gil_scoped_release without_gil;
    brushgs::hash_rows(columns.data(), columns.shape(0), columns.shape(1), place, hashes.data());
}

auto chances(In<std::uint64_t, 1> hashes, std::uint64_t seed, std::uint64_t draw) {
    std::vector<double> found(hashes.shape(0));
    std::transform(hashes.data(), hashes.data() + hashes.shape(0), found.begin(),
                   [=](std::uint64_t hash) { return brushgs::chance(hash, seed, draw); });
    return to_array(std::move(found));
}

nb::tuple group_equal(In<std::uint64_t, 1> hashes, int num_threads) {
    brushgs::EqualRows found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::group_equal(hashes.data(), hashes.shape(0), num_threads);
    }
    return nb::make_tuple(to_array(std::move(found.first)), to_array(std::move(found.groups)));
}

auto late_copies(In<std::int64_t, 1> groups) {
    const std::vector<std::int64_t> some(groups.data(), groups.data() + groups.shape(0));
    return to_array(std::move(brushgs::late_copies(some).rows));
}

nb::tuple level_of(brushgs::FloaterLevel&& level) {
    return nb::make_tuple(to_array(std::move(level.rows)), level.share, level.nearest, level.is_seen);
}

template <class T>
nb::tuple find_floaters(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<std::int64_t, 1> first,
                        In<std::int64_t, 1> groups, int num_threads) {
    const brushgs::FloaterQuery<T> query{means.data(),     quats.data(),   scales.data(),
                                         opacities.data(), means.shape(0), num_threads};
    brushgs::Floaters found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_floaters(query, {first.data(), first.data() + first.shape(0)},
                                       {groups.data(), groups.data() + groups.shape(0)});
    }
    return nb::make_tuple(level_of(std::move(found.sure)), level_of(std::move(found.strong)), found.has_bodies,
                          found.is_haze);
}

template <class T>
brushgs::StrokeQuery<T> strokes_of(const In<T, 2>& means, const In<T, 2>& quats, const In<T, 2>& scales,
                                   const In<T, 1>& opacities, double finest, int num_threads) {
    return {means.data(), quats.data(), scales.data(), opacities.data(), means.shape(0), finest, num_threads};
}

template <class T>
auto worth_keeping(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, double finest,
                   int num_threads) {
    std::vector<std::uint8_t> kept;
    {
        const nb::gil_scoped_release without_gil;
        kept = brushgs::worth_keeping(strokes_of(means, quats, scales, opacities, finest, num_threads));
    }
    return to_array(std::move(kept));
}

template <class T>
void make_solid(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, double finest, double strength,
                int num_threads, Out<T, 2> solid_scales, Out<T, 1> solid_opacities) {
    const nb::gil_scoped_release without_gil;
    brushgs::make_solid(strokes_of(means, quats, scales, opacities, finest, num_threads), strength, solid_scales.data(),
                        solid_opacities.data());
}

template <class T>
void break_colors(In<T, 2> means, In<T, 2> scales, In<T, 1> opacities, In<double, 2> cones_from_rgb,
                  In<double, 2> lab_from_roots, double lightness, double chroma, double follows, std::uint64_t seed,
                  int num_threads, Out<T, 3> sh) {
    const nb::gil_scoped_release without_gil;
    brushgs::break_colors(brushgs::BrokenColor<T>{.means = means.data(),
                                                  .scales = scales.data(),
                                                  .opacities = opacities.data(),
                                                  .count = means.shape(0),
                                                  .sh_terms = sh.shape(1),
                                                  .cones_from_rgb = cones_from_rgb.data(),
                                                  .lab_from_roots = lab_from_roots.data(),
                                                  .lightness = lightness,
                                                  .chroma = chroma,
                                                  .follows = follows,
                                                  .seed = seed,
                                                  .num_threads = num_threads},
                          sh.data());
}

template <class T>
brushgs::PaintedStrokes<T> painted(const In<T, 2>& scales, const In<T, 1>& opacities, const In<T, 3>& sh,
                                   const In<double, 2>& cones_from_rgb, const In<double, 2>& lab_from_roots) {
    return {scales.data(),         opacities.data(),     sh.data(), scales.shape(0), sh.shape(1),
            cones_from_rgb.data(), lab_from_roots.data()};
}

template <class T>
double median_log_size(In<T, 2> scales) {
    return brushgs::median_log_size(scales.data(), scales.shape(0));
}

template <class T>
nb::tuple light_range(In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, In<double, 2> cones_from_rgb,
                      In<double, 2> lab_from_roots) {
    const auto found = brushgs::light_range(painted(scales, opacities, sh, cones_from_rgb, lab_from_roots));
    return nb::make_tuple(found.dark, found.light);
}

template <class T>
void relative_reliefs(In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, In<double, 2> cones_from_rgb,
                      In<double, 2> lab_from_roots, double middle, double by_light, double dark, double light,
                      Out<double, 2> reliefs) {
    const nb::gil_scoped_release without_gil;
    brushgs::relative_reliefs(painted(scales, opacities, sh, cones_from_rgb, lab_from_roots), middle, by_light,
                              {dark, light}, reliefs.data());
}

nb::object spread_weights(In<double, 1> weights, In<double, 2> places, int num_threads) {
    const std::size_t count = weights.shape(0);
    auto ranked = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::spread_weights(weights.data(), places.data(), count, num_threads, ranked.get());
    }
    return row(ranked, count);
}

std::size_t count_spare(In<double, 1> weights, In<double, 1> ranked, int num_threads) {
    const nb::gil_scoped_release without_gil;
    return brushgs::count_spare(weights.data(), ranked.data(), weights.shape(0), num_threads);
}

void mark_highest(In<double, 1> weights, std::size_t num_kept, Out<std::uint8_t, 1> is_kept) {
    const nb::gil_scoped_release without_gil;
    brushgs::mark_highest(weights.data(), weights.shape(0), num_kept, is_kept.data());
}

template <class T>
void cover_members(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                   In<double, 1> areas, In<double, 1> visible, In<std::int32_t, 1> labels, double overlap,
                   bool closes_gaps, double finest, int num_threads,
                   std::tuple<Out<T, 2>, Out<T, 2>, Out<T, 2>, Out<T, 1>, Out<T, 3>> merged) {
    const brushgs::Cover<T> query{.members = {means.data(), quats.data(), scales.data(), opacities.data(), sh.data()},
                                  .num_members = means.shape(0),
                                  .sh_terms = sh.shape(1),
                                  .areas = areas.data(),
                                  .visible = visible.data(),
                                  .labels = labels.data(),
                                  .num_groups = std::get<0>(merged).shape(0),
                                  .overlap = overlap,
                                  .closes_gaps = closes_gaps,
                                  .finest = finest,
                                  .num_threads = num_threads};
    const auto columns =
        std::apply([](const auto&... column) { return brushgs::MergeColumns<T>{column.data()...}; }, merged);
    const nb::gil_scoped_release without_gil;
    brushgs::cover_members(query, columns);
}

template <class T>
void def_scenes(nb::module_& m) {
    m.def("robust_extent", &robust_extent<T>, "points"_a.noconvert(), "num_threads"_a,
          "The center [3] and radius of points [N, 3], see extent.hpp.");
    m.def("visible_shares", &visible_shares<T>, "means"_a.noconvert(), "opacities"_a.noconvert(), "areas"_a.noconvert(),
          "num_threads"_a,
          "The share of directions from which others do not hide each Gaussian [N], see visible_shares.hpp.");
    m.def("contracted", &contracted<T>, "means"_a.noconvert(), "center"_a.noconvert(), "radius"_a, "num_threads"_a,
          "Positions [N, 3] in a scene, contracted, and the factors [N, 1] on lengths there, see extent.hpp.");
    m.def("cluster_features", &cluster_features<T>, nb::kw_only(), "means"_a.noconvert(), "scales"_a.noconvert(),
          "sh"_a.noconvert(), "center"_a.noconvert(), "radius"_a, "color_weight"_a, "num_threads"_a,
          "The points [N, 9] that k-means clusters, see features.hpp.");
    m.def("feature_spans", &feature_spans<T>, "quats"_a.noconvert(), "points"_a.noconvert(), "spans"_a.noconvert(),
          "num_threads"_a, "Write the half axes [N, 3, 3] of Gaussians among these points, see features.hpp.");
    m.def("color_detail", &color_detail<T>, "sh"_a.noconvert(), "places"_a.noconvert(), "num_threads"_a,
          "The standard deviation [N] of base colors among neighbors, see features.hpp.");
    m.def("cover_members", &cover_members<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "areas"_a.noconvert(),
          "visible"_a.noconvert(), "labels"_a.noconvert(), "overlap"_a, "closes_gaps"_a, "finest"_a, "num_threads"_a,
          "merged"_a.noconvert(),
          "Write the Gaussian of each label: means, quats, scales, opacities and sh, see merge.hpp.");
    m.def("break_colors", &break_colors<T>, nb::kw_only(), "means"_a.noconvert(), "scales"_a.noconvert(),
          "opacities"_a.noconvert(), "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(), "lightness"_a,
          "chroma"_a, "follows"_a, "seed"_a, "num_threads"_a, "sh"_a.noconvert(),
          "Shift the base colors in sh [k, terms, 3] of strokes, see broken_color.hpp.");
    m.def("median_log_size", &median_log_size<T>, "scales"_a.noconvert(),
          "The median logarithm of the sizes of one stroke or more, see stroke_relief.hpp.");
    m.def("light_range", &light_range<T>, nb::kw_only(), "scales"_a.noconvert(), "opacities"_a.noconvert(),
          "sh"_a.noconvert(), "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(),
          "OKLab L of what counts as fully dark and as fully light in strokes, see stroke_relief.hpp.");
    m.def("relative_reliefs", &relative_reliefs<T>, nb::kw_only(), "scales"_a.noconvert(), "opacities"_a.noconvert(),
          "sh"_a.noconvert(), "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(), "middle"_a, "by_light"_a,
          "dark"_a, "light"_a, "reliefs"_a.noconvert(),
          "Write thickness and gain [N, 2] of the paint of strokes, see stroke_relief.hpp.");
    m.def("find_floaters", &find_floaters<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "first"_a.noconvert(), "groups"_a.noconvert(),
          "num_threads"_a,
          "The sure and the strong level of floaters among Gaussians in groups at one place, whether the scene has "
          "bodies, and whether it is haze. A level is a mask [N] uint8, a share, a gap and whether it is seen; see "
          "floaters.hpp.");
    m.def("worth_keeping", &worth_keeping<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "finest"_a, "num_threads"_a,
          "A mask [k] uint8 of the strokes that are worth keeping, see worth.hpp.");
    m.def("make_solid", &make_solid<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "finest"_a, "strength"_a, "num_threads"_a,
          "solid_scales"_a.noconvert(), "solid_opacities"_a.noconvert(),
          "Write the scales and opacities of solid strokes, see solid.hpp.");
}

}  // namespace

}  // namespace bindings

NB_MODULE(_core, m) {
    using namespace bindings;
    m.doc() = "The compiled core of brushgs; use the functions of the package instead.";
#if defined(NDEBUG)
    // A program stopped early, by Ctrl-C, may leak objects. The leak report is useless for users; debug builds still
    // print it.
    nb::set_leak_warnings(false);
#endif
    m.def(
        "isa", [] { return brushgs::isa_name(brushgs::best_isa()); },
        "Name of the instruction set in use: avx512, avx2 or baseline.");
    m.def(
        "isas",
        [] {
            nb::list names;
            for (const brushgs::Isa isa : {brushgs::Isa::baseline, brushgs::Isa::avx2, brushgs::Isa::avx512})
                if (brushgs::has_isa(isa)) names.append(brushgs::isa_name(isa));
            return names;
        },
        nb::sig("def isas() -> list[str]"),
        "Names of the instruction sets that this processor has and the core is compiled for, the best one last.");
    m.def(
        "build",
        [] {
#if defined(NDEBUG) && defined(__OPTIMIZE__)
            constexpr bool is_optimised = true;
#else
            constexpr bool is_optimised = false;
#endif
            return nb::make_tuple(BRUSHGS_COMPILER, is_optimised);
        },
        "Compiler of the core, and whether it optimised; for benchmarks.");
    m.attr("MAX_ALPHA") = brushgs::kMaxAlpha;
    m.attr("MIN_ALPHA") = brushgs::kMinAlpha;
    m.attr("MIN_TRANSMITTANCE") = brushgs::kMinTransmittance;
    m.attr("LEAST_LIGHT") = brushgs::kLeastLight;
    m.attr("LEAST_LIGHT_RANGE") = brushgs::kLeastLightRange;
    m.attr("UNDERPAINT_THICKNESS") = brushgs::kUnderpaintThickness;
    m.attr("BRISTLES") = brushgs::kBristles;
    m.attr("BRISTLE_MARGIN") = brushgs::kBristleMargin;
    m.attr("GAUSSIAN_SIGMAS") = brushgs::kGaussianSigmas;
    m.attr("TILE_HEIGHT") = brushgs::kTileHeight;
    m.attr("AREA_SCALE_STEPS") = brushgs::kAreaScaleSteps;
    m.attr("MOST_DIMENSIONS") = brushgs::kMostDimensions;
    m.attr("CONTRIBUTION_POWER") = brushgs::kContributionPower;
    m.attr("MOST_NEIGHBORS") = brushgs::kMostNeighbors;
    nb::enum_<brushgs::Kernel>(m, "Kernel", "What a box is filled with.")
        .value("bilinear", brushgs::Kernel::bilinear)
        .value("nearest", brushgs::Kernel::nearest)
        .value("gaussian", brushgs::Kernel::gaussian)
        .value("ellipse", brushgs::Kernel::ellipse);
    nb::enum_<brushgs::Blend>(m, "Blend", "What paint does to what lies behind it.")
        .value("cover", brushgs::Blend::cover)
        .value("glaze", brushgs::Blend::glaze);
    nb::enum_<brushgs::Lock>(m, "Lock", "Which way the u axis of a box points.")
        .value("off", brushgs::Lock::off)
        .value("anchor", brushgs::Lock::anchor)
        .value("given", brushgs::Lock::given);
    bind_boxes(m);
    bind_form(m);
    bind_layers(m);
    bind_looks(m);
    bind_rows(m);
    bind_stage(m);
    bind_views(m);
    def_scenes<float>(m);
    def_scenes<double>(m);
    m.def("cluster_weights", &cluster_weights, "contributions"_a.noconvert(), "detail"_a.noconvert(),
          "Weights [N] in k-means by contributions [N] and detail [N] of color, see features.hpp.");
    m.def("hash_rows", &hash_rows, "columns"_a.noconvert(), "place"_a, "hashes"_a.noconvert(),
          "Add columns [N, w] to the hashes [N] of rows, `place` on; see equal_rows.hpp.");
    m.def("chances", &chances, "hashes"_a.noconvert(), "seed"_a, "draw"_a,
          "Uniform random numbers [N] in [0, 1) for rows of these hashes.");
    m.def("group_equal", &group_equal, "hashes"_a.noconvert(), "num_threads"_a,
          "The first row of each group of equal rows, ascending, and the group of each row [N].");
    m.def("late_copies", &late_copies, "groups"_a.noconvert(),
          "A mask [N] uint8 of rows after the first MOST_COPIES of their group.");
    m.attr("FAINT_SCENE") = brushgs::kFaintScene;
    m.attr("FAINT_STROKE") = brushgs::kFaintStroke;
    m.attr("MOST_COPIES") = brushgs::kMostCopies;
    m.def("spread_weights", &spread_weights, "weights"_a.noconvert(), "places"_a.noconvert(), "num_threads"_a,
          "The weights [N] times factors that vary along the curve of places [N, 3], see prune.hpp.");
    m.def("count_spare", &count_spare, "weights"_a.noconvert(), "ranked"_a.noconvert(), "num_threads"_a,
          "How many rows of the lowest rank hold at most 5 % of the weights, see prune.hpp.");
    m.def("mark_highest", &mark_highest, "weights"_a.noconvert(), "num_kept"_a, "is_kept"_a.noconvert(),
          "Write a mask [N] uint8 of the highest weights [N], ties by row.");
}
