// The only file that knows Python: it translates arrays to spans and back, and releases the GIL.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "brushgs/blending.hpp"
#include "brushgs/cpu.hpp"
#include "brushgs/filter.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/frame_pool.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/project.hpp"
#include "brushgs/project_backward.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/track.hpp"

namespace nb = nanobind;
using namespace nb::literals;

#if defined(__clang__)
#define BRUSHGS_COMPILER "Clang " __clang_version__
#else
#define BRUSHGS_COMPILER "GCC " __VERSION__
#endif

namespace {

// A C-contiguous array that is read, or written; the Python layer has checked the shapes.
template <class T, std::size_t rank>
using In = nb::ndarray<const T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;
template <class T, std::size_t rank>
using Out = nb::ndarray<T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;

// A column of shape [rows, width], or [rows] where width is 0, in memory that lives as long as `owner`.
template <class T>
nb::object column(T* values, std::size_t rows, std::size_t width, const nb::capsule& owner) {
    const std::size_t shape[2] = {rows, width};
    return nb::cast(nb::ndarray<nb::numpy, T>(values, width == 0 ? 1 : 2, shape, owner));
}

// An array of shape [rows, width] in memory that becomes its own.
template <class T>
nb::object table(brushgs::Buffer<T>& memory, std::size_t rows, std::size_t width) {
    T* values = memory.release();
    const nb::capsule owner(values, [](void* p) noexcept { brushgs::Free{}(p); });
    const std::size_t shape[2] = {rows, width};
    return nb::cast(nb::ndarray<nb::numpy, T>(values, 2, shape, owner));
}

brushgs::View view_of(In<double, 2> viewmat, In<double, 2> K, int width, int height, double near) {
    brushgs::View view{.viewmat = {},
                       .fx = K(0, 0),
                       .fy = K(1, 1),
                       .cx = K(0, 2),
                       .cy = K(1, 2),
                       .width = static_cast<double>(width),
                       .height = static_cast<double>(height),
                       .near = near};
    std::copy_n(viewmat.data(), 12, view.viewmat);
    return view;
}

template <class T>
nb::tuple project(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                  In<double, 2> viewmat, In<double, 2> K, int width, int height, double near, double num_sigmas,
                  double low_pass, int sh_degree, int num_threads, brushgs::Lock lock,
                  std::optional<In<float, 1>> directions, std::optional<In<float, 1>> area_scales, bool fades,
                  double softness) {
    const brushgs::GaussianColumns<T> gaussians{.means = means.data(),
                                                .quats = quats.data(),
                                                .scales = scales.data(),
                                                .opacities = opacities.data(),
                                                .sh = sh.data(),
                                                .count = means.shape(0),
                                                .sh_terms = sh.shape(1)};
    brushgs::ProjectParams params{.view = view_of(viewmat, K, width, height, near),
                                  .num_sigmas = num_sigmas,
                                  .low_pass = low_pass,
                                  .sh_degree = sh_degree,
                                  .num_threads = num_threads,
                                  .lock = lock,
                                  .directions = directions ? directions->data() : nullptr,
                                  .area_scales = area_scales ? area_scales->data() : nullptr,
                                  .fades = fades,
                                  .softness = softness};
    brushgs::BoxColumns<T> boxes;
    {
        const nb::gil_scoped_release without_gil;
        boxes = brushgs::project(gaussians, params);
    }
    const std::size_t count = boxes.count;
    const nb::capsule owner(boxes.memory.release(), [](void* memory) noexcept { brushgs::Free{}(memory); });
    const nb::object softness =
        boxes.softness == nullptr ? nb::object(nb::none()) : column(boxes.softness, count, 0, owner);
    return nb::make_tuple(
        nb::make_tuple(column(boxes.centers, count, 2, owner), column(boxes.half_extents, count, 2, owner),
                       column(boxes.angles, count, 0, owner), column(boxes.depths, count, 0, owner),
                       column(boxes.colors, count, 3, owner), column(boxes.opacities, count, 0, owner),
                       column(boxes.ids, count, 0, owner), softness),
        nb::make_tuple(boxes.culled.behind_near, boxes.culled.not_finite, boxes.culled.faint, boxes.culled.outside));
}

template <class T>
void def_project(nb::module_& m) {
    m.def("project", &project<T>, nb::arg("means").noconvert(), nb::arg("quats").noconvert(),
          nb::arg("scales").noconvert(), nb::arg("opacities").noconvert(), nb::arg("sh").noconvert(),
          nb::arg("viewmat").noconvert(), nb::arg("K").noconvert(), nb::arg("width"), nb::arg("height"),
          nb::arg("near"), nb::arg("num_sigmas"), nb::arg("low_pass"), nb::arg("sh_degree"), nb::arg("num_threads"),
          nb::arg("lock"), nb::arg("directions").noconvert().none(), nb::arg("area_scales").noconvert().none(),
          nb::arg("fades"), nb::arg("softness"),
          "Columns of the boxes, nearest first, and the counts (behind_near, not_finite, faint, outside) of the "
          "Gaussians that have none.");
}

template <class Array>
auto data_or_null(const std::optional<Array>& array) {
    return array ? array->data() : nullptr;
}

template <class T>
void project_backward(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                      In<double, 2> viewmat, In<double, 2> K, int width, int height, double near, double num_sigmas,
                      double low_pass, int num_threads, brushgs::Lock lock, std::optional<In<float, 1>> directions,
                      std::optional<In<float, 1>> area_scales, bool fades, In<std::int32_t, 1> ids, In<T, 2> colors,
                      std::optional<In<T, 2>> v_centers, std::optional<In<T, 2>> v_half_extents,
                      std::optional<In<T, 1>> v_angles, std::optional<In<T, 1>> v_depths,
                      std::optional<In<T, 2>> v_colors, std::optional<In<T, 1>> v_opacities,
                      std::optional<Out<T, 2>> v_means, std::optional<Out<T, 2>> v_quats,
                      std::optional<Out<T, 2>> v_scales, std::optional<Out<T, 1>> v_gaussian_opacities,
                      std::optional<Out<T, 3>> v_sh) {
    const brushgs::GaussianColumns<T> gaussians{.means = means.data(),
                                                .quats = quats.data(),
                                                .scales = scales.data(),
                                                .opacities = opacities.data(),
                                                .sh = sh.data(),
                                                .count = means.shape(0),
                                                .sh_terms = sh.shape(1)};
    const std::size_t terms = gaussians.sh_terms;
    const brushgs::ProjectParams params{.view = view_of(viewmat, K, width, height, near),
                                        .num_sigmas = num_sigmas,
                                        .low_pass = low_pass,
                                        .sh_degree = terms == 1 ? 0 : (terms == 4 ? 1 : (terms == 9 ? 2 : 3)),
                                        .num_threads = num_threads,
                                        .lock = lock,
                                        .directions = data_or_null(directions),
                                        .area_scales = data_or_null(area_scales),
                                        .fades = fades,
                                        .softness = 0};
    const brushgs::ProjectedBoxes<T> boxes{.count = ids.shape(0),
                                           .ids = ids.data(),
                                           .colors = colors.data(),
                                           .v_centers = data_or_null(v_centers),
                                           .v_half_extents = data_or_null(v_half_extents),
                                           .v_angles = data_or_null(v_angles),
                                           .v_depths = data_or_null(v_depths),
                                           .v_colors = data_or_null(v_colors),
                                           .v_opacities = data_or_null(v_opacities)};
    const brushgs::GaussianGradients<T> gradients{.means = data_or_null(v_means),
                                                  .quats = data_or_null(v_quats),
                                                  .scales = data_or_null(v_scales),
                                                  .opacities = data_or_null(v_gaussian_opacities),
                                                  .sh = data_or_null(v_sh)};
    const nb::gil_scoped_release without_gil;
    brushgs::project_backward(gaussians, params, boxes, gradients);
}

template <class T>
void def_project_backward(nb::module_& m) {
    m.def("project_backward", &project_backward<T>, "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "viewmat"_a.noconvert(),
          "K"_a.noconvert(), "width"_a, "height"_a, "near"_a, "num_sigmas"_a, "low_pass"_a, "num_threads"_a, "lock"_a,
          "directions"_a.noconvert().none(), "area_scales"_a.noconvert().none(), "fades"_a, "ids"_a.noconvert(),
          "colors"_a.noconvert(), "v_centers"_a.noconvert().none(), "v_half_extents"_a.noconvert().none(),
          "v_angles"_a.noconvert().none(), "v_depths"_a.noconvert().none(), "v_colors"_a.noconvert().none(),
          "v_opacities"_a.noconvert().none(), "v_means"_a.noconvert().none(), "v_quats"_a.noconvert().none(),
          "v_scales"_a.noconvert().none(), "v_gaussian_opacities"_a.noconvert().none(), "v_sh"_a.noconvert().none(),
          "Write the rows with a box of the gradients by Gaussians (those given) of a loss whose gradients by the "
          "boxes are those given; ids and colors as `project` made them, shapes trusted.");
}

template <class T>
nb::tuple track_directions(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<double, 3> viewmats,
                           In<double, 3> Ks, In<double, 1> nears, int width, int height, bool is_closed, double step,
                           double low_pass, int num_threads) {
    const brushgs::GaussianColumns<T> gaussians{.means = means.data(),
                                                .quats = quats.data(),
                                                .scales = scales.data(),
                                                .opacities = opacities.data(),
                                                .sh = nullptr,
                                                .count = means.shape(0),
                                                .sh_terms = 0};
    std::vector<brushgs::View> views(viewmats.shape(0));
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i] = {.viewmat = {},
                    .fx = Ks(i, 0, 0),
                    .fy = Ks(i, 1, 1),
                    .cx = Ks(i, 0, 2),
                    .cy = Ks(i, 1, 2),
                    .width = static_cast<double>(width),
                    .height = static_cast<double>(height),
                    .near = nears(i)};
        std::copy_n(viewmats.data() + 16 * i, 12, views[i].viewmat);
    }
    brushgs::Tracks tracks;
    {
        const nb::gil_scoped_release without_gil;
        tracks = brushgs::track_directions(gaussians, {.views = views.data(),
                                                       .num_views = views.size(),
                                                       .is_closed = is_closed,
                                                       .step = step,
                                                       .low_pass = low_pass,
                                                       .num_threads = num_threads});
    }
    nb::object turns = table(tracks.turns, views.size(), gaussians.count);
    if (!tracks.has_area_scales) return nb::make_tuple(turns, nb::none());
    return nb::make_tuple(turns, table(tracks.area_scales, views.size(), gaussians.count));
}

