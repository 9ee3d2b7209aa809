// What the files that translate between Python and the core share: kinds of arrays, and arrays that own their memory.
//
// These files, bind_*.cpp and bindings.cpp, are the only ones that know Python: they translate arrays to spans and
// back, and release the GIL. Arguments that could be confused are passed by name. Shapes are trusted: the functions of
// the package check them first. Arrays are not converted: an output of another dtype would be replaced by a copy and
// lost.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "brushgs/frame_pool.hpp"
#include "brushgs/memory.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace bindings {

void bind_boxes(nb::module_& m);   // bind_boxes.cpp
void bind_form(nb::module_& m);    // bind_form.cpp
void bind_layers(nb::module_& m);  // bind_layers.cpp
void bind_looks(nb::module_& m);   // bind_looks.cpp
void bind_rows(nb::module_& m);    // bind_rows.cpp
void bind_stage(nb::module_& m);   // bind_stage.cpp
void bind_views(nb::module_& m);   // bind_views.cpp

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
inline nb::object matrices(brushgs::Buffer<double>& memory, std::size_t count) {
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

}  // namespace bindings
