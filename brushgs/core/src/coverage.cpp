#include "brushgs/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "brushgs/cpu.hpp"
#include "brushgs/exponentials.hpp"

namespace brushgs {

namespace {

constexpr std::size_t kCoveredPerItem = 256;
constexpr double kFarthest = 1e6;    // standard deviations; larger distances are clipped
constexpr double kRoundOff = 1e-12;  // of the squared area of a needle seen end-on

// Squared Mahalanobis distance of the center of a stroke to another one, seen along the thinnest axis of the first.
double squared_distance(const Coverage& query, std::size_t row, std::size_t other) {
    const double longest = query.scales[3 * other + 2], unit = longest > 0 ? longest : 1;
    const double* own = query.axes + 9 * row;
    const double* theirs = query.axes + 9 * other;
    double shape[3] = {}, place[2] = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double scale = query.scales[3 * other + axis] / unit;
        double along[2] = {};
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t p = 0; p < 2; ++p) along[p] += own[3 * k + p + 1] * (theirs[3 * k + axis] * scale);
        shape[0] += along[0] * along[0], shape[1] += along[0] * along[1], shape[2] += along[1] * along[1];
    }
    for (std::size_t k = 0; k < 3; ++k) {
        const double away = (query.means[3 * row + k] - query.means[3 * other + k]) / unit;
        for (std::size_t p = 0; p < 2; ++p) place[p] += own[3 * k + p + 1] * std::clamp(away, -kFarthest, kFarthest);
    }
    const auto [xx, xy, yy] = shape;
    const auto [x, y] = place;
    const double trace = xx + yy, area = std::max(xx * yy - xy * xy, kRoundOff * (trace * trace));
    if (!(area > 0)) return std::numeric_limits<double>::infinity();
    return std::max(yy * x * x - 2 * xy * x * y + xx * y * y, 0.0) / area;
}

double cosine_of_normals(const double* axes, std::size_t row, std::size_t other) {
    const double *a = axes + 9 * row, *b = axes + 9 * other;
    return std::abs(a[0] * b[0] + a[3] * b[3] + a[6] * b[6]);
}

}  // namespace

void cover(const Coverage& query) {
    const std::size_t num_items = (query.num_rows + kCoveredPerItem - 1) / kCoveredPerItem;
    parallel_for(num_items, query.num_threads, [&](std::size_t item) {
        const std::size_t end = std::min((item + 1) * kCoveredPerItem, query.num_rows);
        for (std::size_t i = item * kCoveredPerItem; i < end; ++i) {
            const auto row = static_cast<std::size_t>(query.rows[i]);
            double passed = 1, touching = 0, parallel = 0;
            for (std::size_t rank = 0; rank < query.num_neighbors; ++rank) {
                const auto other = static_cast<std::size_t>(query.neighbors[i * query.num_neighbors + rank]);
                if (other == row) continue;
                const double squared = squared_distance(query, row, other);
                passed *= 1 - query.opacities[other] * exp_of(-0.5 * squared);
                if (rank < query.num_touching && squared < query.touch)
                    touching += 1, parallel += cosine_of_normals(query.axes, row, other);
            }
            query.passed[i] = passed, query.touching[i] = touching, query.parallel[i] = parallel;
        }
    });
}

}  // namespace brushgs
