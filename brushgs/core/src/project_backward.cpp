// `project_backward` around its kernel: finds the box of each Gaussian and spreads these over threads.
#include "brushgs/project_backward.hpp"

#include <algorithm>
#include <memory>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsPerItem = 512;      // work handed to a thread at a time, some 100 us
constexpr std::size_t kBoxesPerThread = 1000;  // with fewer, starting a thread costs more than it saves

}  // namespace

template <class T>
void project_backward(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                      const GaussianGradients<T>& gradients) {
    const auto rows = BRUSHGS_KERNEL(project_backward_rows<T>);
    // In the order of the Gaussians: what is read and written for each, most of it coefficients, then lies in a row.
    const auto box_of_row = std::make_unique_for_overwrite<std::uint32_t[]>(gaussians.count);
    std::fill_n(box_of_row.get(), gaussians.count, kNoBox);
    for (std::size_t box = 0; box < boxes.count; ++box)
        box_of_row[static_cast<std::size_t>(boxes.ids[box])] = static_cast<std::uint32_t>(box);
    const std::size_t most_threads = std::max<std::size_t>(boxes.count / kBoxesPerThread, 1);
    const int num_threads = std::min(params.num_threads, static_cast<int>(most_threads));
    parallel_for((gaussians.count + kRowsPerItem - 1) / kRowsPerItem, num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kRowsPerItem, end = std::min(begin + kRowsPerItem, gaussians.count);
        rows(gaussians, params, boxes, box_of_row.get(), gradients, begin, end);
    });
}

template void project_backward<float>(const GaussianColumns<float>&, const ProjectParams&, const ProjectedBoxes<float>&,
                                      const GaussianGradients<float>&);
template void project_backward<double>(const GaussianColumns<double>&, const ProjectParams&,
                                       const ProjectedBoxes<double>&, const GaussianGradients<double>&);

}  // namespace brushgs
