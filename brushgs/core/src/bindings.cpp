// The only file that knows Python: it translates arrays to spans and back, and releases the GIL.
//
// Arguments that could be confused are passed by name. Shapes are trusted: the functions of the package check them
// first. Arrays are not converted: an output of another dtype would be replaced by a copy and lost.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "brushgs/blending.hpp"
#include "brushgs/coats.hpp"
#include "brushgs/components.hpp"
#include "brushgs/coverage.hpp"
#include "brushgs/cpu.hpp"
#include "brushgs/extent.hpp"
#include "brushgs/features.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/fragment_layers.hpp"
#include "brushgs/fragments.hpp"
#include "brushgs/frame_pool.hpp"
#include "brushgs/gaps.hpp"
#include "brushgs/groups.hpp"
#include "brushgs/halves.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/light.hpp"
#include "brushgs/light_along.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/merge.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/oklab.hpp"
#include "brushgs/painted_sums.hpp"
#include "brushgs/photometric.hpp"
#include "brushgs/press.hpp"
#include "brushgs/project.hpp"
#include "brushgs/project_backward.hpp"
#include "brushgs/prune.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/streamlines.hpp"
#include "brushgs/stroke_levels.hpp"
#include "brushgs/trace.hpp"
#include "brushgs/track.hpp"
#include "brushgs/visible_shares.hpp"
#include "brushgs/wet.hpp"

namespace nb = nanobind;
using namespace nb::literals;

#if defined(__clang__)
#define BRUSHGS_COMPILER "Clang " __clang_version__
#else
#define BRUSHGS_COMPILER "GCC " __VERSION__
#endif

namespace {

// A C-contiguous array that is read, or written. Without a rank: an attribute [rows] or [rows, channels], or a layer.
template <class T, std::size_t rank>
using In = nb::ndarray<const T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;
template <class T, std::size_t rank>
using Out = nb::ndarray<T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;
template <class T>
using AnyIn = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
template <class T>
using AnyOut = nb::ndarray<T, nb::c_contig, nb::device::cpu>;

template <class Array>
auto data_or_null(const std::optional<Array>& array) {
    return array ? array->data() : nullptr;
}

// A column of shape [rows, width], or [rows] if width is 0, in memory that lives as long as `owner`.
template <class T>
nb::object column(T* values, std::size_t rows, std::size_t width, const nb::capsule& owner) {
    const std::size_t shape[2] = {rows, width};
    return nb::cast(nb::ndarray<nb::numpy, T>(values, width == 0 ? 1 : 2, shape, owner));
}

// An array of shape [rows, width] that takes over its memory.
template <class T>
nb::object table(brushgs::Buffer<T>& memory, std::size_t rows, std::size_t width) {
    T* values = memory.release();
    const nb::capsule owner(values, [](void* p) noexcept { brushgs::Free{}(p); });
    const std::size_t shape[2] = {rows, width};
    return nb::cast(nb::ndarray<nb::numpy, T>(values, 2, shape, owner));
}

// An array of shape [count, 3, 3] that takes over its memory.
nb::object matrices(brushgs::Buffer<double>& memory, std::size_t count) {
    double* values = memory.release();
    const nb::capsule owner(values, [](void* p) noexcept { brushgs::Free{}(p); });
    const std::size_t shape[3] = {count, 3, 3};
    return nb::cast(nb::ndarray<nb::numpy, double>(values, 3, shape, owner));
}

// An array of shape [count] that takes over its memory.
template <class T>
nb::object row(brushgs::Buffer<T>& memory, std::size_t count) {
    T* values = memory.release();
    return column(values, count, 0, nb::capsule(values, [](void* p) noexcept { brushgs::Free{}(p); }));
}

template <class T>
nb::object row(std::unique_ptr<T[]> memory, std::size_t count) {
    T* values = memory.release();
    const nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return column(values, count, 0, owner);
}

// A vector that becomes a NumPy array without a copy.
template <class T>
auto to_array(std::vector<T>&& values) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owned->data(), {owned->size()}, owner);
}

