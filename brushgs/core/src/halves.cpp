#include "brushgs/halves.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "brushgs/cpu.hpp"
#include "brushgs/symmetric_eigen.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kHalvedPerItem = 8;
constexpr double kTiniestWeight = 1e-300;

// The members of one group; kSize features each, or any number where it is 0. Known to the compiler, it saves up to 15
// %.
template <class T, std::size_t kSize>
struct Members {
    Members(const Halving<T>& halving, std::size_t group, std::vector<double>& offsets)
        : halving(halving),
          rows(halving.rows + halving.begins[group]),
          count(static_cast<std::size_t>(halving.begins[group + 1] - halving.begins[group])),
          is_second(halving.is_second + halving.begins[group]),
          away(offsets) {
        away.resize(count * size());
    }

    std::size_t size() const { return kSize > 0 ? kSize : halving.num_features; }
    double weight(std::size_t i) const { return halving.weights[rows[i]]; }

    // Offsets from the weighted mean.
    void center() {
        double mean[kMostFeatures] = {};
        total = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const T* point = halving.points + static_cast<std::size_t>(rows[i]) * size();
            total += weight(i);
            for (std::size_t k = 0; k < size(); ++k) mean[k] += weight(i) * static_cast<double>(point[k]);
        }
        total = std::max(total, kTiniestWeight);
        for (std::size_t k = 0; k < size(); ++k) mean[k] /= total;
        for (std::size_t i = 0; i < count; ++i) {
            const T* point = halving.points + static_cast<std::size_t>(rows[i]) * size();
            for (std::size_t k = 0; k < size(); ++k) away[i * size() + k] = static_cast<double>(point[k]) - mean[k];
        }
    }

    // Weighted mean [width, width] of the products of the first `width` numbers of the offsets.
    void mean_products(std::size_t width, double* products) const {
        std::fill_n(products, width * width, 0.0);
        for (std::size_t i = 0; i < count; ++i) {
            const double* offset = away.data() + i * size();
            const double share = weight(i);
            for (std::size_t p = 0; p < width; ++p)
                for (std::size_t q = p; q < width; ++q) products[p * width + q] += share * (offset[p] * offset[q]);
        }
        for (std::size_t p = 0; p < width; ++p)
            for (std::size_t q = p; q < width; ++q)
                products[q * width + p] = products[p * width + q] = products[p * width + q] / total;
    }

    // Positions in units of the members' span in that direction. The mean square of the group is kept, and with it the
    // weight of positions against colors.
    void scale_by_spans() {
        double between[9], metric[9] = {}, directions[9], factors[9] = {};
        mean_products(3, between);
        for (std::size_t i = 0; i < count; ++i) {
            const T* span = halving.spans + static_cast<std::size_t>(rows[i]) * 9;
            for (std::size_t p = 0; p < 3; ++p)
                for (std::size_t q = 0; q < 3; ++q) {
                    double product = 0;
                    for (std::size_t axis = 0; axis < 3; ++axis)
                        product += static_cast<double>(span[p * 3 + axis]) * static_cast<double>(span[q * 3 + axis]);
                    metric[p * 3 + q] += weight(i) * product;
                }
        }
        const double spread = between[0] + between[4] + between[8];
        for (double& value : metric) value /= total;
        for (std::size_t p = 0; p < 3; ++p) metric[p * 4] += halving.least_span * spread / 3;
        symmetric_eigen(metric, directions, 3);
        const double longest = std::max({metric[0], metric[4], metric[8]});
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double unit = 1 / std::sqrt(std::max({metric[axis * 4], 1e-12 * longest, kTiniestWeight}));
            for (std::size_t p = 0; p < 3; ++p)
                for (std::size_t q = 0; q < 3; ++q)
                    factors[p * 3 + q] += directions[p * 3 + axis] * unit * directions[q * 3 + axis];
        }
        double after = 0;
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
                for (std::size_t k = 0; k < 3; ++k)
                    after += factors[i * 3 + j] * between[j * 3 + k] * factors[i * 3 + k];
        const double scale = after > 0 ? std::sqrt(spread / after) : 0;
        for (std::size_t i = 0; i < count; ++i) {
            double* offset = away.data() + i * size();
            const double before[3] = {offset[0], offset[1], offset[2]};
            for (std::size_t p = 0; p < 3; ++p)
                offset[p] = scale * (factors[p * 3] * before[0] + factors[p * 3 + 1] * before[1] +
                                     factors[p * 3 + 2] * before[2]);
        }
    }

    // Halves on both sides of the mean, across the direction of the largest variance.
    void part_across() {
        double products[kMostFeatures * kMostFeatures], vectors[kMostFeatures * kMostFeatures];
        mean_products(size(), products);
        symmetric_eigen(products, vectors, size());
        std::size_t widest = 0;
        for (std::size_t k = 1; k < size(); ++k)
            if (products[k * (size() + 1)] >= products[widest * (size() + 1)]) widest = k;
        for (std::size_t i = 0; i < count; ++i) {
            double along = 0;
            for (std::size_t k = 0; k < size(); ++k) along += away[i * size() + k] * vectors[k * size() + widest];
            is_second[i] = along > 0;
        }
    }

    // A step of 2-means; an empty half stands at the mean of all.
    void assign_again() {
        double totals[2] = {}, means[2][kMostFeatures] = {};
        for (std::size_t i = 0; i < count; ++i) {
            totals[is_second[i]] += weight(i);
            for (std::size_t k = 0; k < size(); ++k) means[is_second[i]][k] += weight(i) * away[i * size() + k];
        }
        for (std::size_t half = 0; half < 2; ++half)
            for (std::size_t k = 0; k < size(); ++k) means[half][k] /= std::max(totals[half], kTiniestWeight);
        for (std::size_t i = 0; i < count; ++i) {
            double distances[2] = {};
            for (std::size_t half = 0; half < 2; ++half)
                for (std::size_t k = 0; k < size(); ++k) {
                    const double offset = away[i * size() + k] - means[half][k];
                    distances[half] += offset * offset;
                }
            is_second[i] = distances[1] < distances[0];
        }
    }

    void halve() {
        if (count == 0) return;
        center();
        if (halving.spans != nullptr) scale_by_spans();
        part_across();
        for (int step = 0; step < halving.num_steps; ++step) assign_again();
        // The order of the halves must not depend on the sign of an eigenvector.
        if (is_second[0])
            for (std::size_t i = 0; i < count; ++i) is_second[i] = !is_second[i];
    }

    const Halving<T>& halving;
    const std::int32_t* rows;
    std::size_t count;
    std::uint8_t* is_second;
    std::vector<double>& away;  // [count, size]
    double total = 0;           // weight
};

template <class T, std::size_t kSize>
void halve_all(const Halving<T>& halving) {
    const std::size_t num_items = (halving.num_groups + kHalvedPerItem - 1) / kHalvedPerItem;
    parallel_for(num_items, halving.num_threads, [&](std::size_t item) {
        std::vector<double> offsets;
        const std::size_t end = std::min((item + 1) * kHalvedPerItem, halving.num_groups);
        for (std::size_t group = item * kHalvedPerItem; group < end; ++group)
            Members<T, kSize>(halving, group, offsets).halve();
    });
}

}  // namespace

template <class T>
void halve_groups(const Halving<T>& halving) {
    constexpr std::size_t still = 9;  // position, scales and color
    halving.num_features == still ? halve_all<T, still>(halving) : halve_all<T, 0>(halving);
}

template void halve_groups<float>(const Halving<float>&);
template void halve_groups<double>(const Halving<double>&);

}  // namespace brushgs
