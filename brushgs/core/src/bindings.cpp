// The only file that knows Python: it translates arrays to spans and back, and releases the GIL.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>

#include "brushgs/cpu.hpp"
#include "brushgs/project.hpp"

namespace nb = nanobind;

namespace {

// A C-contiguous NumPy array that is read; the Python layer has checked the shapes.
template <class T, int ndim>
using Input = nb::ndarray<const T, nb::ndim<ndim>, nb::c_contig, nb::device::cpu>;

// Hands memory over to a NumPy array of shape [rows, width], or [rows] where width is 0.
template <class T>
nb::object to_numpy(std::unique_ptr<T[]> values, std::size_t rows, std::size_t width = 0) {
    const nb::capsule owner(values.get(), [](void* p) noexcept { delete[] static_cast<T*>(p); });
    const std::size_t shape[2] = {rows, width};
    return nb::cast(nb::ndarray<nb::numpy, T>(values.release(), width == 0 ? 1 : 2, shape, owner));
}

template <class T>
nb::tuple project(Input<T, 2> means, Input<T, 2> quats, Input<T, 2> scales, Input<T, 1> opacities, Input<T, 3> sh,
                  Input<double, 2> viewmat, Input<double, 2> K, int width, int height, double near,
                  double num_sigmas, double low_pass, int sh_degree, int num_threads) {
    const brushgs::GaussianColumns<T> gaussians{means.data(),     quats.data(), scales.data(), opacities.data(),
                                                sh.data(),        means.shape(0), sh.shape(1)};
    brushgs::ProjectParams params{.viewmat = {},
                                  .fx = K(0, 0),
                                  .fy = K(1, 1),
                                  .cx = K(0, 2),
                                  .cy = K(1, 2),
                                  .width = static_cast<double>(width),
                                  .height = static_cast<double>(height),
                                  .near = near,
                                  .num_sigmas = num_sigmas,
                                  .low_pass = low_pass,
                                  .sh_degree = sh_degree,
                                  .num_threads = num_threads};
    std::copy_n(viewmat.data(), 12, params.viewmat);
    brushgs::BoxColumns<T> boxes;
    {
        const nb::gil_scoped_release without_gil;
        boxes = brushgs::project(gaussians, params);
    }
    const auto& culled = boxes.culled;
    return nb::make_tuple(
        nb::make_tuple(to_numpy(std::move(boxes.centers), boxes.count, 2),
                       to_numpy(std::move(boxes.half_extents), boxes.count, 2),
                       to_numpy(std::move(boxes.angles), boxes.count), to_numpy(std::move(boxes.depths), boxes.count),
                       to_numpy(std::move(boxes.colors), boxes.count, 3),
                       to_numpy(std::move(boxes.opacities), boxes.count), to_numpy(std::move(boxes.ids), boxes.count)),
        nb::make_tuple(culled.behind_near, culled.not_finite, culled.faint, culled.outside));
}

template <class T>
void def_project(nb::module_& m) {
    m.def("project", &project<T>, nb::arg("means").noconvert(), nb::arg("quats").noconvert(),
          nb::arg("scales").noconvert(), nb::arg("opacities").noconvert(), nb::arg("sh").noconvert(),
          nb::arg("viewmat").noconvert(), nb::arg("K").noconvert(), nb::arg("width"), nb::arg("height"),
          nb::arg("near"), nb::arg("num_sigmas"), nb::arg("low_pass"), nb::arg("sh_degree"), nb::arg("num_threads"),
          "Columns of the boxes, nearest first, and the counts (behind_near, not_finite, faint, outside) of the "
          "Gaussians that have none.");
}

}  // namespace

NB_MODULE(_core, m) {
    m.doc() = "The compiled core of brushgs; use the functions of the package instead.";
    m.def("isa", [] { return brushgs::isa_name(brushgs::best_isa()); },
          "Name of the instruction set in use: avx512, avx2 or baseline.");
    def_project<float>(m);
    def_project<double>(m);
}
