// Python: Gaussians to boxes, and boxes to a frame or its fragments.
#include <algorithm>
#include <tuple>

#include "bindings.hpp"
#include "brushgs/fragment_layers.hpp"
#include "brushgs/fragments.hpp"
#include "brushgs/painted_sums.hpp"
#include "brushgs/project.hpp"
#include "brushgs/project_backward.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/stroke_levels.hpp"
#include "brushgs/trace.hpp"
#include "brushgs/track.hpp"

namespace bindings {

namespace {

// Views

void def_view(nb::module_& m) {
    const auto make = [](brushgs::View* self, In<double, 2> viewmat, In<double, 2> K, int width, int height,
                         double near) {
        auto* view = new (self) brushgs::View{.viewmat = {},
                                              .fx = K(0, 0),
                                              .fy = K(1, 1),
                                              .cx = K(0, 2),
                                              .cy = K(1, 2),
                                              .width = static_cast<double>(width),
                                              .height = static_cast<double>(height),
                                              .near = near};
        std::copy_n(viewmat.data(), 12, view->viewmat);
    };
    nb::class_<brushgs::View>(m, "View", "One pinhole camera; fields as in brushgs.Camera.")
        .def("__init__", make, nb::kw_only(), "viewmat"_a.noconvert(), "K"_a.noconvert(), "width"_a, "height"_a,
             "near"_a);
}

// Projection

template <class T>
brushgs::GaussianColumns<T> columns_of(const In<T, 2>& means, const In<T, 2>& quats, const In<T, 2>& scales,
                                       const In<T, 1>& opacities, const std::optional<In<T, 3>>& sh) {
    return {.means = means.data(),
            .quats = quats.data(),
            .scales = scales.data(),
            .opacities = opacities.data(),
            .sh = data_or_null(sh),
            .count = means.shape(0),
            .sh_terms = sh ? sh->shape(1) : 0};
}

template <class T>
nb::tuple project(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                  const brushgs::View& view, double num_sigmas, std::optional<In<double, 1>> sigmas_of_row,
                  double low_pass, brushgs::Lock lock, std::optional<In<float, 1>> directions,
                  std::optional<In<float, 1>> area_scales, bool antialiased, bool fades, int sh_degree,
                  bool with_setbacks, double softness, int num_threads) {
    const auto gaussians = columns_of<T>(means, quats, scales, opacities, sh);
    const brushgs::ProjectParams params{.view = view,
                                        .num_sigmas = num_sigmas,
                                        .sigmas_of_row = data_or_null(sigmas_of_row),
                                        .low_pass = low_pass,
                                        .sh_degree = sh_degree,
                                        .num_threads = num_threads,
                                        .lock = lock,
                                        .directions = data_or_null(directions),
                                        .area_scales = data_or_null(area_scales),
                                        .antialiased = antialiased,
                                        .fades = fades,
                                        .with_setbacks = with_setbacks,
                                        .softness = softness};
    brushgs::BoxColumns<T> boxes;
    {
        const nb::gil_scoped_release without_gil;
        boxes = brushgs::project(gaussians, params);
    }
    const std::size_t count = boxes.count;
    const nb::capsule owner(boxes.memory.release(), [](void* memory) noexcept { brushgs::Free{}(memory); });
    nb::dict columns, culled;
    columns["centers"] = column(boxes.centers, count, 2, owner);
    columns["half_extents"] = column(boxes.half_extents, count, 2, owner);
    columns["angles"] = column(boxes.angles, count, 0, owner);
    columns["depths"] = column(boxes.depths, count, 0, owner);
    columns["colors"] = column(boxes.colors, count, 3, owner);
    columns["opacities"] = column(boxes.opacities, count, 0, owner);
    columns["ids"] = column(boxes.ids, count, 0, owner);
    if (boxes.softness != nullptr) columns["softness"] = column(boxes.softness, count, 0, owner);
    if (boxes.setbacks != nullptr) columns["setbacks"] = column(boxes.setbacks, count, 0, owner);
    culled["behind_near"] = boxes.culled.behind_near;
    culled["not_finite"] = boxes.culled.not_finite;
    culled["faint"] = boxes.culled.faint;
    culled["outside"] = boxes.culled.outside;
    return nb::make_tuple(columns, culled);
}

template <class T>
void def_project(nb::module_& m) {
    m.def("project", &project<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(), "scales"_a.noconvert(),
          "opacities"_a.noconvert(), "sh"_a.noconvert(), "view"_a, "num_sigmas"_a, "sigmas_of_row"_a.noconvert().none(),
          "low_pass"_a, "lock"_a, "directions"_a.noconvert().none(), "area_scales"_a.noconvert().none(),
          "antialiased"_a, "fades"_a, "sh_degree"_a, "with_setbacks"_a, "softness"_a, "num_threads"_a,
          "The columns of the boxes, nearest first, and how many Gaussians have none for each reason, both by name.");
}

template <class T>
void project_backward(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                      const brushgs::View& view, double num_sigmas, std::optional<In<double, 1>> sigmas_of_row,
                      double low_pass, brushgs::Lock lock, std::optional<In<float, 1>> directions,
                      std::optional<In<float, 1>> area_scales, bool antialiased, bool fades, int num_threads,
                      In<std::int32_t, 1> ids, In<T, 2> colors, std::optional<In<T, 2>> v_box_centers,
                      std::optional<In<T, 2>> v_box_half_extents, std::optional<In<T, 1>> v_box_angles,
                      std::optional<In<T, 1>> v_box_depths, std::optional<In<T, 2>> v_box_colors,
                      std::optional<In<T, 1>> v_box_opacities, std::optional<Out<T, 2>> v_means,
                      std::optional<Out<T, 2>> v_quats, std::optional<Out<T, 2>> v_scales,
                      std::optional<Out<T, 1>> v_opacities, std::optional<Out<T, 3>> v_sh) {
    const auto gaussians = columns_of<T>(means, quats, scales, opacities, sh);
    const std::size_t terms = gaussians.sh_terms;
    const brushgs::ProjectParams params{.view = view,
                                        .num_sigmas = num_sigmas,
                                        .sigmas_of_row = data_or_null(sigmas_of_row),
                                        .low_pass = low_pass,
                                        .sh_degree = terms == 1 ? 0 : (terms == 4 ? 1 : (terms == 9 ? 2 : 3)),
                                        .num_threads = num_threads,
                                        .lock = lock,
                                        .directions = data_or_null(directions),
                                        .area_scales = data_or_null(area_scales),
                                        .antialiased = antialiased,
                                        .fades = fades,
                                        .with_setbacks = false,
                                        .softness = 0};
    const brushgs::ProjectedBoxes<T> boxes{.count = ids.shape(0),
                                           .ids = ids.data(),
                                           .colors = colors.data(),
                                           .v_centers = data_or_null(v_box_centers),
                                           .v_half_extents = data_or_null(v_box_half_extents),
                                           .v_angles = data_or_null(v_box_angles),
                                           .v_depths = data_or_null(v_box_depths),
                                           .v_colors = data_or_null(v_box_colors),
                                           .v_opacities = data_or_null(v_box_opacities)};
    const brushgs::GaussianGradients<T> gradients{.means = data_or_null(v_means),
                                                  .quats = data_or_null(v_quats),
                                                  .scales = data_or_null(v_scales),
                                                  .opacities = data_or_null(v_opacities),
                                                  .sh = data_or_null(v_sh)};
    const nb::gil_scoped_release without_gil;
    brushgs::project_backward(gaussians, params, boxes, gradients);
}

template <class T>
void def_project_backward(nb::module_& m) {
    m.def("project_backward", &project_backward<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "view"_a, "num_sigmas"_a,
          "sigmas_of_row"_a.noconvert().none(), "low_pass"_a, "lock"_a, "directions"_a.noconvert().none(),
          "area_scales"_a.noconvert().none(), "antialiased"_a, "fades"_a, "num_threads"_a, "ids"_a.noconvert(),
          "colors"_a.noconvert(), "v_box_centers"_a.noconvert().none(), "v_box_half_extents"_a.noconvert().none(),
          "v_box_angles"_a.noconvert().none(), "v_box_depths"_a.noconvert().none(), "v_box_colors"_a.noconvert().none(),
          "v_box_opacities"_a.noconvert().none(), "v_means"_a.noconvert().none(), "v_quats"_a.noconvert().none(),
          "v_scales"_a.noconvert().none(), "v_opacities"_a.noconvert().none(), "v_sh"_a.noconvert().none(),
          "From the gradients v_box_* of a loss by the boxes write those by the Gaussians, v_*, where they are given; "
          "rows without a box stay as they are. ids and colors as `project` made them.");
}

template <class T>
nb::tuple track_directions(AnyIn<T> means, AnyIn<T> quats, AnyIn<T> scales, AnyIn<T> opacities,
                           std::optional<In<float, 2>> carried, std::optional<In<std::uint8_t, 2>> jumps,
                           std::optional<In<std::int16_t, 2>> targets, std::optional<In<std::uint8_t, 2>> pulls,
                           const std::vector<brushgs::View>& views, bool is_closed, bool is_coarse, double step,
                           double most_turn, double growth, double low_pass, int num_threads) {
    const bool is_moving = opacities.ndim() == 2;
    const std::size_t count = opacities.shape(is_moving ? 1 : 0);
    const brushgs::GaussianColumns<T> gaussians{.means = means.data(),
                                                .quats = quats.data(),
                                                .scales = scales.data(),
                                                .opacities = opacities.data(),
                                                .sh = nullptr,
                                                .count = count,
                                                .sh_terms = 0};
    brushgs::Tracks tracks;
    {
        const nb::gil_scoped_release without_gil;
        tracks = brushgs::track_directions(gaussians, {.views = views.data(),
                                                       .num_views = views.size(),
                                                       .is_closed = is_closed,
                                                       .is_coarse = is_coarse,
                                                       .step = step,
                                                       .most_turn = most_turn,
                                                       .growth = growth,
                                                       .low_pass = low_pass,
                                                       .rows_per_view = is_moving ? count : 0,
                                                       .carried = data_or_null(carried),
                                                       .jumps = data_or_null(jumps),
                                                       .targets = data_or_null(targets),
                                                       .pulls = data_or_null(pulls),
                                                       .num_threads = num_threads});
    }
    nb::object turns = table(tracks.turns, views.size(), gaussians.count);
    if (!tracks.has_area_scales) return nb::make_tuple(turns, nb::none());
    return nb::make_tuple(turns, table(tracks.area_scales, views.size(), gaussians.count));
}

template <class T>
void def_track_directions(nb::module_& m) {
    m.def("track_directions", &track_directions<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "carried"_a.noconvert().none(),
          "jumps"_a.noconvert().none(), "targets"_a.noconvert().none(), "pulls"_a.noconvert().none(), "views"_a,
          "is_closed"_a, "is_coarse"_a, "step"_a, "most_turn"_a, "growth"_a, "low_pass"_a, "num_threads"_a,
          "Directions [views, N] in 2^-16 turns; and the least area of each box [views, N], in areas of the smallest "
          "box around its ellipse, as octaves times AREA_SCALE_STEPS, or None where none is above 1. The columns have "
          "N rows, or are [views, N, ...] where Gaussians move. carried [views, N]: radians, -pi to pi, to which "
          "directions are relative; jumps [views, N]: not 0 where a stroke may spin at a price; targets [views, N]: "
          "where "
          "strokes should point, in the same turns, and pulls [views, N]: how strongly, of 255.");
}

// Rasterization

// The filtered copies of a stroke image for a set of boxes; keeps their memory.
struct Levels {
    std::vector<In<std::uint16_t, 1>> arrays;
    std::vector<In<std::uint32_t, 1>> arrays_with_height;
    std::vector<brushgs::Level> levels;
    In<std::uint16_t, 1> of_box;
    std::vector<std::optional<In<std::uint32_t, 1>>> tints = {};
};

void def_levels(nb::module_& m) {
    const auto make = [](Levels* self, const std::vector<In<std::uint16_t, 1>>& pairs, In<std::int32_t, 2> sizes,
                         In<double, 2> reaches, In<std::uint16_t, 1> of_box,
                         const std::vector<In<std::uint32_t, 1>>& pairs_with_height,
                         const std::vector<std::optional<In<std::uint32_t, 1>>>& tints, In<double, 1> tint_steps) {
        auto* levels = new (self) Levels{pairs, pairs_with_height, {}, of_box, tints};
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const bool has_tints = !tints.empty() && tints[i];
            levels->levels.push_back({pairs[i].data(), sizes(i, 0), sizes(i, 1), reaches(i, 0), reaches(i, 1),
                                      pairs_with_height.empty() ? nullptr : pairs_with_height[i].data(),
                                      has_tints ? tints[i]->data() : nullptr, has_tints ? tint_steps(i) : 0});
        }
    };
    nb::class_<Levels>(m, "Levels", "The L filtered copies of a stroke image that a set of M boxes is painted with.")
        .def("__init__", make, nb::kw_only(), "pairs"_a.noconvert(), "sizes"_a.noconvert(), "reaches"_a.noconvert(),
             "of_box"_a.noconvert(), "pairs_with_height"_a.noconvert(), "tints"_a.noconvert(),
             "tint_steps"_a.noconvert(),
             "pairs: L arrays of texels, each [rows * columns + 1], see raster.hpp; sizes: [L, 2] columns and rows; "
             "reaches: [L, 2] half extents along u and v in those of the box; of_box: [M] row of these, or [0] where "
             "all boxes use the first; pairs_with_height: L, or none where pictures have no height; tints: L arrays or "
             "None, each [(rows + 1) * columns + 1], or none where no brush is colored; tint_steps: [L] or [0].");
}

template <class T, class Array>
brushgs::Channels<T> channels_of(const std::vector<Array>& arrays, std::size_t leading_dimensions) {
    brushgs::Channels<T> all{};
    for (const Array& array : arrays) {
        const std::size_t width = array.ndim() > leading_dimensions ? array.shape(leading_dimensions) : 1;
        for (std::size_t c = 0; c < width; ++c) {
            if (all.count == brushgs::kMostChannels) throw nb::value_error("more layers than the core has room for");
            all.channels[all.count++] = {array.data() + c, width};
        }
    }
    return all;
}

// M boxes in the form of the kernels; keeps their memory.
template <class T>
struct BoxArrays {
    brushgs::BoxView<T> view;
    std::vector<nb::ndarray<>> memory;
};

template <class T>
void def_box_arrays(nb::module_& m) {
    const auto make = [](BoxArrays<T>* self, In<T, 2> centers, In<T, 2> half_extents, In<T, 1> angles, In<T, 2> colors,
                         In<T, 1> opacities, In<T, 1> depths, const std::vector<AnyIn<T>>& attributes,
                         std::optional<In<T, 1>> softness, std::optional<In<T, 1>> setbacks, double underpaint_reach,
                         std::optional<In<double, 1>> underpaint_reaches, double underpaint_opacity,
                         std::optional<In<std::uint16_t, 1>> streak_noise,
                         std::optional<In<std::uint8_t, 1>> streak_starts, std::optional<In<T, 2>> streak_weights,
                         std::optional<In<T, 2>> streak_slopes, std::optional<In<T, 2>> streak_fine,
                         std::optional<In<T, 2>> reliefs, std::optional<In<T, 2>> limits,
                         std::optional<In<T, 2>> fades) {
        auto* boxes = new (self) BoxArrays<T>{.view = {.count = centers.shape(0),
                                                       .centers = centers.data(),
                                                       .half_extents = half_extents.data(),
                                                       .angles = angles.data(),
                                                       .colors = colors.data(),
                                                       .opacities = opacities.data(),
                                                       .layers = channels_of<const T>(attributes, 1),
                                                       .depths = depths.data(),
                                                       .softness = data_or_null(softness),
                                                       .underpaint = {.setbacks = data_or_null(setbacks),
                                                                      .reach = underpaint_reach,
                                                                      .reaches = data_or_null(underpaint_reaches),
                                                                      .opacity = underpaint_opacity},
                                                       .streaks = {.noise = data_or_null(streak_noise),
                                                                   .starts = data_or_null(streak_starts),
                                                                   .weights = data_or_null(streak_weights),
                                                                   .slopes = data_or_null(streak_slopes),
                                                                   .fine = data_or_null(streak_fine)},
                                                       .reliefs = data_or_null(reliefs),
                                                       .limits = data_or_null(limits),
                                                       .fades = data_or_null(fades)},
                                              .memory = {}};
        const auto keep = [boxes](const auto&... arrays) { (boxes->memory.emplace_back(arrays), ...); };
        const auto keep_given = [&](const auto&... arrays) { ((arrays ? keep(*arrays) : void()), ...); };
        keep(centers, half_extents, angles, colors, opacities, depths);
        for (const auto& attribute : attributes) keep(attribute);
        keep_given(softness, setbacks, underpaint_reaches, streak_noise, streak_starts, streak_weights, streak_slopes,
                   streak_fine, reliefs, limits, fades);
    };
    const nb::object none = nb::none();
    nb::class_<BoxArrays<T>>(m, sizeof(T) == 4 ? "BoxArraysFloat32" : "BoxArraysFloat64",
                             "M boxes, and what they are painted with; columns as in brushgs.Boxes.")
        .def("__init__", make, nb::kw_only(), "centers"_a.noconvert(), "half_extents"_a.noconvert(),
             "angles"_a.noconvert(), "colors"_a.noconvert(), "opacities"_a.noconvert(), "depths"_a.noconvert(),
             "attributes"_a.noconvert() = nb::list(), "softness"_a.noconvert() = none, "setbacks"_a.noconvert() = none,
             "underpaint_reach"_a = 0.0, "underpaint_reaches"_a.noconvert() = none, "underpaint_opacity"_a = 0.0,
             "streak_noise"_a.noconvert() = none, "streak_starts"_a.noconvert() = none,
             "streak_weights"_a.noconvert() = none, "streak_slopes"_a.noconvert() = none,
             "streak_fine"_a.noconvert() = none, "reliefs"_a.noconvert() = none, "limits"_a.noconvert() = none,
             "fades"_a.noconvert() = none,
             "attributes, [M] or [M, channels] each, are what the layers of a picture are means of. With softness the "
             "order is soft; with setbacks, of stroke images only, boxes have underpaint; with noise, which goes with "
             "starts and weights, strokes have streaks, whose derivative needs slopes. With limits, which goes with "
             "fades, boxes fade out behind them; see raster.hpp. Colors of glazes are logarithms.");
}

brushgs::RasterParams raster_params(brushgs::Kernel kernel, const Levels& levels, std::size_t height, std::size_t width,
                                    double min_transmittance, int num_threads) {
    return {.kernel = kernel,
            .width = static_cast<int>(width),
            .height = static_cast<int>(height),
            .num_threads = num_threads,
            .min_transmittance = min_transmittance,
            .levels = levels.levels,
            .level_of_box = {levels.of_box.data(), levels.of_box.size()},
            .has_tints = !levels.tints.empty()};
}

template <class T>
void rasterize(brushgs::Kernel kernel, const Levels& levels, double min_transmittance, int num_threads,
               const BoxArrays<T>& boxes, Out<T, 3> rgb, Out<T, 2> alpha, const std::vector<AnyOut<T>>& layers,
               std::optional<Out<T, 2>> height_plane, brushgs::Blend blend, std::optional<double> hidden,
               brushgs::Trace<T>* trace, std::pair<std::size_t, std::size_t> size, std::pair<int, int> corner) {
    auto params = raster_params(kernel, levels, size.first, size.second, min_transmittance, num_threads);
    params.blend = blend;
    std::tie(params.top, params.left) = corner;
    params.part_height = static_cast<int>(rgb.shape(0));
    params.part_width = static_cast<int>(rgb.shape(1));
    const brushgs::Picture<T> picture{.rgb = rgb.data(),
                                      .alpha = alpha.data(),
                                      .layers = channels_of<T>(layers, 2),
                                      .height = data_or_null(height_plane),
                                      .lays = hidden.has_value(),
                                      .hidden = static_cast<T>(hidden.value_or(1))};
    const nb::gil_scoped_release without_gil;
    brushgs::rasterize(params, boxes.view, picture, trace);
}

template <class T>
auto choose_levels(In<T, 2> half_extents, In<double, 1> bounds_u, In<double, 1> bounds_v) {
    brushgs::LevelChoice choice;
    {
        const nb::gil_scoped_release without_gil;
        choice = brushgs::choose_levels(half_extents.shape(0), half_extents.data(), {bounds_u.data(), bounds_u.size()},
                                        {bounds_v.data(), bounds_v.size()});
    }
    return std::pair(to_array(std::move(choice.used)), to_array(std::move(choice.of_box)));
}

template <class T>
void def_rasterize(nb::module_& m) {
    nb::class_<brushgs::Trace<T>>(m, sizeof(T) == 4 ? "TraceFloat32" : "TraceFloat64",
                                  "What painting found out and its derivative needs again; see trace.hpp.")
        .def(nb::init<>());
    m.def("rasterize", &rasterize<T>, nb::kw_only(), "kernel"_a, "levels"_a, "min_transmittance"_a, "num_threads"_a,
          "boxes"_a, "rgb"_a.noconvert(), "alpha"_a.noconvert(), "layers"_a.noconvert(),
          "height_plane"_a.noconvert().none(), "blend"_a, "hidden"_a.none(), "trace"_a.none(), "size"_a, "corner"_a,
          "Paint boxes into rgb, alpha and for each attribute of the boxes a layer [H, W] or [H, W, channels]. The "
          "plane of the height goes with reliefs and, of stroke images, with levels that have pairs with height. "
          "Glazes have neither these nor softness, underpaint and streaks: rgb is their tint. With a trace, which goes "
          "with none of softness, glaze and limits, what the derivative needs is kept there. With hidden, which does "
          "not go with glaze and trace, the strokes are "
          "laid over what the planes hold, and hide this share of its height. The planes hold a part of a "
          "picture of a size (height, width), from its corner (row, column) on, which begins a tile; its sides end "
          "a tile or the picture. With a trace they hold all of it.");
    m.def("choose_levels", &choose_levels<T>, nb::kw_only(), "half_extents"_a.noconvert(), "bounds_u"_a.noconvert(),
          "bounds_v"_a.noconvert(),
          "For boxes of half extents [M, 2] the level codes in use, level_u * (len(bounds_v) + 1) + level_v, and "
          "for each box its row among them.");
}

template <class T>
void rasterize_backward(brushgs::Kernel kernel, const Levels& levels, double min_transmittance, int num_threads,
                        const BoxArrays<T>& boxes, const brushgs::Trace<T>* trace, In<T, 3> rgb, In<T, 2> alpha,
                        const std::vector<AnyIn<T>>& layers, In<T, 3> v_rgb, std::optional<In<T, 2>> v_alpha,
                        const std::vector<AnyIn<T>>& v_layers, Out<T, 2> v_centers, Out<T, 2> v_half_extents,
                        Out<T, 1> v_angles, Out<T, 2> v_colors, Out<T, 1> v_opacities,
                        const std::vector<AnyOut<T>>& v_attributes, const std::vector<Out<double, 2>>& v_texels) {
    const auto params = raster_params(kernel, levels, rgb.shape(0), rgb.shape(1), min_transmittance, num_threads);
    const brushgs::PictureGradients<T> picture{.rgb = rgb.data(),
                                               .alpha = alpha.data(),
                                               .layers = channels_of<const T>(layers, 2),
                                               .v_rgb = v_rgb.data(),
                                               .v_alpha = data_or_null(v_alpha),
                                               .v_layers = channels_of<const T>(v_layers, 2)};
    const brushgs::BoxGradients<T> gradients{.centers = v_centers.data(),
                                             .half_extents = v_half_extents.data(),
                                             .angles = v_angles.data(),
                                             .colors = v_colors.data(),
                                             .opacities = v_opacities.data(),
                                             .layers = channels_of<T>(v_attributes, 1)};
    // Reading beyond the memory of another trace would crash.
    if (trace != nullptr && !is_of(*trace, boxes.view, params.width, params.height))
        throw nb::value_error("rasterize_backward: trace must be of painting these boxes, got another");
    std::vector<double*> texels;
    for (const auto& of_level : v_texels) texels.push_back(of_level.data());
    const nb::gil_scoped_release without_gil;
    brushgs::rasterize_backward(params, boxes.view, trace, picture, gradients, texels);
}

template <class T>
void def_rasterize_backward(nb::module_& m) {
    m.def("rasterize_backward", &rasterize_backward<T>, nb::kw_only(), "kernel"_a, "levels"_a, "min_transmittance"_a,
          "num_threads"_a, "boxes"_a, "trace"_a.none(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "layers"_a.noconvert(), "v_rgb"_a.noconvert(), "v_alpha"_a.noconvert().none(), "v_layers"_a.noconvert(),
          "v_centers"_a.noconvert(), "v_half_extents"_a.noconvert(), "v_angles"_a.noconvert(), "v_colors"_a.noconvert(),
          "v_opacities"_a.noconvert(), "v_attributes"_a.noconvert(), "v_texels"_a.noconvert(),
          "From the gradients of a loss by the picture, v_rgb, v_alpha and v_layers, write those by the boxes, and add "
          "those by the texels of each level to v_texels, which may be empty. attributes, layers and their gradients "
          "are as many. A trace is that of painting the same boxes alike.");
}

template <class T>
void sum_painted(brushgs::Kernel kernel, double min_transmittance, int num_threads, const BoxArrays<T>& boxes,
                 std::optional<In<T, 3>> values, In<T, 2> shares, std::optional<Out<T, 2>> value_sums,
                 Out<T, 1> share_sums) {
    const brushgs::RasterParams params{.kernel = kernel,
                                       .width = static_cast<int>(shares.shape(1)),
                                       .height = static_cast<int>(shares.shape(0)),
                                       .num_threads = num_threads,
                                       .min_transmittance = min_transmittance,
                                       .levels = {},
                                       .level_of_box = {}};
    const brushgs::PixelValues<T> pixels{data_or_null(values), shares.data()};
    const brushgs::PaintedSums<T> sums{data_or_null(value_sums), share_sums.data()};
    const nb::gil_scoped_release without_gil;
    brushgs::sum_painted(params, boxes.view, pixels, sums);
}

template <class T>
void def_sum_painted(nb::module_& m) {
    m.def("sum_painted", &sum_painted<T>, nb::kw_only(), "kernel"_a, "min_transmittance"_a, "num_threads"_a, "boxes"_a,
          "values"_a.noconvert().none(), "shares"_a.noconvert(), "value_sums"_a.noconvert().none(),
          "share_sums"_a.noconvert(),
          "Write for each of M boxes of an analytic kernel the sums over pixels of weight x values [H, W, 3], to "
          "value_sums [M, 3], and of weight x shares [H, W], to share_sums [M]. values and value_sums go together.");
}

// Fragments

template <class T>
nb::tuple fragments(brushgs::Kernel kernel, const Levels& levels, double min_transmittance, int num_threads,
                    const BoxArrays<T>& boxes, std::size_t height, std::size_t width, int first_row, int end_row) {
    auto params = raster_params(kernel, levels, height, width, min_transmittance, num_threads);
    params.first_row = first_row;
    params.end_row = end_row;
    brushgs::Fragments<T> found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_fragments(params, boxes.view);
    }
    return nb::make_tuple(row(found.starts, found.num_pixels + 1), row(found.rows, found.count),
                          row(found.weights, found.count), row(found.shades, found.count),
                          row(found.is_underpaint, found.count));
}

template <class T>
brushgs::FragmentView<T> view_of(const In<std::int64_t, 1>& starts, const In<std::int32_t, 1>& marks,
                                 const In<T, 1>& weights) {
    return {starts.data(), marks.data(), weights.data(), nullptr, nullptr, starts.size() - 1};
}

template <class T>
void sum_fragments(In<std::int64_t, 1> starts, In<std::int32_t, 1> marks, In<T, 1> weights, In<T, 2> values,
                   Out<T, 2> sums, int num_threads) {
    const auto view = view_of<T>(starts, marks, weights);
    const nb::gil_scoped_release without_gil;
    brushgs::sum_fragments(view, values.data(), values.shape(1), num_threads, sums.data());
}

template <class T>
nb::tuple share_fragments(In<std::int64_t, 1> starts, In<std::int32_t, 1> marks, In<T, 1> weights,
                          In<std::int32_t, 1> keys, double least, int num_threads) {
    const auto view = view_of<T>(starts, marks, weights);
    brushgs::Shares<T> shares;
    {
        const nb::gil_scoped_release without_gil;
        shares = brushgs::share_fragments(view, keys.data(), static_cast<T>(least), num_threads);
    }
    return nb::make_tuple(row(shares.starts, shares.num_pixels + 1), row(shares.keys, shares.count),
                          row(shares.weights, shares.count));
}

template <class T>
void make_samples(In<std::int64_t, 1> starts, In<std::int32_t, 1> marks, In<T, 1> weights, In<T, 1> shades,
                  In<std::uint8_t, 1> is_underpaint, In<T, 2> colors, In<T, 1> depths, In<T, 1> setbacks,
                  In<std::uint32_t, 1> ids, In<std::uint8_t, 1> coats,
                  const std::vector<std::optional<In<T, 2>>>& tints, std::optional<In<T, 2>> rest_rgb,
                  std::optional<In<T, 1>> rest_alpha, double rest_depth, std::optional<In<T, 1>> factors,
                  std::optional<In<T, 1>> shines, In<std::int64_t, 1> sample_starts, Out<float, 2> sample_colors,
                  Out<float, 1> sample_alphas, Out<float, 1> sample_depths, Out<std::uint32_t, 1> sample_ids,
                  int num_threads) {
    auto view = view_of<T>(starts, marks, weights);
    view.shades = shades.data();
    view.is_underpaint = is_underpaint.data();
    brushgs::MarkView<T> of_marks{colors.data(), depths.data(), setbacks.data(), ids.data(), coats.data(), {}};
    for (const auto& tint : tints) of_marks.tints.push_back(data_or_null(tint));
    const brushgs::Setting<T> setting{data_or_null(rest_rgb), data_or_null(rest_alpha), static_cast<T>(rest_depth),
                                      data_or_null(factors), data_or_null(shines)};
    const brushgs::SamplesOut out{sample_starts.data(), sample_colors.data(), sample_alphas.data(),
                                  sample_depths.data(), sample_ids.data()};
    const nb::gil_scoped_release without_gil;
    brushgs::make_samples(view, of_marks, setting, num_threads, out);
}

template <class T>
void def_fragments(nb::module_& m) {
    m.def("fragments", &fragments<T>, nb::kw_only(), "kernel"_a, "levels"_a, "min_transmittance"_a, "num_threads"_a,
          "boxes"_a, "height"_a, "width"_a, "first_row"_a, "end_row"_a,
          "Of boxes painted as `rasterize` paints them, what the rows first_row to end_row - 1 are made of: starts "
          "[pixels + 1], and for each fragment, nearest first in each pixel, its box, its weight, its shade and "
          "whether it is underpaint. first_row is a multiple of TILE_HEIGHT. See fragments.hpp.");
    m.def("sum_fragments", &sum_fragments<T>, nb::kw_only(), "starts"_a.noconvert(), "marks"_a.noconvert(),
          "weights"_a.noconvert(), "values"_a.noconvert(), "sums"_a.noconvert(), "num_threads"_a,
          "Write to sums [pixels, channels] those of weight x values [marks, channels]. See fragment_layers.hpp.");
    m.def("share_fragments", &share_fragments<T>, nb::kw_only(), "starts"_a.noconvert(), "marks"_a.noconvert(),
          "weights"_a.noconvert(), "keys"_a.noconvert(), "least"_a, "num_threads"_a,
          "The sums of weights in each pixel by the keys [marks], largest first, as starts [pixels + 1], keys and "
          "sums; less than `least` of a pixel is left out. See fragment_layers.hpp.");
    m.def("make_samples", &make_samples<T>, nb::kw_only(), "starts"_a.noconvert(), "marks"_a.noconvert(),
          "weights"_a.noconvert(), "shades"_a.noconvert(), "is_underpaint"_a.noconvert(), "colors"_a.noconvert(),
          "depths"_a.noconvert(), "setbacks"_a.noconvert(), "ids"_a.noconvert(), "coats"_a.noconvert(), "tints"_a,
          "rest_rgb"_a.noconvert().none(), "rest_alpha"_a.noconvert().none(), "rest_depth"_a,
          "factors"_a.noconvert().none(), "shines"_a.noconvert().none(), "sample_starts"_a.noconvert(),
          "sample_colors"_a.noconvert(), "sample_alphas"_a.noconvert(), "sample_depths"_a.noconvert(),
          "sample_ids"_a.noconvert(), "num_threads"_a,
          "Write a sample for each fragment, and one for the rest behind them. See fragment_layers.hpp.");
}

}  // namespace

void bind_boxes(nb::module_& m) {
    def_view(m);
    def_project<float>(m);
    def_project<double>(m);
    def_project_backward<float>(m);
    def_project_backward<double>(m);
    def_track_directions<float>(m);
    def_track_directions<double>(m);
    def_levels(m);
    def_box_arrays<float>(m);
    def_box_arrays<double>(m);
    def_rasterize<float>(m);
    def_rasterize<double>(m);
    def_rasterize_backward<float>(m);
    def_rasterize_backward<double>(m);
    def_sum_painted<float>(m);
    def_sum_painted<double>(m);
    def_fragments<float>(m);
    def_fragments<double>(m);
}

}  // namespace bindings
