// Gaussians in the world -> oriented boxes on the image plane, nearest first.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/memory.hpp"

namespace brushgs {

template <class T>
struct GaussianColumns {
    const T* means;      // [count, 3] world units
    const T* quats;      // [count, 4] w, x, y, z; any length above zero
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    const T* sh;         // [count, sh_terms, 3]
    std::size_t count;
    std::size_t sh_terms;  // stored per Gaussian: 1, 4, 9 or 16
};

// One pinhole camera.
struct View {
    double viewmat[12];    // camera from world, the first three rows of [4, 4]
    double fx, fy;         // focal lengths, pixels
    double cx, cy;         // principal point, pixels
    double width, height;  // pixels
    double near;           // world units: camera z at or below it is culled
};

// The direction of the u axis of a box.
enum class Lock {
    off,     // along the major axis of the ellipse, which is known up to half a turn
    anchor,  // the half turn settled by the longest axis of the Gaussian, see anchor_direction
    given,   // as `directions` says
};

struct ProjectParams {
    View view;
    double num_sigmas;            // half extent of a box in standard deviations
    const double* sigmas_of_row;  // [count] the same of each Gaussian, in place of num_sigmas; or null
    double low_pass;              // added to the projected covariance, pixels squared
    int sh_degree;                // terms evaluated: 0 to 3, at most those stored
    int num_threads;
    Lock lock;
    const float* directions;   // [count] radians, for Lock::given
    const float* area_scales;  // [count] least area of boxes in areas of the smallest, for Lock::given; or null
    bool antialiased;          // whether opacities fall by what the low-pass adds to the area, see compensation_of
    bool fades;                // whether strokes fade that would otherwise appear or vanish, see fade_of
    bool with_setbacks;        // whether boxes have the size of their Gaussian, by which underpaint lies behind
    double softness;           // depth over which two strokes hide each other in part, in sizes of a stroke; 0: none
};

// Why Gaussians have no box; each is counted once, under the first reason that holds.
struct ProjectCounts {
    std::size_t behind_near = 0;  // camera z <= near
    std::size_t not_finite = 0;   // some value of the box does not fit the scalar
    std::size_t faint = 0;        // opacity under 1/255: the rasterizer would skip every fragment
    std::size_t outside = 0;      // no common area with the image
};

// One box on its way through the sort; the fields of `Boxes` in brushgs/values/boxes.py.
template <class T>
struct BoxRecord {
    T center[2], half_extents[2], angle, depth, color[3], opacity;
    std::int32_t id;
};

// The columns of `Boxes`, each of exactly `count` rows, in one piece of memory.
template <class T>
struct BoxColumns {
    std::size_t count = 0;
    T *centers, *half_extents, *angles, *depths, *colors, *opacities;
    std::int32_t* ids;
    T* softness;  // or null, where the parameter `softness` is 0
    T* setbacks;  // or null
    Buffer<std::byte> memory;
    ProjectCounts culled;
};

// The boxes of all Gaussians that can paint, by depth, ties by row. The result does not depend on
// `num_threads`, bit for bit. There must be fewer than 2^31 Gaussians.
template <class T>
BoxColumns<T> project(const GaussianColumns<T>& gaussians, const ProjectParams& params);

}  // namespace brushgs
