// The k-d tree is searched for every point only in the first round of the start: afterwards a point is compared with
// the centers around its previous center, see reassign.cpp. A step over 1.2 million points in 7000 clusters then takes
// 1/7 of the time.
#include "brushgs/lloyd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "brushgs/groups.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/memory.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

constexpr double kStartRounds[] = {0.4, 0.3, 0.3};  // shares of the centers; ten rounds give no lower inertia
constexpr std::size_t kNumStartRounds = std::size(kStartRounds);
constexpr std::size_t kMoreRounds = 8;  // at most, to replace duplicate centers of earlier rounds, of equal points
constexpr std::size_t kOneByOne = 32;   // up to this number each gets its own round: few must not share an island

constexpr std::size_t kMovedPerItem = 1 << 15;

// The center nearest to each point, and what is to be known of the points of each center.
struct Assigned {
    std::vector<double> centers;  // [k, D]
    Nearest nearest;
    std::vector<double> errors;  // [N] weight x squared distance
    double inertia = 0;          // their sum

    std::size_t count(const WeightedPoints& points) const { return centers.size() / points.num_dimensions; }
};

// Points by their nearest center.
struct Members {
    Members(const WeightedPoints& points, const Assigned& found)
        : rows(make_buffer<std::int32_t>(points.num_points)), begins(found.count(points) + 1) {
        group_rows(found.nearest.rows.get(), points.num_points, begins.size() - 1, rows.get(), begins.data());
    }

    PointGroups groups(const WeightedPoints& points, const std::vector<double>& centers) const {
        return {.points = points.points,
                .centers = centers.data(),
                .rows = rows.get(),
                .begins = begins.data(),
                .num_points = points.num_points,
                .num_groups = begins.size() - 1,
                .num_dimensions = points.num_dimensions};
    }

    Buffer<std::int32_t> rows;
    std::vector<std::int64_t> begins;
};

void measure(const WeightedPoints& points, Assigned& found) {
    found.inertia = 0;
    found.errors.resize(points.num_points);
    for (std::size_t i = 0; i < points.num_points; ++i) {
        const double distance = found.nearest.distances[i];
        found.inertia += found.errors[i] = points.weights[i] * (distance * distance);
    }
}

// `count` rows, ascending, at even steps of the cumulative mass, the first at `shift` of a step.
std::vector<std::uint32_t> systematic_sample(const std::vector<double>& mass, std::size_t count, double shift) {
    std::vector<double> cumulative(mass.size());
    double sum = 0;
    for (std::size_t i = 0; i < mass.size(); ++i) cumulative[i] = sum += mass[i];
    const double step = sum / static_cast<double>(count);
    std::vector<std::uint32_t> rows(count);
    std::size_t row = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double wanted = (static_cast<double>(i) + shift) * step;
        while (row < mass.size() - 1 && cumulative[row] < wanted) ++row;
        rows[i] = static_cast<std::uint32_t>(row);
    }
    return rows;
}

// The points of these rows without repetitions, in order: a k-d tree cannot separate equal centers, and each query
// would visit all.
std::vector<double> distinct_points(const WeightedPoints& points, const std::vector<std::uint32_t>& rows) {
    const std::size_t width = points.num_dimensions;
    const auto point = [&](std::size_t at) { return points.points + rows[at] * width; };
    std::vector<std::uint32_t> order(rows.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto [first, second] = std::mismatch(point(a), point(a) + width, point(b));
        return first == point(a) + width ? a < b : *first < *second;
    });
    std::vector<std::uint8_t> is_new(rows.size(), 1);
    for (std::size_t i = 1; i < order.size(); ++i)
        is_new[order[i]] = !std::equal(point(order[i]), point(order[i]) + width, point(order[i - 1]));
    std::vector<double> found;
    found.reserve(rows.size() * width);
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (is_new[i] != 0) found.insert(found.end(), point(i), point(i) + width);
    return found;
}

Nearest nearest_of(const WeightedPoints& points, const std::vector<double>& centers, int num_threads) {
    return find_nearest({.points = points.points,
                         .centers = centers.data(),
                         .num_points = points.num_points,
                         .num_centers = centers.size() / points.num_dimensions,
                         .num_dimensions = points.num_dimensions,
                         .num_threads = num_threads});
}

// Adds centers, and brings what is nearest up to date.
void add_centers(const WeightedPoints& points, const std::vector<double>& fresh, int num_threads, Assigned& found) {
    if (found.centers.empty()) {
        found.nearest = nearest_of(points, fresh, num_threads);
    } else {
        const Members members(points, found);
        find_nearer(members.groups(points, found.centers), {.others = fresh.data(),
                                                            .num_others = fresh.size() / points.num_dimensions,
                                                            .first = static_cast<std::int32_t>(found.count(points)),
                                                            .num_threads = num_threads,
                                                            .distances = found.nearest.distances.get(),
                                                            .labels = found.nearest.rows.get()});
    }
    found.centers.insert(found.centers.end(), fresh.begin(), fresh.end());
}

// How many centers there are to be after each round.
std::vector<std::size_t> targets(std::size_t num_clusters) {
    const bool is_few = num_clusters <= kOneByOne;
    const std::size_t num_rounds = is_few ? num_clusters : kNumStartRounds;
    std::vector<std::size_t> counts;
    double share = 0;
    for (std::size_t i = 0; i < num_rounds; ++i) {
        share += is_few ? 1 / static_cast<double>(num_clusters) : kStartRounds[i];
        counts.push_back(static_cast<std::size_t>(std::nearbyint(share * static_cast<double>(num_clusters))));
    }
    counts.insert(counts.end(), kMoreRounds, num_clusters);
    return counts;
}

