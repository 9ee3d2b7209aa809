// The kernel of `project`, once per instruction set.
#pragma once

#include "brushgs/project.hpp"

namespace brushgs {

// `project_rows` writes the boxes of the Gaussians [begin, end) that can paint to `boxes`, in the order of
// the rows, adds those that cannot to `culled`, and returns how many boxes there are.
#define BRUSHGS_DECLARE_PROJECT(isa)                                                                              \
    namespace isa {                                                                                               \
    template <class T>                                                                                            \
    std::size_t project_rows(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin, \
                             std::size_t end, BoxRecord<T>* boxes, ProjectCounts& culled);                        \
    }

BRUSHGS_DECLARE_PROJECT(in_double)
BRUSHGS_DECLARE_PROJECT(baseline)
BRUSHGS_DECLARE_PROJECT(avx2)
BRUSHGS_DECLARE_PROJECT(avx512)

#undef BRUSHGS_DECLARE_PROJECT

}  // namespace brushgs
