// `project_backward` around its kernel: picks the kernel and spreads boxes over threads.
#include "brushgs/project_backward.hpp"

#include <algorithm>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsPerItem = 512;     // work handed to a thread at a time, some 100 us
constexpr std::size_t kRowsPerThread = 1000;  // with fewer, starting a thread costs more than it saves

}  // namespace

template <class T>
void project_backward(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                      const GaussianGradients<T>& gradients) {
    const auto rows = BRUSHGS_KERNEL(project_backward_rows<T>);
    const std::size_t most_threads = std::max<std::size_t>(boxes.count / kRowsPerThread, 1);
    const int num_threads = std::min(params.num_threads, static_cast<int>(most_threads));
    // A Gaussian has one box at most: no two rows are written by two boxes.
    parallel_for((boxes.count + kRowsPerItem - 1) / kRowsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kRowsPerItem;
        rows(gaussians, params, boxes, gradients, begin, std::min(begin + kRowsPerItem, boxes.count));
    });
}

template void project_backward<float>(const GaussianColumns<float>&, const ProjectParams&, const ProjectedBoxes<float>&,
                                      const GaussianGradients<float>&);
template void project_backward<double>(const GaussianColumns<double>&, const ProjectParams&,
                                       const ProjectedBoxes<double>&, const GaussianGradients<double>&);

}  // namespace brushgs
