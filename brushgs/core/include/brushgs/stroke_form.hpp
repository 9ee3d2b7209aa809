// Strokes -> the same, turned within their own plane along the form they depict. brushgs/passes/form/orient.py says
// what that means and why.
//
// A direction without sign at an angle t from the long axis of a stroke is the pair w (cos 2t, sin 2t) with weight w.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

struct Pair {
    double x = 0, y = 0;
};

// What is perpendicular to the shortest axis of a stroke.
struct StrokePlane {
    double mean[3];                         // world units
    double along[3], across[3], normal[3];  // unit: the longest, middle and shortest axis
    std::array<std::size_t, 3> order;       // their columns in the rotation matrix
    double scales[3];                       // standard deviations in that order, world units
    double size;                            // geometric mean of the first two
    double aspect;                          // their ratio, >= 1: infinite where the second is 0, 1 where both are
};

// Strokes and their nearest others.
struct StrokeForm {
    std::vector<StrokePlane> planes;  // [count]
    std::vector<std::int32_t> rows;   // [count, num_neighbors]
    std::vector<double> weights;      // likewise, sum 1 or 0: more for neighbors of the same plane and color that are
                                      // not smaller
    std::size_t num_neighbors;        // 10, or count - 1 if that is less
    int num_threads;                  // of which no result depends

    std::size_t count() const { return planes.size(); }
};

template <class T>
struct FormQuery {
    const T* means;   // [count, 3] world units
    const T* quats;   // [count, 4] w, x, y, z; any length above zero
    const T* scales;  // [count, 3] standard deviations, world units
    const T* sh;      // [count, sh_terms, 3]
    std::size_t count, sh_terms;
    const double* xyz_over_white;  // [3, 3] of linear light
    int num_threads;
};

template <class T>
StrokeForm form_of(const FormQuery<T>& strokes);

// Columns [count, width], repeatedly averaged with the weighted mean of the neighbors' values.
void smooth(const StrokeForm& form, std::size_t width, double* values);

// Directions [count, 3], flipped to agree with those of neighbors, starting from `headings` [count, 3]: those that are
// zero, or all if null, are replaced by a default. A stroke image runs from left to right along the longest axis, in
// the sign of the quaternion's matrix: the anchor direction of the lock.
void agree(const StrokeForm& form, const double* headings, double* directions);

// The Gaussians of strokes, for the colors of the surface.
template <class T>
struct SurfaceQuery {
    const T *means, *scales, *opacities, *sh;  // see GaussianColumns
    std::size_t count, sh_terms;
    const double* xyz_over_white;  // [3, 3] of linear light
};

// The directions of a field before smoothing; the weights are sums of those of the pairs.
struct FormField {
    std::vector<Pair> pairs;      // [count]
    std::vector<double> weights;  // [count]
};

// By color alone: along lines of equal color. Else also along slender strokes nearby, least curvature, and the extent
// of the surface.
template <class T>
FormField form_field(const StrokeForm& form, const SurfaceQuery<T>& gaussians, bool by_color_alone);

// Largest aspect of turned strokes. Measured with flat and impasto at 6000 strokes on five scenes: 1.8 to 2.2 are
// within 0.02 dB of each other, 2.6 loses 0.03.
constexpr double kFormAspect = 2.2;

// What the user requests beside the field, which already contains the directions; [count] each, all or none.
struct Requested {
    const double* say = nullptr;       // 0 to 1, share of the requested direction
    const double* aspects = nullptr;   // largest aspect of turned strokes, in place of kFormAspect
    const double* marked = nullptr;    // 0 to 1, how far marks apply; such strokes may get as thin as they are wide
    const double* headings = nullptr;  // [count, 3] see `agree`
};

// Smooths pairs [count, 2] and weights [count], and writes the strokes' new rotations and scales; `quats` are their
// own.
template <class T>
void turn_strokes(const StrokeForm& form, const Pair* pairs, const double* weights, const Requested& requested,
                  const T* quats, T* turned_quats, T* turned_scales);

}  // namespace brushgs