// An uninitialised array from the frame pool, to which its memory returns.
template <class T>
nb::ndarray<nb::numpy, T> new_plane(const std::vector<std::size_t>& shape) {
    struct Block {
        void* memory;
        std::size_t bytes;
    };
    std::size_t bytes = sizeof(T);
    for (const std::size_t side : shape) bytes *= side;
    auto* block = new Block{brushgs::FramePool::instance().take(bytes), bytes};
    const nb::capsule owner(block, [](void* p) noexcept {
        auto* done = static_cast<Block*>(p);
        brushgs::FramePool::instance().give_back(done->memory, done->bytes);
        delete done;
    });
    return {block->memory, shape.size(), shape.data(), owner};
}

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
               std::optional<Out<T, 2>> height_plane, brushgs::Blend blend, brushgs::Trace<T>* trace,
               std::pair<std::size_t, std::size_t> size, std::pair<int, int> corner) {
    auto params = raster_params(kernel, levels, size.first, size.second, min_transmittance, num_threads);
    params.blend = blend;
    std::tie(params.top, params.left) = corner;
    params.part_height = static_cast<int>(rgb.shape(0));
    params.part_width = static_cast<int>(rgb.shape(1));
    const brushgs::Picture<T> picture{.rgb = rgb.data(),
                                      .alpha = alpha.data(),
                                      .layers = channels_of<T>(layers, 2),
                                      .height = data_or_null(height_plane)};
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
    m.def(
        "rasterize", &rasterize<T>, nb::kw_only(), "kernel"_a, "levels"_a, "min_transmittance"_a, "num_threads"_a,
        "boxes"_a, "rgb"_a.noconvert(), "alpha"_a.noconvert(), "layers"_a.noconvert(),
        "height_plane"_a.noconvert().none(), "blend"_a, "trace"_a.none(), "size"_a, "corner"_a,
        "Paint boxes into rgb, alpha and for each attribute of the boxes a layer [H, W] or [H, W, channels]. The "
        "plane of the height goes with reliefs and, of stroke images, with levels that have pairs with height. "
        "Glazes have neither these nor softness, underpaint and streaks: rgb is their tint. With a trace, which goes "
        "with none of softness, glaze and limits, what the derivative needs is kept there. The planes hold a part of a "
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

template <class T>
void finish(In<T, 3> rgb, In<T, 2> alpha, AnyIn<T> background, int num_threads, Out<std::uint8_t, 3> bytes) {
    const nb::gil_scoped_release without_gil;
    brushgs::finish(rgb.data(), alpha.data(), background.data(), background.ndim() == 3, alpha.size(), num_threads,
                    bytes.data());
}

template <class T>
void def_finish(nb::module_& m) {
    m.def("finish", &finish<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "background"_a.noconvert(),
          "num_threads"_a, "bytes"_a.noconvert(),
          "Write a picture on a background, [3] or [H, W, 3], to bytes [H, W, 3].");
}

template <class T>
void press(In<T, 3> rgb, In<T, 2> alpha, In<T, 2> grain, double dry, double softness, Out<T, 3> pressed_rgb,
           Out<T, 2> pressed_alpha) {
    const nb::gil_scoped_release without_gil;
    brushgs::press<T>({.rgb = rgb.data(),
                       .alpha = alpha.data(),
                       .grain = grain.data(),
                       .dry = static_cast<T>(dry),
                       .softness = static_cast<T>(softness),
                       .num_pixels = alpha.size(),
                       .pressed_rgb = pressed_rgb.data(),
                       .pressed_alpha = pressed_alpha.data()});
}

template <class T>
void def_press(nb::module_& m) {
    m.def("press", &press<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "grain"_a.noconvert(), "dry"_a,
          "softness"_a, "pressed_rgb"_a.noconvert(), "pressed_alpha"_a.noconvert(),
          "Write the part of a picture that the grain of a paper takes, see brushgs/rendering/tooth.py.");
}

template <class T>
void lay_over(In<T, 3> rgb, In<T, 2> alpha, std::optional<In<T, 2>> depth, std::optional<In<T, 2>> height,
              Out<T, 3> below_rgb, Out<T, 2> below_alpha, std::optional<Out<T, 2>> below_depth,
              std::optional<Out<T, 2>> below_height, double hidden, int num_threads) {
    const bool has_depth = depth && below_depth, has_height = height && below_height;
    const brushgs::Layer<T> front{rgb.data(), alpha.data(), data_or_null(depth), data_or_null(height)};
    const brushgs::LayerOut<T> out{below_rgb.data(), below_alpha.data(), has_depth ? below_depth->data() : nullptr,
                                   has_height ? below_height->data() : nullptr};
    const nb::gil_scoped_release without_gil;
    brushgs::lay_over<T>(front, {out.rgb, out.alpha, out.depth, out.height}, static_cast<T>(hidden), alpha.size(),
                         num_threads, out);
}

template <class T>
void lay_on_ground(In<T, 3> rgb, In<T, 2> alpha, In<T, 3> ground, std::optional<In<T, 3>> tint, Out<T, 3> picture,
                   int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::lay_on_ground<T>(rgb.data(), alpha.data(), ground.data(), data_or_null(tint), alpha.size(), num_threads,
                              picture.data());
}

template <class T>
void raise_ground(In<T, 2> alpha, In<T, 2> ground, std::optional<In<T, 2>> paint, double hidden, Out<T, 2> height,
                  int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::raise_ground<T>(alpha.data(), ground.data(), data_or_null(paint), static_cast<T>(hidden), alpha.size(),
                             num_threads, height.data());
}

template <class T>
void def_coats(nb::module_& m) {
    m.def("lay_over", &lay_over<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "depth"_a.noconvert().none(), "height"_a.noconvert().none(), "below_rgb"_a.noconvert(),
          "below_alpha"_a.noconvert(), "below_depth"_a.noconvert().none(), "below_height"_a.noconvert().none(),
          "hidden"_a, "num_threads"_a,
          "Lay a frame over the one below, in place; depth and height only where both have them. See coats.hpp.");
    m.def("lay_on_ground", &lay_on_ground<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "ground"_a.noconvert(), "tint"_a.noconvert().none(), "picture"_a.noconvert(), "num_threads"_a,
          "Write the picture of a frame on its ground, which is seen through a tint. See coats.hpp.");
    m.def("raise_ground", &raise_ground<T>, nb::kw_only(), "alpha"_a.noconvert(), "ground"_a.noconvert(),
          "paint"_a.noconvert().none(), "hidden"_a, "height"_a.noconvert(), "num_threads"_a,
          "Write the height of a ground under paint, and of the paint. See coats.hpp.");
}

template <class T>
void light(In<T, 3> rgb, In<T, 2> height, std::optional<In<T, 2>> alpha, In<double, 1> blur, In<double, 1> lamp,
           In<double, 1> half_way, double strength, double gloss, int exponent, int num_threads, Out<T, 3> lit) {
    const brushgs::LightParams<T> params{.rgb = rgb.data(),
                                         .heights = height.data(),
                                         .alpha = data_or_null(alpha),
                                         .lit = lit.data(),
                                         .width = static_cast<int>(rgb.shape(1)),
                                         .height = static_cast<int>(rgb.shape(0)),
                                         .blur = {blur.data(), blur.size()},
                                         .lamp = {lamp(0), lamp(1)},
                                         .half_way = {half_way(0), half_way(1)},
                                         .strength = strength,
                                         .gloss = gloss,
                                         .exponent = exponent,
                                         .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::light(params);
}

template <class T>
void def_light(nb::module_& m) {
    m.def("light", &light<T>, nb::kw_only(), "rgb"_a.noconvert(), "height"_a.noconvert(), "alpha"_a.noconvert().none(),
          "blur"_a.noconvert(), "lamp"_a.noconvert(), "half_way"_a.noconvert(), "strength"_a, "gloss"_a, "exponent"_a,
          "num_threads"_a, "lit"_a.noconvert(),
          "Write a picture [H, W, 3] in the light that falls on its height [H, W], see light.hpp. blur: the weights of "
          "an odd number of pixels; lamp and half_way: x and y of these directions, over their z.");
}

template <class T>
void space_noise(In<T, 2> depth, In<double, 2> rays, In<double, 1> focus, double reach, double finest, int octaves,
                 std::uint32_t seed, int num_threads, Out<T, 3> noise) {
    brushgs::SpaceNoiseParams<T> params{};
    params.depth = depth.data();
    params.noise = noise.data();
    params.width = static_cast<int>(depth.shape(1));
    params.height = static_cast<int>(depth.shape(0));
    params.reach = reach;
    params.finest = finest;
    params.octaves = octaves;
    params.seed = seed;
    params.num_threads = num_threads;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        params.across[axis] = rays(0, axis);
        params.down[axis] = rays(1, axis);
        params.corner[axis] = rays(2, axis);
        params.origin[axis] = rays(3, axis);
        params.focus[axis] = focus(axis);
    }
    const nb::gil_scoped_release without_gil;
    brushgs::space_noise(params);
}

template <class T>
void smooth_planes(Out<T, 3> planes, std::optional<In<T, 3>> guide, std::optional<In<T, 2>> hold, double sigma,
                   int rounds, int num_threads) {
    const brushgs::SmoothParams<T> params{.planes = planes.data(),
                                          .guide = data_or_null(guide),
                                          .hold = data_or_null(hold),
                                          .width = static_cast<int>(planes.shape(1)),
                                          .height = static_cast<int>(planes.shape(0)),
                                          .channels = static_cast<int>(planes.shape(2)),
                                          .sigma = sigma,
                                          .rounds = rounds,
                                          .num_threads = num_threads};
    if (params.channels != 1 && params.channels != 3)
        throw nb::value_error("smooth_planes: planes must have 1 or 3 channels");
    const nb::gil_scoped_release without_gil;
    brushgs::smooth_planes(params);
}

template <class T>
void key_colors(In<T, 3> rgb, In<T, 2> alpha, double low, double high, double darkest, double gamma, double chroma,
                double solid, int num_threads, Out<T, 3> keyed) {
    const brushgs::KeyParams<T> params{.rgb = rgb.data(),
                                       .alpha = alpha.data(),
                                       .keyed = keyed.data(),
                                       .num_pixels = alpha.size(),
                                       .low = static_cast<T>(low),
                                       .high = static_cast<T>(high),
                                       .darkest = static_cast<T>(darkest),
                                       .gamma = static_cast<T>(gamma),
                                       .chroma = static_cast<T>(chroma),
                                       .solid = static_cast<T>(solid),
                                       .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::key_colors(params);
}

template <class T>
brushgs::WashNumbers<T> wash_numbers(const In<double, 1>& values) {
    brushgs::WashNumbers<T> numbers;
    static_assert(sizeof numbers % sizeof(T) == 0);
    if (values.size() != sizeof numbers / sizeof(T)) throw nb::value_error("numbers must be those of Washes");
    T* const to = reinterpret_cast<T*>(&numbers);
    for (std::size_t i = 0; i < values.size(); ++i) to[i] = static_cast<T>(values(i));
    return numbers;
}

template <class T>
void part_washes(In<T, 3> coarse, In<T, 3> middle, In<T, 3> fine, In<T, 3> noise, In<double, 1> numbers,
                 int num_threads, Out<T, 3> densities, Out<T, 3> means, Out<T, 2> tones) {
    const brushgs::WashParams<T> params{.coarse = coarse.data(),
                                        .middle = middle.data(),
                                        .fine = fine.data(),
                                        .noise = noise.data(),
                                        .densities = densities.data(),
                                        .means = means.data(),
                                        .tones = tones.data(),
                                        .num_pixels = tones.size(),
                                        .num_threads = num_threads};
    const auto of_washes = wash_numbers<T>(numbers);
    const nb::gil_scoped_release without_gil;
    brushgs::part_washes(params, of_washes);
}

template <class T>
void mix_washes(In<T, 3> densities, In<T, 3> means, In<T, 3> blurred, In<T, 2> tones, In<T, 3> noise, In<T, 2> alpha,
                std::optional<In<T, 2>> soft, std::optional<In<T, 2>> grain, std::optional<In<T, 2>> border,
                std::optional<In<T, 3>> paper, In<double, 1> numbers, int num_threads, Out<T, 3> rgb,
                Out<T, 2> covered) {
    const brushgs::MixParams<T> params{.densities = densities.data(),
                                       .means = means.data(),
                                       .blurred = blurred.data(),
                                       .tones = tones.data(),
                                       .noise = noise.data(),
                                       .alpha = alpha.data(),
                                       .soft = data_or_null(soft),
                                       .grain = data_or_null(grain),
                                       .border = data_or_null(border),
                                       .paper = data_or_null(paper),
                                       .rgb = rgb.data(),
                                       .covered = covered.data(),
                                       .num_pixels = alpha.size(),
                                       .num_threads = num_threads};
    const auto of_washes = wash_numbers<T>(numbers);
    const nb::gil_scoped_release without_gil;
    brushgs::mix_washes(params, of_washes);
}

template <class T>
void def_wet(nb::module_& m) {
    m.def("space_noise", &space_noise<T>, nb::kw_only(), "depth"_a.noconvert(), "rays"_a.noconvert(),
          "focus"_a.noconvert(), "reach"_a, "finest"_a, "octaves"_a, "seed"_a, "num_threads"_a, "noise"_a.noconvert(),
          "Write noise [H, W, 3] at the points of space that a depth [H, W] shows, see wet.hpp.");
    m.def("smooth_planes", &smooth_planes<T>, nb::kw_only(), "planes"_a.noconvert(), "guide"_a.noconvert().none(),
          "hold"_a.noconvert().none(), "sigma"_a, "rounds"_a, "num_threads"_a,
          "Smooth planes [H, W, 1 or 3] in place, held back by the steps of a guide [H, W, 3], see wet.hpp.");
    m.def("key_colors", &key_colors<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "low"_a, "high"_a,
          "darkest"_a, "gamma"_a, "chroma"_a, "solid"_a, "num_threads"_a, "keyed"_a.noconvert(),
          "Write the colors [H, W, 3] of a picture as those of a watercolour on white, see wet.hpp.");
    m.def("part_washes", &part_washes<T>, nb::kw_only(), "coarse"_a.noconvert(), "middle"_a.noconvert(),
          "fine"_a.noconvert(), "noise"_a.noconvert(), "numbers"_a.noconvert(), "num_threads"_a,
          "densities"_a.noconvert(), "means"_a.noconvert(), "tones"_a.noconvert(),
          "Write the densities [H, W, 9] of three washes, their means [H, W, 3] and a tone [H, W], see wet.hpp.");
    m.def("mix_washes", &mix_washes<T>, nb::kw_only(), "densities"_a.noconvert(), "means"_a.noconvert(),
          "blurred"_a.noconvert(), "tones"_a.noconvert(), "noise"_a.noconvert(), "alpha"_a.noconvert(),
          "soft"_a.noconvert().none(), "grain"_a.noconvert().none(), "border"_a.noconvert().none(),
          "paper"_a.noconvert().none(), "numbers"_a.noconvert(), "num_threads"_a, "rgb"_a.noconvert(),
          "covered"_a.noconvert(), "Write the covering paint of three washes on a paper, see wet.hpp.");
}

template <class T>
double photometric(In<T, 3> painted, In<T, 3> target, In<double, 1> window, double share,
                   std::pair<double, double> stabilizers, int num_threads, Out<T, 3> gradient) {
    if (window.size() != brushgs::kWindowTaps) throw nb::value_error("photometric: window must have 11 weights");
    if (const auto channels = painted.shape(2); channels != 1 && channels != 3)
        throw nb::value_error("photometric: pictures must have 1 or 3 channels");
    const brushgs::PhotometricParams<T> params{.painted = painted.data(),
                                               .target = target.data(),
                                               .gradient = gradient.data(),
                                               .width = static_cast<int>(painted.shape(1)),
                                               .height = static_cast<int>(painted.shape(0)),
                                               .channels = static_cast<int>(painted.shape(2)),
                                               .window = window.data(),
                                               .share = share,
                                               .stabilizers = {stabilizers.first, stabilizers.second},
                                               .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    return brushgs::photometric(params);
}

template <class T>
void def_photometric(nb::module_& m) {
    m.def("photometric", &photometric<T>, nb::kw_only(), "painted"_a.noconvert(), "target"_a.noconvert(),
          "window"_a.noconvert(), "share"_a, "stabilizers"_a, "num_threads"_a, "gradient"_a.noconvert(),
          "The loss of a painted picture [H, W, C] to its target; its gradient by the painted one is written. See "
          "photometric.hpp. window: 11 weights along an axis; share: of dissimilarity in the loss.");
}

// Arrays

nb::tuple nearest(In<float, 2> points, In<double, 2> centers, int num_threads) {
    const brushgs::NearestQuery query{.points = points.data(),
                                      .centers = centers.data(),
                                      .num_points = points.shape(0),
                                      .num_centers = centers.shape(0),
                                      .num_dimensions = points.shape(1),
                                      .num_threads = num_threads};
    brushgs::Nearest found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_nearest(query);
    }
    return nb::make_tuple(row(std::move(found.distances), query.num_points),
                          row(std::move(found.rows), query.num_points));
}

brushgs::PointGroups point_groups(const In<float, 2>& points, const In<double, 2>& centers,
                                  const In<std::int32_t, 1>& rows, const In<std::int64_t, 1>& begins) {
    return {.points = points.data(),
            .centers = centers.data(),
            .rows = rows.data(),
            .begins = begins.data(),
            .num_points = points.shape(0),
            .num_groups = centers.shape(0),
            .num_dimensions = points.shape(1)};
}

nb::tuple nearest_again(In<float, 2> points, In<double, 2> centers, In<std::int32_t, 1> rows,
                        In<std::int64_t, 1> begins, int num_threads) {
    const auto groups = point_groups(points, centers, rows, begins);
    brushgs::Nearest found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_nearest_again(groups, num_threads);
    }
    return nb::make_tuple(row(std::move(found.distances), groups.num_points),
                          row(std::move(found.rows), groups.num_points));
}

void nearer(In<float, 2> points, In<double, 2> centers, In<std::int32_t, 1> rows, In<std::int64_t, 1> begins,
            In<double, 2> others, std::int32_t first, Out<double, 1> distances, Out<std::int32_t, 1> labels,
            int num_threads) {
    const auto groups = point_groups(points, centers, rows, begins);
    const brushgs::NearerQuery query{.others = others.data(),
                                     .num_others = others.shape(0),
                                     .first = first,
                                     .num_threads = num_threads,
                                     .distances = distances.data(),
                                     .labels = labels.data()};
    const nb::gil_scoped_release without_gil;
    brushgs::find_nearer(groups, query);
}

void neighbors(In<double, 2> points, Out<std::int32_t, 2> rows, int num_threads) {
    const brushgs::NeighborQuery query{.points = points.data(),
                                       .num_points = points.shape(0),
                                       .num_neighbors = rows.shape(1),
                                       .num_dimensions = points.shape(1),
                                       .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::find_neighbors(query, rows.data());
}

void several_nearest(In<double, 2> points, In<double, 2> queries, Out<double, 2> distances, Out<std::int32_t, 2> rows,
                     int num_threads) {
    const brushgs::SeveralQuery query{.points = points.data(),
                                      .queries = queries.data(),
                                      .num_points = points.shape(0),
                                      .num_queries = queries.shape(0),
                                      .num_nearest = rows.shape(1),
                                      .num_dimensions = points.shape(1),
                                      .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::find_several(query, distances.data(), rows.data());
}

void components(In<std::int64_t, 1> a, In<std::int64_t, 1> b, Out<std::int32_t, 1> components) {
    const brushgs::Links links{a.data(), b.data(), a.shape(0)};
    const nb::gil_scoped_release without_gil;
    brushgs::find_components(links, components.data(), components.shape(0));
}

nb::tuple trace_lines(In<float, 3> directions, In<float, 2> spacing, In<double, 2> taken, In<double, 2> seeds,
                      In<double, 1> factors, double step, double shortest, double longest, double end) {
    const brushgs::LineField field{directions.data(), spacing.data(), spacing.shape(1), spacing.shape(0)};
    const brushgs::LineRules rules{.taken = taken.data(),
                                   .num_taken = taken.shape(0),
                                   .seeds = seeds.data(),
                                   .num_seeds = seeds.shape(0),
                                   .factors = factors.data(),
                                   .num_levels = factors.shape(0),
                                   .step = step,
                                   .shortest = shortest,
                                   .longest = longest,
                                   .end = end};
    brushgs::TracedLines lines;
    {
        const nb::gil_scoped_release without_gil;
        lines = brushgs::trace_lines(field, rules);
    }
    return nb::make_tuple(to_array(std::move(lines.points)), to_array(std::move(lines.begins)),
                          to_array(std::move(lines.levels)));
}

brushgs::WeightedPoints weighted_points(const In<float, 2>& points, const In<double, 1>& weights) {
    return {.points = points.data(),
            .weights = weights.data(),
            .num_points = points.shape(0),
            .num_dimensions = points.shape(1)};
}

nb::object start_centers(In<float, 2> points, In<double, 1> weights, std::size_t num_clusters, In<double, 1> draws,
                         int num_threads) {
    brushgs::Buffer<double> centers;
    std::size_t count = 0;
    {
        const nb::gil_scoped_release without_gil;
        const auto found =
            brushgs::start_centers(weighted_points(points, weights), num_clusters, draws.data(), num_threads);
        centers = brushgs::make_buffer<double>(found.size());
        std::copy(found.begin(), found.end(), centers.get());
        count = found.size() / points.shape(1);
    }
    return table(centers, count, points.shape(1));
}

nb::tuple find_clusters(In<float, 2> points, In<double, 1> weights, std::size_t num_clusters, In<double, 1> draws,
                        int num_steps, double gain, int num_threads) {
    brushgs::Clusters found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_clusters(weighted_points(points, weights), {.num_clusters = num_clusters,
                                                                          .draws = draws.data(),
                                                                          .num_steps = num_steps,
                                                                          .gain = gain,
                                                                          .num_threads = num_threads});
    }
    return nb::make_tuple(row(std::move(found.labels), points.shape(0)), found.num_clusters, found.num_steps,
                          found.inertia);
}

// Rows by label, and in order

nb::tuple group_rows(In<std::int32_t, 1> labels, std::size_t num_groups) {
    const std::size_t count = labels.shape(0);
    auto rows = brushgs::make_buffer<std::int32_t>(count);
    auto begins = brushgs::make_buffer<std::int64_t>(num_groups + 1);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::group_rows(labels.data(), count, num_groups, rows.get(), begins.get());
    }
    return nb::make_tuple(row(rows, count), row(begins, num_groups + 1));
}

template <class T>
nb::tuple sum_groups(In<T, 2> values, In<double, 1> weights, In<std::int32_t, 1> rows, In<std::int64_t, 1> begins,
                     int num_threads) {
    const std::size_t num_groups = begins.shape(0) - 1, width = values.shape(1);
    auto totals = brushgs::make_buffer<double>(num_groups), sums = brushgs::make_buffer<double>(num_groups * width);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::sum_groups(brushgs::GroupSums<T>{.values = values.data(),
                                                  .weights = weights.data(),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = num_groups,
                                                  .width = width,
                                                  .num_threads = num_threads,
                                                  .totals = totals.get(),
                                                  .sums = sums.get()});
    }
    return nb::make_tuple(row(totals, num_groups), table(sums, num_groups, width));
}

template <class T>
void add_rows(Out<double, 2> totals, In<std::int32_t, 1> rows, In<T, 2> values) {
    const nb::gil_scoped_release without_gil;
    brushgs::add_rows(brushgs::RowAddends<T>{.values = values.data(),
                                             .rows = rows.data(),
                                             .num_rows = rows.shape(0),
                                             .width = totals.shape(1),
                                             .totals = totals.data()});
}

template <class T>
nb::object halves(In<T, 2> points, In<double, 1> weights, std::optional<In<T, 3>> spans, In<std::int32_t, 1> rows,
                  In<std::int64_t, 1> begins, double least_span, int num_steps, int num_threads) {
    if (points.shape(1) < 3 || points.shape(1) > brushgs::kMostFeatures)
        throw nb::value_error("halves: points must have 3 to 16 features");
    auto is_second = brushgs::make_buffer<std::uint8_t>(rows.shape(0));
    {
        const nb::gil_scoped_release without_gil;
        brushgs::halve_groups(brushgs::Halving<T>{.points = points.data(),
                                                  .num_features = points.shape(1),
                                                  .weights = weights.data(),
                                                  .spans = data_or_null(spans),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = begins.shape(0) - 1,
                                                  .least_span = least_span,
                                                  .num_steps = num_steps,
                                                  .num_threads = num_threads,
                                                  .is_second = is_second.get()});
    }
    return row(is_second, rows.shape(0));
}

template <class T>
nb::object projected_areas(In<T, 2> scales, double finest, int num_threads) {
    const std::size_t count = scales.shape(0);
    auto areas = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::projected_areas(scales.data(), count, finest, num_threads, areas.get());
    }
    return row(areas, count);
}

