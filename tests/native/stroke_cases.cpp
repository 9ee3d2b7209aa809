// What makes strokes of Gaussians: groups and their moments, halves of groups, coverage and colors.
#include <string>
#include <utility>
#include <vector>

#include "brushgs/coverage.hpp"
#include "brushgs/groups.hpp"
#include "brushgs/halves.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/oklab.hpp"
#include "hash.hpp"
#include "inputs.hpp"

namespace native {

namespace {

constexpr std::size_t kCount = 1500, kGroups = 60, kFeatures = 9, kNeighbors = 6;

// Gaussians with labels, in groups.
template <class T>
struct Grouped {
    Gaussians<T> gaussians{41, kCount, 1};
    std::vector<std::int32_t> rows;
    std::vector<std::int64_t> begins;
    std::vector<double> weights, areas, means, footprints;

    Grouped() : rows(kCount), begins(kGroups + 1), areas(kCount), means(3 * kGroups) {
        Random random(42);
        std::vector<std::int32_t> labels(kCount);
        for (auto& label : labels) label = static_cast<std::int32_t>(random.bits() % kGroups);
        brushgs::group_rows(labels.data(), kCount, kGroups, rows.data(), begins.data());
        weights = random.numbers<double>(kCount, 0.01, 1);
        footprints = random.numbers<double>(kGroups, 0, 0.1);
        brushgs::projected_areas(gaussians.scales.data(), kCount, 0.0, 1, areas.data());
        means = random.numbers<double>(3 * kGroups, -0.5, 0.5);
    }
};

template <class T>
void run_moments(Cases& cases) {
    const Grouped<T> of;
    const std::string name = std::string(": ") + name_of_scalar<T>;
    cases.run("projected areas" + name, [&](int num_threads) {
        std::vector<double> areas(kCount);
        brushgs::projected_areas(of.gaussians.scales.data(), kCount, 0.0, num_threads, areas.data());
        Hash hash;
        hash.add(areas);
        return hash.value();
    });
    cases.run("sums of groups" + name, [&](int num_threads) {
        std::vector<double> totals(kGroups), sums(3 * kGroups);
        brushgs::sum_groups<T>({of.gaussians.means.data(), of.weights.data(), of.rows.data(), of.begins.data(), kGroups,
                                3, num_threads, totals.data(), sums.data()});
        Hash hash;
        hash.add(totals);
        hash.add(sums);
        return hash.value();
    });
    cases.run("covariances and their axes" + name, [&](int num_threads) {
        std::vector<double> within(9 * kGroups), between(9 * kGroups), scales(3 * kGroups), axes(9 * kGroups);
        brushgs::sum_covariances<T>({of.gaussians.means.data(), of.gaussians.quats.data(), of.gaussians.scales.data(),
                                     of.weights.data(), of.rows.data(), of.begins.data(), of.means.data(), kGroups,
                                     num_threads, within.data(), between.data()});
        brushgs::principal_axes(within.data(), kGroups, num_threads, scales.data(), axes.data());
        Hash hash;
        for (const auto* values : {&within, &between, &scales, &axes}) hash.add(*values);
        return hash.value();
    });
    cases.run("stopped by groups" + name, [&](int num_threads) {
        std::vector<double> stopped(kGroups);
        brushgs::stop_groups<T>({of.gaussians.opacities.data(), of.areas.data(), of.footprints.data(), of.rows.data(),
                                 of.begins.data(), kGroups, num_threads, stopped.data()});
        Hash hash;
        hash.add(stopped);
        return hash.value();
    });
    Random random(43);
    const auto points = random.numbers<T>(kCount * kFeatures, -1, 1), spans = random.numbers<T>(kCount * 9, -0.1, 0.1);
    for (const std::size_t features : {kFeatures, kFeatures - 2})
        cases.run("halves of " + std::to_string(features) + name, [&](int num_threads) {
            std::vector<std::uint8_t> is_second(kCount);
            brushgs::halve_groups<T>({points.data(), features, of.weights.data(), spans.data(), of.rows.data(),
                                      of.begins.data(), kGroups, 0.1, 3, num_threads, is_second.data()});
            Hash hash;
            hash.add(is_second);
            return hash.value();
        });
}

void run_coverage(Cases& cases) {
    const Gaussians<double> strokes(44, kCount, 1);
    Random random(45);
    auto covariances = random.numbers<double>(9 * kCount, 0, 1);
    for (std::size_t i = 0; i < 9 * kCount; i += 9)
        for (const auto& [one, other] : {std::pair{1, 3}, {2, 6}, {5, 7}})
            covariances[i + static_cast<std::size_t>(other)] = covariances[i + static_cast<std::size_t>(one)];
    std::vector<double> scales(3 * kCount), axes(9 * kCount);
    brushgs::principal_axes(covariances.data(), kCount, 1, scales.data(), axes.data());
    std::vector<std::int32_t> neighbors(kCount * kNeighbors);
    brushgs::find_neighbors({strokes.means.data(), kCount, kNeighbors, 3, 1}, neighbors.data());
    std::vector<std::int64_t> rows(kCount);
    for (std::size_t i = 0; i < kCount; ++i) rows[i] = static_cast<std::int64_t>(i);
    cases.run("coverage", [&](int num_threads) {
        std::vector<double> passed(kCount), touching(kCount), parallel(kCount);
        brushgs::cover({strokes.means.data(), scales.data(), axes.data(), strokes.opacities.data(), rows.data(),
                        neighbors.data(), kCount, kNeighbors, 4, 20, num_threads, passed.data(), touching.data(),
                        parallel.data()});
        Hash hash;
        for (const auto* values : {&passed, &touching, &parallel}) hash.add(*values);
        return hash.value();
    });
}

void run_oklab(Cases& cases) {
    constexpr std::size_t num_pixels = 20000, num_steps = 256;
    Random random(46);
    const auto rgb = random.numbers<float>(3 * num_pixels, -0.1, 1.1), light = random.numbers<float>(num_steps, 0, 1),
               roots = random.numbers<float>(num_steps, 0, 1), cones = random.numbers<float>(9, 0, 0.5),
               lab = random.numbers<float>(9, -1, 1);
    const brushgs::OklabTables tables{light.data(), num_steps, roots.data(), num_steps, cones.data(), lab.data()};
    cases.run("OKLab", [&](int num_threads) {
        std::vector<float> planes(3 * num_pixels);
        brushgs::oklab_planes(tables, rgb.data(), num_pixels, num_threads, planes.data());
        Hash hash;
        hash.add(planes);
        return hash.value();
    });
    constexpr std::size_t height = 125, width = num_pixels / height - 1;  // one of them odd
    const auto alpha = random.numbers<float>(num_pixels, 0, 1);
    cases.run("seen errors", [&](int num_threads) {
        std::vector<float> planes(6 * num_pixels), plain(6 * num_pixels);
        std::vector<double> errors(height * width);
        brushgs::seen_planes(tables, {rgb.data(), alpha.data(), height, width}, num_threads, planes.data());
        brushgs::seen_errors({plain.data(), planes.data(), height, width, 0.1f, 0.5f, num_threads, errors.data()});
        Hash hash;
        hash.add(errors);
        return hash.value();
    });
}

}  // namespace

void run_stroke_cases(Cases& cases) {
    run_moments<float>(cases);
    run_moments<double>(cases);
    run_coverage(cases);
    run_oklab(cases);
}

}  // namespace native
