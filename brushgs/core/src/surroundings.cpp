#include "brushgs/surroundings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "brushgs/coverage.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kRowsPerItem = 1024;

}  // namespace

std::vector<double> Surroundings::passed(const std::vector<double>& opacities, const std::vector<std::int64_t>& rows,
                                         std::size_t num_others) const {
    std::vector<std::int32_t> found;
    std::size_t width = num_neighbors;
    const auto own = [&](std::size_t i, std::size_t step) { return step * static_cast<std::size_t>(rows[i]); };
    if (num_others <= kNeighbors) {
        found.resize(width * rows.size());
        for (std::size_t i = 0; i < rows.size(); ++i)
            std::copy_n(neighbors.data() + own(i, width), width, found.data() + width * i);
    } else {
        width = std::min(num_others + 1, count);
        found.resize(width * rows.size());
        std::vector<double> places(3 * rows.size()), distances(width * rows.size());
        for (std::size_t i = 0; i < rows.size(); ++i) std::copy_n(means.data() + own(i, 3), 3, places.data() + 3 * i);
        find_several({means.data(), places.data(), count, rows.size(), width, 3, num_threads}, distances.data(),
                     found.data());
    }
    std::vector<double> light(rows.size()), touching(rows.size()), parallel(rows.size());
    cover({.means = means.data(),
           .scales = scales.data(),
           .axes = axes.data(),
           .opacities = opacities.data(),
           .rows = rows.data(),
           .neighbors = found.data(),
           .num_rows = rows.size(),
           .num_neighbors = width,
           .num_touching = 0,
           .touch = 0,
           .num_threads = num_threads,
           .passed = light.data(),
           .touching = touching.data(),
           .parallel = parallel.data()});
    return light;
}

template <class T>
Surroundings surroundings_of(const StrokeQuery<T>& strokes) {
    const std::size_t count = strokes.count, num_neighbors = std::min(Surroundings::kNeighbors, count - (count > 0));
    const auto column = [count](std::size_t width) { return std::vector<double>(width * count); };
    Surroundings found{{strokes.means, strokes.means + 3 * count},       column(3), column(9),     column(1),
                       std::vector<std::int32_t>(num_neighbors * count), count,     num_neighbors, strokes.num_threads};
    std::vector<double> seen(3 * count);
    seen_scales(strokes.scales, count, strokes.finest, strokes.num_threads, seen.data());
    for_each_row(count, kRowsPerItem, strokes.num_threads, [&](std::size_t i) {
        std::array<std::size_t, 3> order{0, 1, 2};
        std::ranges::stable_sort(order, {}, [&](std::size_t axis) { return strokes.scales[3 * i + axis]; });
        const auto rotation = rotation_of(unit_quat(strokes.quats + 4 * i));
        for (std::size_t k = 0; k < 9; ++k) found.axes[9 * i + k] = rotation[k - k % 3 + order[k % 3]];
        for (std::size_t k = 0; k < 3; ++k) found.scales[3 * i + k] = seen[3 * i + order[k]];
        found.sizes[i] = std::sqrt(found.scales[3 * i + 1]) * std::sqrt(found.scales[3 * i + 2]);
    });
    if (num_neighbors > 0)
        find_neighbors({found.means.data(), count, num_neighbors, 3, strokes.num_threads}, found.neighbors.data());
    return found;
}

template Surroundings surroundings_of<float>(const StrokeQuery<float>&);
template Surroundings surroundings_of<double>(const StrokeQuery<double>&);

}  // namespace brushgs