template <class T>
nb::object seen_scales(In<T, 2> scales, double finest, int num_threads) {
    const std::size_t count = scales.shape(0);
    auto seen = brushgs::make_buffer<double>(3 * count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::seen_scales(scales.data(), count, finest, num_threads, seen.get());
    }
    return table(seen, count, 3);
}

template <class T>
nb::tuple sum_covariances(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<double, 1> shares,
                          In<std::int32_t, 1> rows, In<std::int64_t, 1> begins, In<double, 2> centers,
                          int num_threads) {
    const std::size_t num_groups = centers.shape(0);
    auto within = brushgs::make_buffer<double>(9 * num_groups), between = brushgs::make_buffer<double>(9 * num_groups);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::sum_covariances(brushgs::Covariances<T>{.means = means.data(),
                                                         .quats = quats.data(),
                                                         .scales = scales.data(),
                                                         .shares = shares.data(),
                                                         .rows = rows.data(),
                                                         .begins = begins.data(),
                                                         .centers = centers.data(),
                                                         .num_groups = num_groups,
                                                         .num_threads = num_threads,
                                                         .within = within.get(),
                                                         .between = between.get()});
    }
    return nb::make_tuple(matrices(within, num_groups), matrices(between, num_groups));
}

nb::tuple principal_axes(In<double, 3> covariances, int num_threads) {
    const std::size_t count = covariances.shape(0);
    auto scales = brushgs::make_buffer<double>(3 * count), axes = brushgs::make_buffer<double>(9 * count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::principal_axes(covariances.data(), count, num_threads, scales.get(), axes.get());
    }
    return nb::make_tuple(table(scales, count, 3), matrices(axes, count));
}

