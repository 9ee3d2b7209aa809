// The only file that knows Python: it translates arrays to spans and back, and releases the GIL.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "brushgs/cpu.hpp"
#include "brushgs/raster.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T, std::size_t rank>
using In = nb::ndarray<const T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;
template <class T, std::size_t rank>
using Out = nb::ndarray<T, nb::ndim<rank>, nb::c_contig, nb::device::cpu>;


template <class T>
void rasterize(brushgs::Kernel kernel, int num_threads, In<T, 2> centers, In<T, 2> half_extents, In<T, 1> angles,
               In<T, 1> depths, In<T, 2> colors, In<T, 1> opacities, const std::vector<In<std::uint16_t, 1>>& pairs,
               In<std::int32_t, 2> sizes, In<double, 2> reaches, In<std::uint16_t, 1> level_of_box, Out<T, 3> rgb, Out<T, 2> alpha,
               std::optional<Out<T, 2>> depth) {
    std::vector<brushgs::Level> levels;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        levels.push_back({pairs[i].data(), sizes(i, 0), sizes(i, 1), reaches(i, 0), reaches(i, 1)});
    brushgs::RasterParams params{};
    params.kernel = kernel;
    params.width = static_cast<int>(rgb.shape(1));
    params.height = static_cast<int>(rgb.shape(0));
    params.num_threads = num_threads;
    params.levels = levels;
    params.level_of_box = {level_of_box.data(), level_of_box.size()};
    const brushgs::BoxColumns<T> boxes{centers.shape(0), centers.data(), half_extents.data(), angles.data(),
                                       depths.data(),    colors.data(),  opacities.data()};
    const brushgs::Picture<T> picture{rgb.data(), alpha.data(), depth ? depth->data() : nullptr};
    nb::gil_scoped_release release;
    brushgs::rasterize(params, boxes, picture);
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
        choice = brushgs::choose_levels(half_extents.shape(0), half_extents.data(),
                                        {bounds_u.data(), bounds_u.size()}, {bounds_v.data(), bounds_v.size()});
    }
    return std::pair(to_array(std::move(choice.used)), to_array(std::move(choice.of_box)));
}

template <class T>
void bind_rasterize(nb::module_& m) {
    m.def("rasterize", &rasterize<T>, "kernel"_a, "num_threads"_a, "centers"_a.noconvert(),
          "half_extents"_a.noconvert(), "angles"_a.noconvert(), "depths"_a.noconvert(), "colors"_a.noconvert(),
          "opacities"_a.noconvert(), "pairs"_a.noconvert(), "sizes"_a.noconvert(), "reaches"_a.noconvert(), "level_of_box"_a.noconvert(),
          "rgb"_a.noconvert(), "alpha"_a.noconvert(), "depth"_a.noconvert().none(),
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
    m.def("isa", [] { return brushgs::isa_name(brushgs::best_isa()); },
          "Name of the instruction set in use: avx512, avx2 or baseline.");
    nb::enum_<brushgs::Kernel>(m, "Kernel", "What a box is filled with.")
        .value("bilinear", brushgs::Kernel::bilinear)
        .value("nearest", brushgs::Kernel::nearest)
        .value("gaussian", brushgs::Kernel::gaussian)
        .value("ellipse", brushgs::Kernel::ellipse);
    bind_rasterize<float>(m);
    bind_rasterize<double>(m);
}
