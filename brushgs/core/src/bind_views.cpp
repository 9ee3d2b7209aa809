// Python: the subject of a scene, and evidence for its first view.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/first_view.hpp"
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
ViewSample take_view_sample(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh) {
    const nb::gil_scoped_release without_gil;
    return brushgs::take_view_sample<T>({.means = means.data(),
                                         .quats = quats.data(),
                                         .scales = scales.data(),
                                         .opacities = opacities.data(),
                                         .sh = sh.data(),
                                         .count = opacities.size(),
                                         .sh_terms = sh.shape(1)});
}

template <class T>
void def_scenes(nb::module_& m) {
    m.def("find_subject", &find_subject<T>, "means"_a.noconvert(), "opacities"_a.noconvert(), "is_whole"_a,
          "Rows of the subject of a scene, at most MOST_SUBJECT_ROWS, and whether it has surroundings.");
    m.def("take_view_sample", &take_view_sample<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(),
          "The subject of a scene, thinned, for pictures; empty if nothing with extent is visible.");
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
                                    {weights.data(), weights.data() + weights.size()});
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