template <class T>
nb::object stop_groups(In<T, 1> opacities, In<double, 1> areas, In<double, 1> footprints, In<std::int32_t, 1> rows,
                       In<std::int64_t, 1> begins, int num_threads) {
    const std::size_t num_groups = footprints.shape(0);
    auto stopped = brushgs::make_buffer<double>(num_groups);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::stop_groups(brushgs::Stopping<T>{.opacities = opacities.data(),
                                                  .areas = areas.data(),
                                                  .footprints = footprints.data(),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = num_groups,
                                                  .num_threads = num_threads,
                                                  .stopped = stopped.get()});
    }
    return row(stopped, num_groups);
}

nb::tuple cover(In<double, 2> means, In<double, 2> scales, In<double, 3> axes, In<double, 1> opacities,
                In<std::int64_t, 1> rows, In<std::int32_t, 2> neighbors, std::size_t num_touching, double touch,
                int num_threads) {
    const std::size_t count = rows.shape(0);
    auto passed = brushgs::make_buffer<double>(count), touching = brushgs::make_buffer<double>(count),
         parallel = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::cover({.means = means.data(),
                        .scales = scales.data(),
                        .axes = axes.data(),
                        .opacities = opacities.data(),
                        .rows = rows.data(),
                        .neighbors = neighbors.data(),
                        .num_rows = count,
                        .num_neighbors = neighbors.shape(1),
                        .num_touching = num_touching,
                        .touch = touch,
                        .num_threads = num_threads,
                        .passed = passed.get(),
                        .touching = touching.get(),
                        .parallel = parallel.get()});
    }
    return nb::make_tuple(row(passed, count), row(touching, count), row(parallel, count));
}

