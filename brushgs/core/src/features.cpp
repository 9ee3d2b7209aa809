#include "brushgs/features.hpp"

#include <algorithm>
#include <cmath>

#include "brushgs/colors.hpp"
#include "brushgs/exponentials.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kFeaturesPerItem = 4096;
constexpr double kMostScale = 2;                          // radii: no more than a contracted scene
constexpr std::size_t kGroupSize = 16;                    // in a group; 8 and 64 cost up to 0.2 dB on the still life
constexpr double kLeastDetail = 0.01, kMostDetail = 0.1;  // RGB 0 to 1; with at most 0.2 the skull loses 0.2 dB
constexpr double kLeastWeight = 1e-9;                     // above zero: each Gaussian belongs to a cluster

// Standard deviation of the base colors of some rows.
template <class T>
double deviation(const T* sh, std::size_t stride, const std::uint32_t* rows, std::size_t count) {
    double means[3] = {}, squares = 0;
    const auto num = static_cast<double>(count);
    for (std::size_t channel = 0; channel < 3; ++channel) {
        for (std::size_t i = 0; i < count; ++i) means[channel] += base_color(sh + stride * rows[i], channel);
        means[channel] /= num;
    }
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t channel = 0; channel < 3; ++channel) {
            const double away = base_color(sh + stride * rows[i], channel) - means[channel];
            squares += away * away;
        }
    return std::sqrt(squares / num);
}

}  // namespace

template <class T>
void cluster_features(const FeatureQuery<T>& query, float* points) {
    for_each_row(query.count, kFeaturesPerItem, query.num_threads, [&](std::size_t i) {
        double place[3];
        const double factor = contract(query.means + 3 * i, query.extent, place);
        float* const point = points + kFeatures * i;
        for (std::size_t k = 0; k < 3; ++k) {
            point[k] = static_cast<float>(place[k]);
            point[3 + k] =
                static_cast<float>(std::min(static_cast<double>(query.scales[3 * i + k]) * factor, kMostScale));
            point[6 + k] = static_cast<float>(query.color_weight * base_color(query.sh + 3 * query.sh_terms * i, k));
        }
    });
}

template <class T>
void contract_all(const T* means, std::size_t count, const Extent& extent, int num_threads, double* places,
                  double* factors) {
    for_each_row(count, kFeaturesPerItem, num_threads,
                 [&](std::size_t i) { factors[i] = contract(means + 3 * i, extent, places + 3 * i); });
}

template <class T>
void feature_spans(const T* quats, const float* points, std::size_t count, std::size_t width, int num_threads,
                   float* spans) {
    for_each_row(count, kFeaturesPerItem, num_threads, [&](std::size_t i) {
        const auto [w, x, y, z] = unit_quat(quats + 4 * i);
        const double turned[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                                  2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                                  2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
        for (std::size_t k = 0; k < 9; ++k)
            spans[9 * i + k] = static_cast<float>(turned[k] * static_cast<double>(points[width * i + 3 + k % 3]));
    });
}

template <class T>
void color_detail(const T* sh, std::size_t sh_terms, const double* places, std::size_t count, int num_threads,
                  double* detail) {
    const auto rows = rows_along_curve(places, count, 3, num_threads);
    const std::size_t num_groups = std::max<std::size_t>(count / kGroupSize, count > 0 ? 1 : 0);
    for_each_row(num_groups, kFeaturesPerItem / kGroupSize, num_threads, [&](std::size_t group) {
        const std::size_t begin = group * kGroupSize, end = group + 1 == num_groups ? count : begin + kGroupSize;
        const double value = deviation(sh, 3 * sh_terms, rows.get() + begin, end - begin);
        for (std::size_t i = begin; i < end; ++i) detail[rows[i]] = value;
    });
}

void cluster_weights(const double* contributions, const double* detail, std::size_t count, double* weights) {
    double largest = 0;
    for (std::size_t i = 0; i < count; ++i) {
        weights[i] = power_of(contributions[i], kContributionPower) * (kLeastDetail + std::min(detail[i], kMostDetail));
        largest = std::max(largest, weights[i]);
    }
    for (std::size_t i = 0; i < count; ++i) weights[i] = largest > 0 ? std::max(weights[i] / largest, kLeastWeight) : 1;
}

#define BRUSHGS_FEATURES(T)                                                                        \
    template void cluster_features<T>(const FeatureQuery<T>&, float*);                             \
    template void contract_all<T>(const T*, std::size_t, const Extent&, int, double*, double*);    \
    template void feature_spans<T>(const T*, const float*, std::size_t, std::size_t, int, float*); \
    template void color_detail<T>(const T*, std::size_t, const double*, std::size_t, int, double*);
BRUSHGS_FEATURES(float)
BRUSHGS_FEATURES(double)
#undef BRUSHGS_FEATURES

}  // namespace brushgs
