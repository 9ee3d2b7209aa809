// What the first view of a scene frames, and crumbs below it. Thresholds and reasons are those of
// brushgs/first_view/surroundings.py, brushgs/first_view/attached.py and brushgs/passes/reduce/crumbs.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "brushgs/first_view.hpp"

namespace brushgs {

struct Bounds {
    double low[3], high[3];

    template <class T>
    bool holds(const T* point) const {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto place = static_cast<double>(point[axis]);
            if (!(place >= low[axis] && place <= high[axis])) return false;
        }
        return true;
    }
};

// Of at least one row of points [., 3].
template <class T>
Bounds bounds_of(const T* points, const std::vector<std::uint32_t>& rows);

// Whether most of what is seen of a scene lies around its middle. `level` [3, 3] are the rows right, down, forward of a
// level view.
template <class T>
bool has_surroundings(const SceneView<T>& scene, const double* level, int num_threads = 1);

// Rows of the dense middle of a scene, which was photographed from near.
template <class T>
std::vector<std::uint32_t> dense_rows(const SceneView<T>& scene);

// Rows outside of the middle of an object that are connected to it by voxels with paint.
template <class T>
std::vector<std::uint32_t> attached_rows(const SceneView<T>& scene, const Bounds& middle);

// The points [count, 3] of a scene to show whole, and whether they have surroundings.
struct Framed {
    std::vector<double> points;
    bool has_surroundings = false;
};
Framed framed_points(const SceneView<float>& scene, const double* level);

// The nearest eye from which all points [count, 3], count >= 1, lie in a picture with a margin, in the axes of its
// camera; and its distance from the middle of their depths. `tangents` [2] are those of half the angles of view.
struct Eye {
    double place[3], distance;
};
Eye fit_eye(const double* points, std::size_t count, const double* tangents);

// Marks [count] of crumbs below an object, whose framed points lie between `foot` and `foot` + `height` along `up` [3],
// in world units, height > 0. None if they would be much of its paint.
template <class T>
std::vector<std::uint8_t> find_crumbs(const SceneView<T>& scene, const double* up, double foot, double height);

}  // namespace brushgs