nb::object growth(In<double, 2> means, In<double, 2> scales, In<double, 3> axes, In<double, 1> opacities,
                  int num_threads) {
    const std::size_t count = means.shape(0);
    auto growth = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::find_growth({.means = means.data(),
                              .scales = scales.data(),
                              .axes = axes.data(),
                              .opacities = opacities.data(),
                              .num_strokes = count,
                              .num_threads = num_threads,
                              .growth = growth.get()});
    }
    return row(growth, count);
}

template <class T>
nb::object morton_order(In<T, 2> points, In<double, 1> low, double step, int num_threads) {
    const std::size_t count = points.shape(0);
    auto order = brushgs::make_buffer<std::int64_t>(count);
    {
        const nb::gil_scoped_release without_gil;
        const auto keys = brushgs::make_buffer<std::uint64_t>(count);
        brushgs::morton_keys(points.data(), count, low.data(), step, num_threads, keys.get());
        const auto rows = brushgs::rows_by_key(keys.get(), count, num_threads);
        std::copy_n(rows.get(), count, order.get());
    }
    return row(order, count);
}

template <class T>
nb::object curve_order(In<T, 2> points, int num_threads) {
    const std::size_t count = points.shape(0);
    auto order = brushgs::make_buffer<std::int64_t>(count);
    {
        const nb::gil_scoped_release without_gil;
        const auto rows = brushgs::rows_along_curve(points.data(), count, points.shape(1), num_threads);
        std::copy_n(rows.get(), count, order.get());
    }
    return row(order, count);
}

