#include "brushgs/solid.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "brushgs/moments.hpp"

namespace brushgs {

namespace {

double area_of(const double* scales) {
    double area;
    projected_areas(scales, 1, 0, 1, &area);
    return area;
}

}  // namespace

template <class T>
void make_solid(const StrokeQuery<T>& strokes, double strength, T* scales, T* opacities) {
    const std::size_t count = strokes.count;
    const std::vector<double> before(strokes.opacities, strokes.opacities + count);
    std::vector<std::int64_t> rows(count);
    std::iota(rows.begin(), rows.end(), 0);
    const auto passed = surroundings_of(strokes).passed(before, rows);
    for (std::size_t i = 0; i < count; ++i) {
        const double stopped = 1 - (1 - before[i]) * passed[i];
        double gain = 1 + strength * stopped * (1 - before[i]), smaller[3], seen[3];  // of opacity; at most 2
        for (std::size_t k = 0; k < 3; ++k)
            smaller[k] = static_cast<double>(strokes.scales[3 * i + k]) / std::sqrt(gain);
        seen_scales(smaller, 1, strokes.finest, 1, seen);
        if (!std::equal(seen, seen + 3, smaller)) {  // a line gets shorter, but not thinner
            double own[3];
            seen_scales(strokes.scales + 3 * i, 1, strokes.finest, 1, own);
            gain = area_of(own) / area_of(seen);
        }
        for (std::size_t k = 0; k < 3; ++k) scales[3 * i + k] = static_cast<T>(smaller[k]);
        opacities[i] = static_cast<T>(std::min(before[i] * gain, 1.0));
    }
}

template void make_solid<float>(const StrokeQuery<float>&, double, float*, float*);
template void make_solid<double>(const StrokeQuery<double>&, double, double*, double*);

}  // namespace brushgs