// An array of shape [count] in memory that becomes its own.
template <class T>
nb::object row(std::unique_ptr<T[]> memory, std::size_t count) {
    T* values = memory.release();
    const nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return column(values, count, 0, owner);
}

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

void filter_rows(In<double, 2> weights, In<double, 2> texels, Out<double, 2> result) {
    const nb::gil_scoped_release without_gil;
    brushgs::filter_rows(weights.data(), texels.data(), weights.shape(0), weights.shape(1), texels.shape(1),
                         result.data());
}

template <class T>
void finish(In<T, 3> rgb, In<T, 2> alpha, nb::ndarray<const T, nb::c_contig, nb::device::cpu> ground,
            Out<std::uint8_t, 3> bytes) {
    const nb::gil_scoped_release without_gil;
    brushgs::finish(rgb.data(), alpha.data(), ground.data(), ground.ndim() == 3, alpha.size(), bytes.data());
}

template <class T>
void def_finish(nb::module_& m) {
    m.def("finish", &finish<T>, "rgb"_a.noconvert(), "alpha"_a.noconvert(), "ground"_a.noconvert(),
          "bytes"_a.noconvert(),
          "Write a picture on a ground, [3] or [H, W, 3], to bytes [H, W, 3]; shapes are trusted.");
}

template <class T>
void def_track_directions(nb::module_& m) {
    m.def("track_directions", &track_directions<T>, "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "viewmats"_a.noconvert(), "Ks"_a.noconvert(),
          "nears"_a.noconvert(), "width"_a, "height"_a, "is_closed"_a, "step"_a, "low_pass"_a, "num_threads"_a,
          "Directions [knots, N] in 2^-16 turns; and the least area of each box [knots, N], in areas of the smallest "
          "box around its ellipse, as octaves times AREA_SCALE_STEPS, or None where none is above 1.");
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

template <class T>
void rasterize(brushgs::Kernel kernel, int num_threads, double min_transmittance, In<T, 2> centers,
               In<T, 2> half_extents, In<T, 1> angles, In<T, 1> depths, In<T, 2> colors, In<T, 1> opacities,
               std::optional<In<T, 1>> softness, const std::vector<In<std::uint16_t, 1>>& pairs,
               In<std::int32_t, 2> sizes, In<double, 2> reaches, In<std::uint16_t, 1> level_of_box, Out<T, 3> rgb,
               Out<T, 2> alpha, std::optional<Out<T, 2>> depth) {
    std::vector<brushgs::Level> levels;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        levels.push_back({pairs[i].data(), sizes(i, 0), sizes(i, 1), reaches(i, 0), reaches(i, 1)});
    brushgs::RasterParams params{};
    params.kernel = kernel;
    params.width = static_cast<int>(rgb.shape(1));
    params.height = static_cast<int>(rgb.shape(0));
    params.num_threads = num_threads;
    params.min_transmittance = min_transmittance;
    params.levels = levels;
    params.level_of_box = {level_of_box.data(), level_of_box.size()};
    const brushgs::BoxView<T> boxes{
        centers.shape(0), centers.data(), half_extents.data(), angles.data(),
        depths.data(),    colors.data(),  opacities.data(),    softness ? softness->data() : nullptr};
    const brushgs::Picture<T> picture{rgb.data(), alpha.data(), depth ? depth->data() : nullptr};
    nb::gil_scoped_release release;
    brushgs::rasterize(params, boxes, picture);
}

template <class T>
void rasterize_backward(brushgs::Kernel kernel, int num_threads, double min_transmittance, In<T, 2> centers,
                        In<T, 2> half_extents, In<T, 1> angles, In<T, 1> depths, In<T, 2> colors, In<T, 1> opacities,
                        const std::vector<In<std::uint16_t, 1>>& pairs, In<std::int32_t, 2> sizes,
                        In<double, 2> reaches, In<std::uint16_t, 1> level_of_box, In<T, 3> rgb, In<T, 2> alpha,
                        std::optional<In<T, 2>> depth, In<T, 3> v_rgb, std::optional<In<T, 2>> v_alpha,
                        std::optional<In<T, 2>> v_depth, Out<T, 2> v_centers, Out<T, 2> v_half_extents,
                        Out<T, 1> v_angles, Out<T, 1> v_depths, Out<T, 2> v_colors, Out<T, 1> v_opacities,
                        const std::vector<Out<double, 2>>& v_texels) {
    std::vector<brushgs::Level> levels;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        levels.push_back({pairs[i].data(), sizes(i, 0), sizes(i, 1), reaches(i, 0), reaches(i, 1)});
    std::vector<double*> texels;
    for (const auto& of_level : v_texels) texels.push_back(of_level.data());
    brushgs::RasterParams params{};
    params.kernel = kernel;
    params.width = static_cast<int>(rgb.shape(1));
    params.height = static_cast<int>(rgb.shape(0));
    params.num_threads = num_threads;
    params.levels = levels;
    params.level_of_box = {level_of_box.data(), level_of_box.size()};
    const brushgs::BoxView<T> boxes{centers.shape(0), centers.data(), half_extents.data(), angles.data(),
                                    depths.data(),    colors.data(),  opacities.data(),    nullptr};
    const brushgs::PictureGradients<T> picture{rgb.data(),   alpha.data(),          data_or_null(depth),
                                               v_rgb.data(), data_or_null(v_alpha), data_or_null(v_depth)};
    const brushgs::BoxGradients<T> gradients{v_centers.data(), v_half_extents.data(), v_angles.data(),
                                             v_depths.data(),  v_colors.data(),       v_opacities.data()};
    const nb::gil_scoped_release without_gil;
    brushgs::rasterize_backward(params, min_transmittance, boxes, picture, gradients, texels);
}

template <class T>
void def_rasterize_backward(nb::module_& m) {
    m.def("rasterize_backward", &rasterize_backward<T>, "kernel"_a, "num_threads"_a, "min_transmittance"_a,
          "centers"_a.noconvert(), "half_extents"_a.noconvert(), "angles"_a.noconvert(), "depths"_a.noconvert(),
          "colors"_a.noconvert(), "opacities"_a.noconvert(), "pairs"_a.noconvert(), "sizes"_a.noconvert(),
          "reaches"_a.noconvert(), "level_of_box"_a.noconvert(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "depth"_a.noconvert().none(), "v_rgb"_a.noconvert(), "v_alpha"_a.noconvert().none(),
          "v_depth"_a.noconvert().none(), "v_centers"_a.noconvert(), "v_half_extents"_a.noconvert(),
          "v_angles"_a.noconvert(), "v_depths"_a.noconvert(), "v_colors"_a.noconvert(), "v_opacities"_a.noconvert(),
          "v_texels"_a.noconvert(),
          "Write the gradients by the boxes, and add to those by the texels of each level (or to none), of a loss "
          "whose gradients by the picture are v_rgb, v_alpha and v_depth; shapes are trusted.");
}

// A vector that becomes a NumPy array without a copy.
template <class T>
auto to_array(std::vector<T>&& values) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owned->data(), {owned->size()}, owner);
}