void light_along(In<double, 1> places, In<double, 1> depths, double reach, Out<double, 1> from_above,
                 Out<double, 1> from_below) {
    const nb::gil_scoped_release without_gil;
    brushgs::light_along({.places = places.data(),
                          .depths = depths.data(),
                          .count = places.shape(0),
                          .reach = reach,
                          .from_above = from_above.data(),
                          .from_below = from_below.data()});
}

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
}

template <class T>
void def_groups(nb::module_& m) {
    m.def("sum_groups", &sum_groups<T>, "values"_a.noconvert(), "weights"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "num_threads"_a,
          "Of the groups that `group_rows` found, the sums [k] of the weights [N] and [k, D] of weight x values "
          "[N, D], added in the order of the rows.");
    m.def("add_rows", &add_rows<T>, "totals"_a.noconvert(), "rows"_a.noconvert(), "values"_a.noconvert(),
          "Add values [n, D], one after the other, to these rows [n] of totals [N, D].");
    m.def(
        "halves", &halves<T>, "points"_a.noconvert(), "weights"_a.noconvert(), "spans"_a.noconvert().none(),
        "rows"_a.noconvert(), "begins"_a.noconvert(), "least_span"_a, "num_steps"_a, "num_threads"_a,
        "Cut groups of points [N, D], as `group_rows` lists them, in two: [N] uint8 in the order of `rows`, 0 for the "
        "half of a group's first row. `spans` [N, 3, 3] or None, see halves.hpp.");
    m.def("morton_order", &morton_order<T>, "points"_a.noconvert(), "low"_a.noconvert(), "step"_a, "num_threads"_a,
          "The rows [N] int64 of points [N, 3] along the Morton curve of (point - low) * step, ties by row.");
    m.def("morton_order", &curve_order<T>, "points"_a.noconvert(), "num_threads"_a,
          "The same along the curve with 2^21 steps over the largest extent of the points [N, D], of which the first "
          "three numbers count.");
}

template <class T>
void def_moments(nb::module_& m) {
    m.def("projected_areas", &projected_areas<T>, "scales"_a.noconvert(), "finest"_a, "num_threads"_a,
          "The mean projected area over pi [N] of ellipsoids of half axes [N, 3], as visible in pictures.");
    m.def("seen_scales", &seen_scales<T>, "scales"_a.noconvert(), "finest"_a, "num_threads"_a,
          "Half axes [N, 3] as visible in pictures, see moments.hpp.");
    m.def("sum_covariances", &sum_covariances<T>, "means"_a.noconvert(), "quats"_a.noconvert(), "scales"_a.noconvert(),
          "shares"_a.noconvert(), "rows"_a.noconvert(), "begins"_a.noconvert(), "centers"_a.noconvert(),
          "num_threads"_a,
          "Of the groups that `group_rows` found, with centers [k, 3], the mean covariance of their members and the "
          "covariance of their means, [k, 3, 3] each, weighted by shares [N].");
    m.def("stop_groups", &stop_groups<T>, "opacities"_a.noconvert(), "areas"_a.noconvert(), "footprints"_a.noconvert(),
          "rows"_a.noconvert(), "begins"_a.noconvert(), "num_threads"_a,
          "The probability [k] that a ray through each footprint [k] is stopped by the members of a group, of "
          "opacities [N] and areas [N], at random places in it.");
}

