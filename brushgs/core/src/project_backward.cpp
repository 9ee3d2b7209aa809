// `project_backward` around its kernel: finds the box of each Gaussian and spreads these over threads.
#include "brushgs/project_backward.hpp"

#include <algorithm>
#include <memory>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kReversedPerItem = 512;  // work handed to a thread at a time, some 100 us
constexpr std::size_t kBoxesPerThread = 1000;  // with fewer, starting a thread costs more than it saves

// Whether the loss depends on a box at all. Many strokes are hidden by others: of 150,000 more than half.
template <class T>
bool has_gradient(const ProjectedBoxes<T>& boxes, std::size_t i) {
    const auto is_any = [i](const T* values, std::size_t width) {
        bool found = false;
        for (std::size_t k = 0; values != nullptr && k < width; ++k) found |= values[width * i + k] != 0;
        return found;
    };
    return is_any(boxes.v_centers, 2) || is_any(boxes.v_half_extents, 2) || is_any(boxes.v_angles, 1) ||
           is_any(boxes.v_depths, 1) || is_any(boxes.v_colors, 3) || is_any(boxes.v_opacities, 1);
}

}  // namespace

template <class T>
void project_backward(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                      const GaussianGradients<T>& gradients) {
    const auto rows = BRUSHGS_KERNEL(project_backward_rows, T);
    const std::size_t most_threads = std::max<std::size_t>(boxes.count / kBoxesPerThread, 1);
    const int num_threads = std::clamp(params.num_threads, 1, static_cast<int>(most_threads));
    // In the order of the Gaussians: then data for each, mostly coefficients, are contiguous.
    const auto box_of_row = std::make_unique_for_overwrite<std::uint32_t[]>(gaussians.count);
    std::fill_n(box_of_row.get(), gaussians.count, kNoBox);
    const auto num_parts = static_cast<std::size_t>(num_threads);
    parallel_for(num_parts, num_threads, [&](std::size_t part) {
        const std::size_t end = boxes.count * (part + 1) / num_parts;
        for (std::size_t box = boxes.count * part / num_parts; box < end; ++box)
            box_of_row[static_cast<std::size_t>(boxes.ids[box])] =
                has_gradient(boxes, box) ? static_cast<std::uint32_t>(box) : kNoBox;
    });
    parallel_for((gaussians.count + kReversedPerItem - 1) / kReversedPerItem, num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kReversedPerItem, end = std::min(begin + kReversedPerItem, gaussians.count);
        rows(gaussians, params, boxes, box_of_row.get(), gradients, begin, end);
    });
}

template void project_backward<float>(const GaussianColumns<float>&, const ProjectParams&, const ProjectedBoxes<float>&,
                                      const GaussianGradients<float>&);
template void project_backward<double>(const GaussianColumns<double>&, const ProjectParams&,
                                       const ProjectedBoxes<double>&, const GaussianGradients<double>&);

}  // namespace brushgs
