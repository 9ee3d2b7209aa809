// Python: the subject of a scene, and evidence for its first view.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/first_view.hpp"
#include "brushgs/framing.hpp"
#include "brushgs/hull.hpp"
#include "brushgs/subject.hpp"

namespace bindings {

namespace {

using Numbers = In<double, 1>;
using brushgs::ViewSample;

std::span<const double> span_of(const Numbers& values) { return {values.data(), values.size()}; }

std::vector<double> weighted_quantiles(const Numbers& values, const Numbers& weights, const std::vector<double>& at) {
    return brushgs::weighted_quantiles(span_of(values), span_of(weights), at);
}

auto thinned(std::size_t count, std::size_t most) { return to_array(brushgs::thinned(count, most)); }

nb::object heaviest_clump(In<double, 2> points, const Numbers& weights) {
    const brushgs::Clump found = brushgs::heaviest_clump(points.data(), span_of(weights));
    if (!found.is_part()) return nb::none();
    return nb::make_tuple(std::to_array(found.low), std::to_array(found.high));
}

template <class T>
nb::tuple find_subject(In<T, 2> means, In<T, 1> opacities, bool is_whole) {
    brushgs::Subject found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_subject(means.data(), opacities.data(), opacities.size(), is_whole);
    }
    return nb::make_tuple(to_array(std::move(found.rows)), found.has_surroundings);
}

template <class T>
brushgs::SceneView<T> view_of(const In<T, 2>& means, const In<T, 2>& quats, const In<T, 2>& scales,
                              const In<T, 1>& opacities, const In<T, 3>& sh) {
    return {.means = means.data(),
            .quats = quats.data(),
            .scales = scales.data(),
            .opacities = opacities.data(),
            .sh = sh.data(),
            .count = opacities.size(),
            .sh_terms = sh.shape(1)};
}

template <class T>
ViewSample take_view_sample(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh) {
    const nb::gil_scoped_release without_gil;
    return brushgs::take_view_sample<T>(view_of<T>(means, quats, scales, opacities, sh));
}

using Triple = std::array<double, 3>;

template <class T>
bool has_surroundings(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                      const std::array<double, 9>& level, int num_threads) {
    const nb::gil_scoped_release without_gil;
    return brushgs::has_surroundings<T>(view_of<T>(means, quats, scales, opacities, sh), level.data(), num_threads);
}

template <class T>
auto dense_rows(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh) {
    return to_array(brushgs::dense_rows<T>(view_of<T>(means, quats, scales, opacities, sh)));
}

template <class T>
auto attached_rows(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, const Triple& low,
                   const Triple& high) {
    return to_array(brushgs::attached_rows<T>(view_of<T>(means, quats, scales, opacities, sh),
                                              {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}}));
}

template <class T>
auto find_crumbs(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, const Triple& up,
                 double foot, double height) {
    return to_array(brushgs::find_crumbs<T>(view_of<T>(means, quats, scales, opacities, sh), up.data(), foot, height));
}

nb::tuple fit_eye(In<double, 2> points, const std::array<double, 2>& tangents) {
    const brushgs::Eye eye = brushgs::fit_eye(points.data(), points.shape(0), tangents.data());
    return nb::make_tuple(std::to_array(eye.place), eye.distance);
}

auto hull_rows(In<double, 2> points, const std::array<std::uint32_t, 4>& simplex, std::size_t most, double thickness) {
    std::vector<std::int64_t> found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::hull_rows(points.data(), simplex, points.shape(0), most, thickness);
    }
    return to_array(std::move(found));
}

template <class T>
void def_scenes(nb::module_& m) {
    m.def("find_subject", &find_subject<T>, "means"_a.noconvert(), "opacities"_a.noconvert(), "is_whole"_a,
          "Rows of the subject of a scene, at most MOST_SUBJECT_ROWS, and whether it has surroundings.");
    m.def("take_view_sample", &take_view_sample<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(),
          "The subject of a scene, thinned, for pictures; empty if nothing with extent is visible.");
    m.def("has_surroundings", &has_surroundings<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "level"_a, "num_threads"_a,
          "Whether most of what is seen of a scene lies around its middle; level: the axes of a level view [9].");
    m.def("dense_rows", &dense_rows<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(),
          "Rows of the dense middle of a scene.");
    m.def("attached_rows", &attached_rows<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "low"_a, "high"_a,
          "Rows outside of a box that voxels with paint connect to it.");
    m.def("find_crumbs", &find_crumbs<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "up"_a, "foot"_a, "height"_a,
          "Marks [N], 1 or 0, of the crumbs below an object that stands at `foot`.");
}