// Tables as Python holds them: light [n], roots [n], and the matrices [3, 3] before and after the roots.
using OklabArrays = std::tuple<In<float, 1>, In<float, 1>, In<float, 2>, In<float, 2>>;

brushgs::OklabTables oklab_tables(const OklabArrays& arrays) {
    const auto& [light, roots, cones, lab] = arrays;
    return {light.data(), light.shape(0), roots.data(), roots.shape(0), cones.data(), lab.data()};
}

void oklab_planes(const OklabArrays& tables, In<float, 3> rgb, Out<float, 3> planes, int num_threads) {
    const auto found = oklab_tables(tables);
    const nb::gil_scoped_release without_gil;
    brushgs::oklab_planes(found, rgb.data(), rgb.shape(0) * rgb.shape(1), num_threads, planes.data());
}

void seen_planes(const OklabArrays& tables, In<float, 3> rgb, In<float, 2> alpha, Out<float, 4> planes,
                 int num_threads) {
    const auto found = oklab_tables(tables);
    const nb::gil_scoped_release without_gil;
    brushgs::seen_planes(found, {rgb.data(), alpha.data(), alpha.shape(0), alpha.shape(1)}, num_threads, planes.data());
}

void seen_errors(In<float, 4> plain, In<float, 4> painted, float low, float high, Out<double, 2> errors,
                 int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::seen_errors({.plain = plain.data(),
                          .painted = painted.data(),
                          .height = errors.shape(0),
                          .width = errors.shape(1),
                          .low = low,
                          .high = high,
                          .num_threads = num_threads,
                          .errors = errors.data()});
}

// Stroke levels

void fill_levels(In<std::uint8_t, 2> coverage, std::optional<In<std::uint8_t, 2>> height,
                 const std::vector<const brushgs::LevelFilter*>& along_u,
                 const std::vector<const brushgs::LevelFilter*>& along_v, In<std::int32_t, 2> codes,
                 const std::vector<Out<std::uint8_t, 2>>& coverages, const std::vector<Out<std::uint8_t, 2>>& heights,
                 int num_threads) {
    const brushgs::StrokeImage image{coverage.data(), data_or_null(height), coverage.shape(0), coverage.shape(1)};
    std::vector<brushgs::StrokeLevel> levels;
    for (std::size_t i = 0; i < coverages.size(); ++i)
        levels.push_back({static_cast<std::size_t>(codes(i, 0)), static_cast<std::size_t>(codes(i, 1)),
                          coverages[i].data(), height ? heights[i].data() : nullptr});
    const nb::gil_scoped_release without_gil;
    brushgs::fill_levels(image, along_u, along_v, levels, num_threads);
}

void def_stroke_levels(nb::module_& m) {
    nb::class_<brushgs::LevelFilter>(m, "LevelFilter", "The weights of the texels of a source in those of a level.")
        .def(nb::init<std::size_t, std::size_t, double, double>(), nb::kw_only(), "num_source"_a, "num_texels"_a,
             "scale"_a, "footprint"_a, "See stroke_levels.hpp; a footprint of 0 is the source itself.")
        .def(
            "weights",
            [](const brushgs::LevelFilter& self) {
                const std::size_t shape[2] = {self.num_texels(), self.num_source()};
                return nb::ndarray<nb::numpy, const double, nb::ndim<2>>(self.weights().data(), 2, shape);
            },
            nb::rv_policy::copy, "[num_texels, num_source]; not of the source itself.")
        .def(
            "apply",
            [](const brushgs::LevelFilter& self, In<double, 2> texels, Out<double, 2> result) {
                const nb::gil_scoped_release without_gil;
                self.apply(texels.data(), texels.shape(1), result.data());
            },
            nb::kw_only(), "texels"_a.noconvert(), "result"_a.noconvert(),
            "Write weights x texels [num_source, columns] to the result; not of the source itself.");
    m.def("fill_levels", &fill_levels, nb::kw_only(), "coverage"_a.noconvert(), "height"_a.noconvert().none(),
          "along_u"_a, "along_v"_a, "codes"_a.noconvert(), "coverages"_a.noconvert(), "heights"_a.noconvert(),
          "num_threads"_a,
          "Fill for each of L codes [L, 2], rows of the filters along u and v, an image of the coverage and, where "
          "there is a height, one of that; see stroke_levels.hpp.");
}

}  // namespace

