#include "brushgs/turn_rates.hpp"

#include <algorithm>

#include "brushgs/cpu.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kStrokesPerItem = 256;  // few enough for the cache
constexpr double kLeast = 1e-3;               // of 1 + c: opposite views

}  // namespace

void turn_rates(const TurnRates& query) {
    const std::size_t num = query.num_strokes, all = query.num_views * num;
    const double most = query.most;
    parallel_for((num + kStrokesPerItem - 1) / kStrokesPerItem, query.num_threads, [&](std::size_t item) {
        const std::size_t begin = item * kStrokesPerItem, end = std::min(begin + kStrokesPerItem, num);
        for (std::size_t candidate = 0; candidate < query.num_candidates; ++candidate) {
            const double* const facing = query.facing + 3 * candidate * num;
            double rates[kStrokesPerItem] = {};
            for (std::size_t view = 0; view < query.num_views; ++view) {
                const float* const toward = query.toward + view * num;
                const float* const weights = query.weights + view * num;
                for (std::size_t i = begin; i < end; ++i) {
                    const double cosine = static_cast<double>(toward[i]) * facing[i] +
                                          static_cast<double>(toward[all + i]) * facing[num + i] +
                                          static_cast<double>(toward[2 * all + i]) * facing[2 * num + i];
                    const double rate = (1 - cosine) / std::max(1 + cosine, kLeast);
                    rates[i - begin] += static_cast<double>(weights[i]) * std::min(rate, most);
                }
            }
            std::copy_n(rates, end - begin, query.rates + candidate * num + begin);
        }
    });
}

}  // namespace brushgs