template <class T>
auto choose_levels(In<T, 2> half_extents, In<double, 1> bounds_u, In<double, 1> bounds_v) {
    brushgs::LevelChoice choice;
    {
        nb::gil_scoped_release release;
        choice = brushgs::choose_levels(half_extents.shape(0), half_extents.data(), {bounds_u.data(), bounds_u.size()},
                                        {bounds_v.data(), bounds_v.size()});
    }
    return std::pair(to_array(std::move(choice.used)), to_array(std::move(choice.of_box)));
}

template <class T>
void def_rasterize(nb::module_& m) {
    m.def("rasterize", &rasterize<T>, "kernel"_a, "num_threads"_a, "min_transmittance"_a, "centers"_a.noconvert(),
          "half_extents"_a.noconvert(), "angles"_a.noconvert(), "depths"_a.noconvert(), "colors"_a.noconvert(),
          "opacities"_a.noconvert(), "softness"_a.noconvert().none(), "pairs"_a.noconvert(), "sizes"_a.noconvert(),
          "reaches"_a.noconvert(), "level_of_box"_a.noconvert(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "depth"_a.noconvert().none(),
          "Paint boxes into rgb, alpha and (or None) depth; shapes as in brushgs.Boxes and brushgs.Frame, and "
          "trusted: brushgs.rasterize checks them.");
    m.def("choose_levels", &choose_levels<T>, "half_extents"_a.noconvert(), "bounds_u"_a.noconvert(),
          "bounds_v"_a.noconvert(),
          "For boxes of half extents [M, 2] the level codes in use, level_u * (len(bounds_v) + 1) + level_v, and "
          "for each box its row among them.");
}

}  // namespace