nb::dict measure_up(const ViewSample& sample, int num_threads) {
    const auto values = brushgs::measure_up(sample, num_threads);
    nb::dict by_name;
    for (std::size_t kind = 0; kind < values.size(); ++kind) by_name[brushgs::kEvidence[kind].name] = values[kind];
    return by_name;
}

nb::tuple find_front(const ViewSample& sample, const std::array<double, 9>& level, int num_threads) {
    const auto front = brushgs::find_front(sample, level.data(), num_threads);
    return nb::make_tuple(front.azimuth, front.lean, front.margin, front.likeness);
}

auto mirror_likeness(In<double, 2> places, const Numbers& weights) {
    return brushgs::mirror_likeness({places.data(), places.data() + places.size()},
                                    {weights.data(), weights.data() + weights.size()}, 1);
}

}  // namespace

void bind_views(nb::module_& m) {
    m.attr("MOST_SUBJECT_ROWS") = brushgs::kMostSubjectRows;
    m.attr("UP_PRIORS") = brushgs::kUpPriors;
    m.attr("CLUMP_TAIL") = brushgs::kTail;
    m.attr("ELEVATION") = brushgs::kElevation;
    m.attr("FLAT_ELEVATION") = brushgs::kFlatElevation;
    m.attr("FLAT_HEIGHT") = brushgs::kFlatHeight;
    m.attr("FRONT_MARGIN") = brushgs::kFrontMargin;
    m.attr("FRONT_LEAN") = brushgs::kLean;
    m.def("default_elevation", &brushgs::default_elevation, "width"_a, "height"_a, "depth"_a,
          "Elevation of the first view of a subject, radians.");
    m.def("weighted_quantiles", &weighted_quantiles, "values"_a.noconvert(), "weights"_a.noconvert(), "at"_a,
          "Values [N] at shares of the weight [N].");
    m.def("thinned", &thinned, "count"_a, "most"_a, "At most `most` of `count` row numbers, one per equal part.");
    m.def("heaviest_clump", &heaviest_clump, "points"_a.noconvert(), "weights"_a.noconvert(),
          "Low and high corner of the space with the heaviest clump of points [N, 3]; None if there is only one.");
    m.def("fit_eye", &fit_eye, "points"_a.noconvert(), "tangents"_a,
          "The nearest eye [3] from which all points [N, 3] lie in the picture, and its distance; in camera axes.");
    m.def("hull_rows", &hull_rows, "points"_a.noconvert(), nb::kw_only(), "simplex"_a, "most"_a, "thickness"_a,
          "Ascending rows of the vertices of the convex hull of points [N, 3], at most `most`, see hull.hpp.");
    def_scenes<float>(m);
    def_scenes<double>(m);
    nb::class_<ViewSample>(m, "ViewSample", "Gaussians for pictures of a subject, in radii around its middle.")
        .def_ro("count", &ViewSample::count, "Rows after thinning.")
        .def_ro("num_rows", &ViewSample::num_rows, "Rows before thinning.");
    const auto without_gil = nb::call_guard<nb::gil_scoped_release>();
    m.def("measure_up", &measure_up, "sample"_a, "num_threads"_a, "The values of each kind of evidence, by name.");
    m.def("up_evidence", &brushgs::up_evidence, "sample"_a, "num_threads"_a, without_gil,
          "Log odds that each of +x, +y, +z, -x, -y, -z is up, without priors.");
    m.def("up_chances", &brushgs::up_chances, "sample"_a, "num_threads"_a, without_gil,
          "The probability that each axis is up; of an empty sample that of the priors.");
    m.def("believed_axis", &brushgs::believed_axis, "chances"_a, "The axis to take, by such probabilities.");
    m.def("find_front", &find_front, "sample"_a, "level"_a, "num_threads"_a,
          "Azimuth of the front, lean, margin and likeness, see `Front`; level: the axes of a level view [9].");
    m.def("mirror_likeness", &mirror_likeness, "places"_a.noconvert(), "weights"_a.noconvert(),
          "Overlap of places [N, 3] with their mirror image, for each plane.");
}

}  // namespace bindings