// First centers, and the result of `nearest_of` with them.
Assigned start(const WeightedPoints& points, std::size_t num_clusters, const double* draws, int num_threads) {
    Assigned found;
    std::vector<double> mass(points.weights, points.weights + points.num_points);
    for (const std::size_t target : targets(num_clusters)) {
        const std::size_t count = found.count(points);
        const bool is_covered = std::all_of(mass.begin(), mass.end(), [](double one) { return one == 0; });
        if (is_covered || target == count) break;
        add_centers(points, distinct_points(points, systematic_sample(mass, target - count, *draws++)), num_threads,
                    found);
        measure(points, found);
        mass = found.errors;
    }
    return found;
}

// Weighted means of the points by center; centers without points go to the largest errors.
std::vector<double> means_of(const WeightedPoints& points, const Members& members, const std::vector<double>& errors,
                             int num_threads) {
    const std::size_t num = members.begins.size() - 1, width = points.num_dimensions;
    std::vector<double> totals(num), means(num * width);
    sum_groups(GroupSums<float>{.values = points.points,
                                .weights = points.weights,
                                .rows = members.rows.get(),
                                .begins = members.begins.data(),
                                .num_groups = num,
                                .width = width,
                                .num_threads = num_threads,
                                .totals = totals.data(),
                                .sums = means.data()});
    std::vector<std::size_t> empty;
    for (std::size_t i = 0; i < num; ++i) {
        if (totals[i] == 0) empty.push_back(i);
        for (std::size_t k = 0; k < width && totals[i] != 0; ++k) means[i * width + k] /= totals[i];
    }
    if (empty.empty()) return means;
    std::vector<std::size_t> worst(points.num_points);
    for (std::size_t i = 0; i < worst.size(); ++i) worst[i] = i;
    const auto end = worst.begin() + static_cast<std::ptrdiff_t>(empty.size());
    std::partial_sort(worst.begin(), end, worst.end(), [&](std::size_t a, std::size_t b) {
        return errors[a] > errors[b] || (errors[a] == errors[b] && a < b);
    });
    for (std::size_t i = 0; i < empty.size(); ++i)
        std::copy_n(points.points + worst[i] * width, width, &means[empty[i] * width]);
    return means;
}

// The same points in another order.
struct Ordered {
    Ordered(const WeightedPoints& from, const std::uint32_t* order, int num_threads)
        : points(make_buffer<float>(from.num_points * from.num_dimensions)),
          weights(make_buffer<double>(from.num_points)),
          all{points.get(), weights.get(), from.num_points, from.num_dimensions} {
        const std::size_t width = from.num_dimensions;
        for_each_row(from.num_points, kMovedPerItem, num_threads, [&](std::size_t i) {
            std::copy_n(from.points + order[i] * width, width, points.get() + i * width);
            weights[i] = from.weights[order[i]];
        });
    }

    Buffer<float> points;
    Buffer<double> weights;
    WeightedPoints all;
};

// Labels for the points as they were before they were put in order, without those that are not in use.
Clusters compacted(const std::int32_t* nearest, const std::uint32_t* order, std::size_t num_points,
                   std::size_t num_centers) {
    std::vector<std::int32_t> ranks(num_centers);
    for (std::size_t i = 0; i < num_points; ++i) ranks[static_cast<std::size_t>(nearest[i])] = 1;
    std::int32_t num = 0;
    for (std::int32_t& rank : ranks) num += std::exchange(rank, num);
    auto labels = std::make_unique_for_overwrite<std::int32_t[]>(num_points);
    for (std::size_t i = 0; i < num_points; ++i) labels[order[i]] = ranks[static_cast<std::size_t>(nearest[i])];
    return {.labels = std::move(labels), .num_clusters = static_cast<std::size_t>(num), .num_steps = 0, .inertia = 0};
}

}  // namespace

std::size_t most_draws(std::size_t num_clusters) { return targets(num_clusters).size(); }

std::vector<double> start_centers(const WeightedPoints& points, std::size_t num_clusters, const double* draws,
                                  int num_threads) {
    return start(points, num_clusters, draws, num_threads).centers;
}

Clusters find_clusters(const WeightedPoints& points, const Lloyd& lloyd) {
    const std::size_t num = points.num_points;
    // Neighbors in memory too: cache hits.
    const auto order = rows_along_curve(points.points, num, points.num_dimensions, lloyd.num_threads);
    const Ordered ordered(points, order.get(), lloyd.num_threads);
    Assigned found = start(ordered.all, lloyd.num_clusters, lloyd.draws, lloyd.num_threads);
    double before = std::numeric_limits<double>::infinity();
    int step = 0;
    for (; step < lloyd.num_steps && found.inertia < (1 - lloyd.gain) * before; ++step) {
        const Members members(ordered.all, found);
        found.centers = means_of(ordered.all, members, found.errors, lloyd.num_threads);
        found.nearest = find_nearest_again(members.groups(ordered.all, found.centers), lloyd.num_threads);
        before = found.inertia;
        measure(ordered.all, found);
    }
    Clusters clusters = compacted(found.nearest.rows.get(), order.get(), num, found.count(points));
    clusters.num_steps = step, clusters.inertia = found.inertia;
    return clusters;
}

}  // namespace brushgs
