#include "brushgs/merge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "brushgs/gaps.hpp"
#include "brushgs/groups.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

constexpr std::size_t kMergedPerItem = 256;

// The rows of each label.
struct Groups {
    Groups(const std::int32_t* labels, std::size_t num_rows, std::size_t num_groups)
        : rows(num_rows), begins(num_groups + 1) {
        group_rows(labels, num_rows, num_groups, rows.data(), begins.data());
    }
    std::size_t count() const { return begins.size() - 1; }
    std::size_t first(std::size_t group) const {
        return static_cast<std::size_t>(rows[static_cast<std::size_t>(begins[group])]);
    }
    std::size_t size(std::size_t group) const { return static_cast<std::size_t>(begins[group + 1] - begins[group]); }

    std::vector<std::int32_t> rows;
    std::vector<std::int64_t> begins;
};

// Weights over their sum by label; equal weights if that sum is zero.
void to_shares(const Groups& groups, int num_threads, Doubles& weights) {
    for_each_row(groups.count(), kMergedPerItem, num_threads, [&](std::size_t group) {
        const std::int32_t* const begin = groups.rows.data() + groups.begins[group];
        const std::int32_t* const end = begin + groups.size(group);
        double total = 0;
        for (const std::int32_t* row = begin; row < end; ++row) total += weights[static_cast<std::size_t>(*row)];
        const bool is_void = total == 0;
        if (is_void) total = static_cast<double>(groups.size(group));
        for (const std::int32_t* row = begin; row < end; ++row) {
            double& weight = weights[static_cast<std::size_t>(*row)];
            weight = (is_void ? 1 : weight) / total;
        }
    });
}

template <class T>
Doubles sums_of(const T* values, std::size_t width, const Doubles& shares, const Groups& groups, int num_threads) {
    Doubles totals(groups.count()), sums(groups.count() * width);
    sum_groups(GroupSums<T>{.values = values,
                            .weights = shares.data(),
                            .rows = groups.rows.data(),
                            .begins = groups.begins.data(),
                            .num_groups = groups.count(),
                            .width = width,
                            .num_threads = num_threads,
                            .totals = totals.data(),
                            .sums = sums.data()});
    return sums;
}

struct Shapes {
    Doubles scales;     // [k, 3]
    Doubles axes;       // [k, 3, 3]
    Doubles opacities;  // [k]
};

template <class T>
Shapes shapes_of(const Cover<T>& query, const Groups& groups, const Doubles& shares, const Doubles& means) {
    const std::size_t num = groups.count();
    const int threads = query.num_threads;
    Doubles within(9 * num), between(9 * num), covariances(9 * num), seen(3 * num), footprints(num);
    sum_covariances(Covariances<T>{.means = query.members.means,
                                   .quats = query.members.quats,
                                   .scales = query.members.scales,
                                   .shares = shares.data(),
                                   .rows = groups.rows.data(),
                                   .begins = groups.begins.data(),
                                   .centers = means.data(),
                                   .num_groups = num,
                                   .num_threads = threads,
                                   .within = within.data(),
                                   .between = between.data()});
    Shapes found{Doubles(3 * num), Doubles(9 * num), Doubles(num)};
    const auto spread = [&](std::size_t group, double factor) {
        for (std::size_t i = 9 * group; i < 9 * group + 9; ++i) covariances[i] = within[i] + factor * between[i];
    };
    const auto find_axes = [&](double factor) {
        for (std::size_t group = 0; group < num; ++group) spread(group, factor);
        principal_axes(covariances.data(), num, threads, found.scales.data(), found.axes.data());
    };
    find_axes(1);
    projected_areas(found.scales.data(), num, query.finest, threads, footprints.data());
    stop_groups(Stopping<T>{.opacities = query.members.opacities,
                            .areas = query.areas,
                            .footprints = footprints.data(),
                            .rows = groups.rows.data(),
                            .begins = groups.begins.data(),
                            .num_groups = num,
                            .num_threads = threads,
                            .stopped = found.opacities.data()});
    find_axes(query.overlap);
    if (!query.closes_gaps) return found;
    seen_scales(found.scales.data(), num, query.finest, threads, seen.data());
    Doubles more(num);
    find_growth({.means = means.data(),
                 .scales = seen.data(),
                 .axes = found.axes.data(),
                 .opacities = found.opacities.data(),
                 .num_strokes = num,
                 .num_threads = threads,
                 .growth = more.data()});
    for_each_row(num, kMergedPerItem, threads, [&](std::size_t group) {
        if (more[group] == 0) return;
        spread(group, query.overlap + more[group]);
        principal_axes(&covariances[9 * group], 1, 1, &found.scales[3 * group], &found.axes[9 * group]);
    });
    return found;
}

template <class T>
void copy_row(const MergeColumns<const T>& from, std::size_t row, std::size_t width, const MergeColumns<T>& to,
              std::size_t at) {
    std::copy_n(from.means + 3 * row, 3, to.means + 3 * at);
    std::copy_n(from.quats + 4 * row, 4, to.quats + 4 * at);
    std::copy_n(from.scales + 3 * row, 3, to.scales + 3 * at);
    to.opacities[at] = from.opacities[row];
    std::copy_n(from.sh + width * row, width, to.sh + width * at);
}

}  // namespace

template <class T>
void cover_members(const Cover<T>& query, const MergeColumns<T>& merged) {
    const MergeColumns<const T>& members = query.members;
    const std::size_t num = query.num_groups, width = 3 * query.sh_terms;
    if (num == 0) return;
    const int threads = query.num_threads;
    const Groups groups(query.labels, query.num_members, num);
    Doubles shares(query.num_members);
    for (std::size_t i = 0; i < shares.size(); ++i)
        shares[i] = static_cast<double>(members.opacities[i]) * query.areas[i];
    to_shares(groups, threads, shares);
    const Doubles means = sums_of(members.means, 3, shares, groups, threads);
    const Shapes shapes = shapes_of(query, groups, shares, means);
    for (std::size_t i = 0; i < shares.size(); ++i) shares[i] *= query.visible[i];
    to_shares(groups, threads, shares);
    const Doubles sh = sums_of(members.sh, width, shares, groups, threads);
    constexpr auto largest = static_cast<double>(std::numeric_limits<T>::max());  // scales grow
    for_each_row(num, kMergedPerItem, threads, [&](std::size_t group) {
        if (groups.size(group) == 1) {
            copy_row(members, groups.first(group), width, merged, group);
            return;
        }
        write_quat(&shapes.axes[9 * group], merged.quats + 4 * group);
        merged.opacities[group] = static_cast<T>(shapes.opacities[group]);
        for (std::size_t i = 3 * group; i < 3 * group + 3; ++i) {
            merged.means[i] = static_cast<T>(means[i]);
            merged.scales[i] = static_cast<T>(std::min(shapes.scales[i], largest));
        }
        for (std::size_t i = width * group; i < width * (group + 1); ++i) merged.sh[i] = static_cast<T>(sh[i]);
    });
}

template void cover_members<float>(const Cover<float>&, const MergeColumns<float>&);
template void cover_members<double>(const Cover<double>&, const MergeColumns<double>&);

}  // namespace brushgs
