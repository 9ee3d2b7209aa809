// Python: strokes along the form they depict.
#include <algorithm>

#include "bindings.hpp"
#include "brushgs/stroke_form.hpp"
#include "brushgs/turn_rates.hpp"

namespace bindings {

namespace {

using brushgs::FormField;
using brushgs::Pair;
using brushgs::StrokeForm;
using Numbers = std::optional<In<double, 1>>;

template <class T>
StrokeForm form_of(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 3> sh, In<double, 2> xyz_over_white,
                   int num_threads) {
    const nb::gil_scoped_release without_gil;
    return brushgs::form_of(brushgs::FormQuery<T>{.means = means.data(),
                                                  .quats = quats.data(),
                                                  .scales = scales.data(),
                                                  .sh = sh.data(),
                                                  .count = means.shape(0),
                                                  .sh_terms = sh.shape(1),
                                                  .xyz_over_white = xyz_over_white.data(),
                                                  .num_threads = num_threads});
}

template <class T>
void form_field(const StrokeForm& form, In<T, 2> means, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                In<double, 2> xyz_over_white, bool by_color_alone, Out<double, 2> pairs, Out<double, 1> weights) {
    const nb::gil_scoped_release without_gil;
    const FormField field = brushgs::form_field(form,
                                                brushgs::SurfaceQuery<T>{.means = means.data(),
                                                                         .scales = scales.data(),
                                                                         .opacities = opacities.data(),
                                                                         .sh = sh.data(),
                                                                         .count = opacities.size(),
                                                                         .sh_terms = sh.shape(1),
                                                                         .xyz_over_white = xyz_over_white.data()},
                                                by_color_alone);
    for (std::size_t i = 0; i < form.count(); ++i)
        pairs.data()[2 * i] = field.pairs[i].x, pairs.data()[2 * i + 1] = field.pairs[i].y;
    std::ranges::copy(field.weights, weights.data());
}

template <class T>
void turn_strokes(const StrokeForm& form, In<double, 2> pairs, In<double, 1> weights, const Numbers& say,
                  const Numbers& aspects, const Numbers& marked, const std::optional<In<double, 2>>& headings,
                  In<T, 2> quats, Out<T, 2> turned_quats, Out<T, 2> turned_scales) {
    const brushgs::Requested requested{.say = data_or_null(say),
                                       .aspects = data_or_null(aspects),
                                       .marked = data_or_null(marked),
                                       .headings = data_or_null(headings)};
    const nb::gil_scoped_release without_gil;
    std::vector<Pair> given(form.count());
    for (std::size_t i = 0; i < form.count(); ++i) given[i] = {pairs.data()[2 * i], pairs.data()[2 * i + 1]};
    brushgs::turn_strokes(form, given.data(), weights.data(), requested, quats.data(), turned_quats.data(),
                          turned_scales.data());
}

void smooth(const StrokeForm& form, Out<double, 2> values) {
    const nb::gil_scoped_release without_gil;
    brushgs::smooth(form, values.shape(1), values.data());
}

void agree(const StrokeForm& form, Out<double, 2> directions) {
    const nb::gil_scoped_release without_gil;
    brushgs::agree(form, nullptr, directions.data());
}

template <class T>
void def_strokes(nb::module_& m) {
    m.def("form_of", &form_of<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(), "scales"_a.noconvert(),
          "sh"_a.noconvert(), "xyz_over_white"_a.noconvert(), "num_threads"_a, "Planes and neighbors of strokes.");
    m.def("form_field", &form_field<T>, "form"_a, nb::kw_only(), "means"_a.noconvert(), "scales"_a.noconvert(),
          "opacities"_a.noconvert(), "sh"_a.noconvert(), "xyz_over_white"_a.noconvert(), "by_color_alone"_a,
          "pairs"_a.noconvert(), "weights"_a.noconvert(),
          "Write the directions of strokes, pairs [k, 2] and weights [k], by the Gaussians they were made of.");
    m.def("turn_strokes", &turn_strokes<T>, "form"_a, nb::kw_only(), "pairs"_a.noconvert(), "weights"_a.noconvert(),
          "say"_a.noconvert() = nb::none(), "aspects"_a.noconvert() = nb::none(), "marked"_a.noconvert() = nb::none(),
          "headings"_a.noconvert() = nb::none(), "quats"_a.noconvert(), "turned_quats"_a.noconvert(),
          "turned_scales"_a.noconvert(),
          "Write quats and scales of strokes turned along smoothed directions, see stroke_form.hpp.");
}

void turn_rates(In<float, 3> toward, In<float, 2> weights, In<double, 3> facing, double most, Out<double, 2> rates,
                int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::turn_rates({.toward = toward.data(),
                         .weights = weights.data(),
                         .facing = facing.data(),
                         .num_views = weights.shape(0),
                         .num_strokes = weights.shape(1),
                         .num_candidates = facing.shape(0),
                         .most = most,
                         .num_threads = num_threads,
                         .rates = rates.data()});
}

}  // namespace

void bind_form(nb::module_& m) {
    m.attr("FORM_ASPECT") = brushgs::kFormAspect;
    nb::class_<StrokeForm>(m, "StrokeForm", "Strokes with their planes and their nearest others.");
    def_strokes<float>(m);
    def_strokes<double>(m);
    m.def("smooth", &smooth, "form"_a, "values"_a.noconvert(),
          "Average columns [k, w] repeatedly with the mean of the neighbors.");
    m.def("agree", &agree, "form"_a, "directions"_a.noconvert(),
          "Flip directions [k, 3] so that they agree with their neighbors.");
    m.def("turn_rates", &turn_rates, nb::kw_only(), "toward"_a.noconvert(), "weights"_a.noconvert(),
          "facing"_a.noconvert(), "most"_a, "rates"_a.noconvert(), "num_threads"_a,
          "Write how fast directions turn [C, N] for candidates [C, 3, N], with views [3, K, N]; see turn_rates.hpp.");
}

}  // namespace bindings
