// Python: colors and brushes of looks.
#include <nanobind/stl/array.h>

#include "bindings.hpp"
#include "brushgs/look_colors.hpp"
#include "brushgs/stroke_brushes.hpp"

namespace bindings {

namespace {

using Matrix = In<double, 2>;
using Pair = std::array<double, 2>;
using Rows = std::vector<std::uint8_t>;

template <class T>
void grade(double chroma, double contrast, double pivot, const Pair& shadows, const Pair& lights, Matrix cones_from_rgb,
           Matrix lab_from_roots, Out<T, 3> sh) {
    const nb::gil_scoped_release without_gil;
    brushgs::grade<T>({chroma, contrast, pivot, shadows, lights}, cones_from_rgb.data(), lab_from_roots.data(),
                      sh.shape(0), sh.shape(1), sh.data());
}

template <class T>
void mix_pigments(In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh, Matrix cones_from_rgb, Matrix lab_from_roots,
                  std::size_t num_pigments, double share, In<double, 1> draws, int num_steps, double gain,
                  int num_threads, Out<double, 2> rgb) {
    const nb::gil_scoped_release without_gil;
    brushgs::mix_pigments<T>({scales.data(), opacities.data(), sh.data(), scales.shape(0), sh.shape(1),
                              cones_from_rgb.data(), lab_from_roots.data()},
                             {num_pigments, share, draws.data(), num_steps, gain, num_threads}, rgb.data());
}

template <class T>
brushgs::BrushedStrokes<T> strokes_of(const In<T, 2>& means, const In<T, 2>& quats, const In<T, 2>& scales,
                                      const In<T, 1>& opacities, const In<T, 3>& sh, const Matrix& cones_from_rgb,
                                      const Matrix& lab_from_roots, int num_threads) {
    return {means.data(),   quats.data(), scales.data(),         opacities.data(),      sh.data(),
            means.shape(0), sh.shape(1),  cones_from_rgb.data(), lab_from_roots.data(), num_threads};
}

template <class T>
nb::tuple surfaces_of(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                      Matrix cones_from_rgb, Matrix lab_from_roots, int num_threads) {
    brushgs::Surfaces found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::surfaces_of(
            strokes_of(means, quats, scales, opacities, sh, cones_from_rgb, lab_from_roots, num_threads));
    }
    return nb::make_tuple(to_array(std::move(found.roughness)), to_array(std::move(found.smooth)),
                          to_array(std::move(found.rough)));
}

template <class T>
auto choose_brushes(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<T, 1> opacities, In<T, 3> sh,
                    Matrix cones_from_rgb, Matrix lab_from_roots, int num_threads, const std::array<Rows, 6>& rows,
                    double material, std::uint64_t seed) {
    std::vector<std::uint8_t> found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::choose_brushes(
            strokes_of(means, quats, scales, opacities, sh, cones_from_rgb, lab_from_roots, num_threads),
            {rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]}, material, seed);
    }
    return to_array(std::move(found));
}

template <class T>
void def_looks(nb::module_& m) {
    m.def("grade", &grade<T>, nb::kw_only(), "chroma"_a, "contrast"_a, "pivot"_a, "shadows"_a, "lights"_a,
          "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(), "sh"_a.noconvert(),
          "Shift the base colors in sh [k, terms, 3] of strokes, see look_colors.hpp.");
    m.def("mix_pigments", &mix_pigments<T>, nb::kw_only(), "scales"_a.noconvert(), "opacities"_a.noconvert(),
          "sh"_a.noconvert(), "cones_from_rgb"_a.noconvert(), "lab_from_roots"_a.noconvert(), "num_pigments"_a,
          "share"_a, "draws"_a.noconvert(), "num_steps"_a, "gain"_a, "num_threads"_a, "rgb"_a.noconvert(),
          "Write the colors [k, 3] of strokes, mixed of few pigments, see look_colors.hpp.");
    m.def("surfaces_of", &surfaces_of<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "cones_from_rgb"_a.noconvert(),
          "lab_from_roots"_a.noconvert(), "num_threads"_a,
          "Roughness of the surface around each stroke, and how far it is smooth and light, and rough; [k] each.");
    m.def("choose_brushes", &choose_brushes<T>, nb::kw_only(), "means"_a.noconvert(), "quats"_a.noconvert(),
          "scales"_a.noconvert(), "opacities"_a.noconvert(), "sh"_a.noconvert(), "cones_from_rgb"_a.noconvert(),
          "lab_from_roots"_a.noconvert(), "num_threads"_a, "rows"_a, "material"_a, "seed"_a,
          "The brush [k] of each stroke; rows: those for long, short, other and large strokes, smooth and rough "
          "surfaces.");
}

}  // namespace

void bind_looks(nb::module_& m) {
    def_looks<float>(m);
    def_looks<double>(m);
}

}  // namespace bindings