NB_MODULE(_core, m) {
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
    def_light<float>(m);
    def_light<double>(m);
    def_photometric<float>(m);
    def_photometric<double>(m);
    def_finish<float>(m);
    def_finish<double>(m);
    def_press<float>(m);
    def_press<double>(m);
    def_wet<float>(m);
    def_wet<double>(m);
    def_coats<float>(m);
    def_coats<double>(m);
    m.def("new_plane_float32", &new_plane<float>, "shape"_a, "An uninitialised array for a frame.");
    m.def("new_plane_float64", &new_plane<double>, "shape"_a, "An uninitialised array for a frame.");
    m.def("nearest", &nearest, "points"_a.noconvert(), "centers"_a.noconvert(), "num_threads"_a,
          "For points [N, D], D at most MOST_DIMENSIONS, the distance [N] to the nearest of the centers [k, D], and "
          "its row [N] int32, the first of equally near ones.");
    m.def("most_draws", &brushgs::most_draws, "num_clusters"_a, "How many random numbers a start of k-means may use.");
    m.def("start_centers", &start_centers, "points"_a.noconvert(), "weights"_a.noconvert(), "num_clusters"_a,
          "draws"_a.noconvert(), "num_threads"_a,
          "First centers [k, D] of k-means over points [N, D] along a curve, with weights [N] and draws [most_draws] "
          "from 0 to 1, see lloyd.hpp.");
    m.def("find_clusters", &find_clusters, nb::kw_only(), "points"_a.noconvert(), "weights"_a.noconvert(),
          "num_clusters"_a, "draws"_a.noconvert(), "num_steps"_a, "gain"_a, "num_threads"_a,
          "Cluster points [N, D] in any order: labels [N] int32, their number, that of the steps, and the inertia, see "
          "lloyd.hpp.");
    m.def("nearest_again", &nearest_again, "points"_a.noconvert(), "centers"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "num_threads"_a,
          "What `nearest` gives, sooner for points that `group_rows` groups by what was nearest before.");
    m.def("nearer", &nearer, "points"_a.noconvert(), "centers"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "others"_a.noconvert(), "first"_a, "distances"_a.noconvert(), "labels"_a.noconvert(),
          "num_threads"_a,
          "Bring distances [N] and labels [N] int32 of what is nearest to points [N, D], which `group_rows` groups by "
          "these labels, up to date where one of the others [m, D], labelled from `first` on, is nearer.");
    m.def("group_rows", &group_rows, "labels"_a.noconvert(), "num_groups"_a,
          "The rows [N] int32 of labels [N] int32 group by group, each ascending, and where the groups begin [k + 1].");
    def_groups<float>(m);
    def_groups<double>(m);
    def_moments<float>(m);
    def_moments<double>(m);
    def_scenes<float>(m);
    def_scenes<double>(m);
    m.def("cluster_weights", &cluster_weights, "contributions"_a.noconvert(), "detail"_a.noconvert(),
          "Weights [N] in k-means by contributions [N] and detail [N] of color, see features.hpp.");
    m.def("principal_axes", &principal_axes, "covariances"_a.noconvert(), "num_threads"_a,
          "Standard deviations [N, 3], ascending, and axes [N, 3, 3], as columns, of covariances; see moments.hpp.");
    m.def("cover", &cover, nb::kw_only(), "means"_a.noconvert(), "scales"_a.noconvert(), "axes"_a.noconvert(),
          "opacities"_a.noconvert(), "rows"_a.noconvert(), "neighbors"_a.noconvert(), "num_touching"_a, "touch"_a,
          "num_threads"_a,
          "For these rows [n] of strokes with these neighbors [n, m], the light that passes them, how many of the "
          "first neighbors touch, and the sum of the cosines between normals, [n] each. See coverage.hpp.");
    m.def("spread_weights", &spread_weights, "weights"_a.noconvert(), "places"_a.noconvert(), "num_threads"_a,
          "The weights [N] times factors that vary along the curve of places [N, 3], see prune.hpp.");
    m.def("count_spare", &count_spare, "weights"_a.noconvert(), "ranked"_a.noconvert(), "num_threads"_a,
          "How many rows of the lowest rank hold at most 5 % of the weights, see prune.hpp.");
    m.def("mark_highest", &mark_highest, "weights"_a.noconvert(), "num_kept"_a, "is_kept"_a.noconvert(),
          "Write a mask [N] uint8 of the highest weights [N], ties by row.");
    m.def("growth", &growth, "means"_a.noconvert(), "scales"_a.noconvert(), "axes"_a.noconvert(),
          "opacities"_a.noconvert(), "num_threads"_a, "The growth [k] of strokes that closes gaps, see gaps.hpp.");
    m.def("oklab_planes", &oklab_planes, nb::kw_only(), "tables"_a, "rgb"_a.noconvert(), "planes"_a.noconvert(),
          "num_threads"_a, "Write OKLab planes [3, H, W] of a picture [H, W, 3], 0 to 1; see oklab.hpp.");
    m.def("seen_planes", &seen_planes, nb::kw_only(), "tables"_a, "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "planes"_a.noconvert(), "num_threads"_a,
          "Write OKLab planes [2, 3, h, w] of a premultiplied picture [H, W, 3] of half the size, over black and over "
          "white; see oklab.hpp.");
    m.def("seen_errors", &seen_errors, nb::kw_only(), "plain"_a.noconvert(), "painted"_a.noconvert(), "low"_a, "high"_a,
          "errors"_a.noconvert(), "num_threads"_a,
          "Write the squared errors [H, W] between two of these planes, mean over black and white; see oklab.hpp.");
    m.def("light_along", &light_along, "places"_a.noconvert(), "depths"_a.noconvert(), "reach"_a,
          "from_above"_a.noconvert(), "from_below"_a.noconvert(),
          "Write for places [N] on a line minus the optical depth [N] of what lies above each and below each, within "
          "reach, see light_along.hpp.");
    m.def("neighbors", &neighbors, "points"_a.noconvert(), "rows"_a.noconvert(), "num_threads"_a,
          "Write for each of the points [N, D] the rows [N, k] int32 of the k others nearest to it, nearest first, "
          "ties by row; k is below N and at most MOST_NEIGHBORS.");
    m.def("several_nearest", &several_nearest, "points"_a.noconvert(), "queries"_a.noconvert(),
          "distances"_a.noconvert(), "rows"_a.noconvert(), "num_threads"_a,
          "Write for each of the queries [Q, D] the distances [Q, k] and rows [Q, k] int32 of the k points [N, D] "
          "nearest to it, nearest first, ties by row; k is at most N and MOST_NEIGHBORS.");
    m.def("components", &components, "a"_a.noconvert(), "b"_a.noconvert(), "components"_a.noconvert(),
          "Write for each of N rows its component [N] int32, by the links a [M] to b [M] between rows. Components are "
          "numbered from 0, in the order of their first rows.");
    m.def("trace_lines", &trace_lines, "directions"_a.noconvert(), "spacing"_a.noconvert(), "taken"_a.noconvert(),
          "seeds"_a.noconvert(), "factors"_a.noconvert(), nb::kw_only(), "step"_a, "shortest"_a, "longest"_a, "end"_a,
          "Evenly spaced lines along the directions [H, W, 2] of a picture (cosine and sine of twice the angle), at "
          "the spacing [H, W] in pixels, 0 where there are none; dots where `step` is 0. See `LineRules`. Returns "
          "points [2 P] (x, y), the first point of each line [L + 1] int64, and its level [L] int32.");
    def_stroke_levels(m);
}
