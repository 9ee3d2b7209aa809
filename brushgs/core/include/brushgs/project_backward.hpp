// The derivative of `project`: from the gradient of a loss by the boxes to that by the Gaussians.
//
// Every box is computed once more from its Gaussian; a column without a gradient counts as zeros.
#pragma once

#include "brushgs/project.hpp"

namespace brushgs {

// M boxes as `project` made them, and the gradients of the loss by them; layout as in brushgs.Boxes.
template <class T>
struct ProjectedBoxes {
    std::size_t count;        // M
    const std::int32_t* ids;  // [M]
    const T* colors;          // [M, 3]: a channel that was clamped to 0 has no gradient
    const T* v_centers;       // [M, 2]; this and those below: or null for zeros
    const T* v_half_extents;  // [M, 2]
    const T* v_angles;        // [M]
    const T* v_depths;        // [M]
    const T* v_colors;        // [M, 3]
    const T* v_opacities;     // [M]
};

// Gradients by the Gaussians; rows without a box get zeros. Null: not computed.
template <class T>
struct GaussianGradients {
    T* means;      // [count, 3]
    T* quats;      // [count, 4]
    T* scales;     // [count, 3]
    T* opacities;  // [count]
    T* sh;         // [count, sh_terms, 3]
};

// `params` as for `project`, but that `sh_degree` should be the one stored: terms that are all zero have a gradient.
template <class T>
void project_backward(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                      const GaussianGradients<T>& gradients);

constexpr std::uint32_t kNoBox = 0xFFFFFFFF;  // of a Gaussian that has none, or whose box has zeros only

// Implemented once per instruction set, in project_backward_kernel.cpp: the Gaussians [begin, end). `box_of_row` has
// the box of each of them, or kNoBox.
#define BRUSHGS_DECLARE_PROJECT_BACKWARD(isa)                                                              \
    namespace isa {                                                                                        \
    template <class T>                                                                                     \
    void project_backward_rows(const GaussianColumns<T>& gaussians, const ProjectParams& params,           \
                               const ProjectedBoxes<T>& boxes, const std::uint32_t* box_of_row,            \
                               const GaussianGradients<T>& gradients, std::size_t begin, std::size_t end); \
    }
BRUSHGS_DECLARE_PROJECT_BACKWARD(in_double)
BRUSHGS_DECLARE_PROJECT_BACKWARD(baseline)
BRUSHGS_DECLARE_PROJECT_BACKWARD(avx2)
BRUSHGS_DECLARE_PROJECT_BACKWARD(avx512)
#undef BRUSHGS_DECLARE_PROJECT_BACKWARD

}  // namespace brushgs