NB_MODULE(_core, m) {
    m.doc() = "The compiled core of brushgs; use the functions of the package instead.";
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
    m.attr("GAUSSIAN_SIGMAS") = brushgs::kGaussianSigmas;
    m.attr("AREA_SCALE_STEPS") = brushgs::kAreaScaleSteps;
    nb::enum_<brushgs::Kernel>(m, "Kernel", "What a box is filled with.")
        .value("bilinear", brushgs::Kernel::bilinear)
        .value("nearest", brushgs::Kernel::nearest)
        .value("gaussian", brushgs::Kernel::gaussian)
        .value("ellipse", brushgs::Kernel::ellipse);
    nb::enum_<brushgs::Lock>(m, "Lock", "Which way the u axis of a box points.")
        .value("off", brushgs::Lock::off)
        .value("anchor", brushgs::Lock::anchor)
        .value("given", brushgs::Lock::given);
    def_project<float>(m);
    def_project<double>(m);
    def_project_backward<float>(m);
    def_project_backward<double>(m);
    def_track_directions<float>(m);
    def_track_directions<double>(m);
    m.attr("MOST_DIMENSIONS") = brushgs::kMostDimensions;
    m.def("nearest", &nearest, "points"_a.noconvert(), "centers"_a.noconvert(), "num_threads"_a,
          "For points [N, D], D at most MOST_DIMENSIONS, the distance [N] to the nearest of the centers [k, D], and "
          "its row [N] int32, the first of equally near ones.");
    m.def("filter_rows", &filter_rows, "weights"_a.noconvert(), "texels"_a.noconvert(), "result"_a.noconvert(),
          "Write the product of two matrices to a third, summed in order; shapes are trusted.");
    m.def("new_plane_float32", &new_plane<float>, "shape"_a, "An uninitialised array for a frame.");
    m.def("new_plane_float64", &new_plane<double>, "shape"_a, "An uninitialised array for a frame.");
    def_finish<float>(m);
    def_finish<double>(m);
    def_rasterize<float>(m);
    def_rasterize<double>(m);
    def_rasterize_backward<float>(m);
    def_rasterize_backward<double>(m);
}
