// Python: rows of points and Gaussians, their neighbors, groups and orders.
#include <algorithm>

#include "bindings.hpp"
#include "brushgs/components.hpp"
#include "brushgs/gaps.hpp"
#include "brushgs/groups.hpp"
#include "brushgs/halves.hpp"
#include "brushgs/key_order.hpp"
#include "brushgs/light_along.hpp"
#include "brushgs/lloyd.hpp"
#include "brushgs/moments.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/streamlines.hpp"

namespace bindings {

namespace {

// Arrays

nb::tuple nearest(In<float, 2> points, In<double, 2> centers, int num_threads) {
    const brushgs::NearestQuery query{.points = points.data(),
                                      .centers = centers.data(),
                                      .num_points = points.shape(0),
                                      .num_centers = centers.shape(0),
                                      .num_dimensions = points.shape(1),
                                      .num_threads = num_threads};
    brushgs::Nearest found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_nearest(query);
    }
    return nb::make_tuple(row(std::move(found.distances), query.num_points),
                          row(std::move(found.rows), query.num_points));
}

brushgs::PointGroups point_groups(const In<float, 2>& points, const In<double, 2>& centers,
                                  const In<std::int32_t, 1>& rows, const In<std::int64_t, 1>& begins) {
    return {.points = points.data(),
            .centers = centers.data(),
            .rows = rows.data(),
            .begins = begins.data(),
            .num_points = points.shape(0),
            .num_groups = centers.shape(0),
            .num_dimensions = points.shape(1)};
}

nb::tuple nearest_again(In<float, 2> points, In<double, 2> centers, In<std::int32_t, 1> rows,
                        In<std::int64_t, 1> begins, int num_threads) {
    const auto groups = point_groups(points, centers, rows, begins);
    brushgs::Nearest found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_nearest_again(groups, num_threads);
    }
    return nb::make_tuple(row(std::move(found.distances), groups.num_points),
                          row(std::move(found.rows), groups.num_points));
}

void nearer(In<float, 2> points, In<double, 2> centers, In<std::int32_t, 1> rows, In<std::int64_t, 1> begins,
            In<double, 2> others, std::int32_t first, Out<double, 1> distances, Out<std::int32_t, 1> labels,
            int num_threads) {
    const auto groups = point_groups(points, centers, rows, begins);
    const brushgs::NearerQuery query{.others = others.data(),
                                     .num_others = others.shape(0),
                                     .first = first,
                                     .num_threads = num_threads,
                                     .distances = distances.data(),
                                     .labels = labels.data()};
    const nb::gil_scoped_release without_gil;
    brushgs::find_nearer(groups, query);
}

void neighbors(In<double, 2> points, Out<std::int32_t, 2> rows, int num_threads) {
    const brushgs::NeighborQuery query{.points = points.data(),
                                       .num_points = points.shape(0),
                                       .num_neighbors = rows.shape(1),
                                       .num_dimensions = points.shape(1),
                                       .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::find_neighbors(query, rows.data());
}

void several_nearest(In<double, 2> points, In<double, 2> queries, Out<double, 2> distances, Out<std::int32_t, 2> rows,
                     int num_threads) {
    const brushgs::SeveralQuery query{.points = points.data(),
                                      .queries = queries.data(),
                                      .num_points = points.shape(0),
                                      .num_queries = queries.shape(0),
                                      .num_nearest = rows.shape(1),
                                      .num_dimensions = points.shape(1),
                                      .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::find_several(query, distances.data(), rows.data());
}

void components(In<std::int64_t, 1> a, In<std::int64_t, 1> b, Out<std::int32_t, 1> components) {
    const brushgs::Links links{a.data(), b.data(), a.shape(0)};
    const nb::gil_scoped_release without_gil;
    brushgs::find_components(links, components.data(), components.shape(0));
}

nb::tuple trace_lines(In<float, 3> directions, In<float, 2> spacing, In<double, 2> taken, In<double, 2> seeds,
                      In<double, 1> factors, double step, double shortest, double longest, double end) {
    const brushgs::LineField field{directions.data(), spacing.data(), spacing.shape(1), spacing.shape(0)};
    const brushgs::LineRules rules{.taken = taken.data(),
                                   .num_taken = taken.shape(0),
                                   .seeds = seeds.data(),
                                   .num_seeds = seeds.shape(0),
                                   .factors = factors.data(),
                                   .num_levels = factors.shape(0),
                                   .step = step,
                                   .shortest = shortest,
                                   .longest = longest,
                                   .end = end};
    brushgs::TracedLines lines;
    {
        const nb::gil_scoped_release without_gil;
        lines = brushgs::trace_lines(field, rules);
    }
    return nb::make_tuple(to_array(std::move(lines.points)), to_array(std::move(lines.begins)),
                          to_array(std::move(lines.levels)));
}

brushgs::WeightedPoints weighted_points(const In<float, 2>& points, const In<double, 1>& weights) {
    return {.points = points.data(),
            .weights = weights.data(),
            .num_points = points.shape(0),
            .num_dimensions = points.shape(1)};
}

nb::object start_centers(In<float, 2> points, In<double, 1> weights, std::size_t num_clusters, In<double, 1> draws,
                         int num_threads) {
    brushgs::Buffer<double> centers;
    std::size_t count = 0;
    {
        const nb::gil_scoped_release without_gil;
        const auto found =
            brushgs::start_centers(weighted_points(points, weights), num_clusters, draws.data(), num_threads);
        centers = brushgs::make_buffer<double>(found.size());
        std::copy(found.begin(), found.end(), centers.get());
        count = found.size() / points.shape(1);
    }
    return table(centers, count, points.shape(1));
}

nb::tuple find_clusters(In<float, 2> points, In<double, 1> weights, std::size_t num_clusters, In<double, 1> draws,
                        int num_steps, double gain, int num_threads) {
    brushgs::Clusters found;
    {
        const nb::gil_scoped_release without_gil;
        found = brushgs::find_clusters(weighted_points(points, weights), {.num_clusters = num_clusters,
                                                                          .draws = draws.data(),
                                                                          .num_steps = num_steps,
                                                                          .gain = gain,
                                                                          .num_threads = num_threads});
    }
    return nb::make_tuple(row(std::move(found.labels), points.shape(0)), found.num_clusters, found.num_steps,
                          found.inertia);
}

// Rows by label, and in order

nb::tuple group_rows(In<std::int32_t, 1> labels, std::size_t num_groups) {
    const std::size_t count = labels.shape(0);
    auto rows = brushgs::make_buffer<std::int32_t>(count);
    auto begins = brushgs::make_buffer<std::int64_t>(num_groups + 1);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::group_rows(labels.data(), count, num_groups, rows.get(), begins.get());
    }
    return nb::make_tuple(row(rows, count), row(begins, num_groups + 1));
}

template <class T>
nb::tuple sum_groups(In<T, 2> values, In<double, 1> weights, In<std::int32_t, 1> rows, In<std::int64_t, 1> begins,
                     int num_threads) {
    const std::size_t num_groups = begins.shape(0) - 1, width = values.shape(1);
    auto totals = brushgs::make_buffer<double>(num_groups), sums = brushgs::make_buffer<double>(num_groups * width);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::sum_groups(brushgs::GroupSums<T>{.values = values.data(),
                                                  .weights = weights.data(),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = num_groups,
                                                  .width = width,
                                                  .num_threads = num_threads,
                                                  .totals = totals.get(),
                                                  .sums = sums.get()});
    }
    return nb::make_tuple(row(totals, num_groups), table(sums, num_groups, width));
}

template <class T>
void add_rows(Out<double, 2> totals, In<std::int32_t, 1> rows, In<T, 2> values) {
    const nb::gil_scoped_release without_gil;
    brushgs::add_rows(brushgs::RowAddends<T>{.values = values.data(),
                                             .rows = rows.data(),
                                             .num_rows = rows.shape(0),
                                             .width = totals.shape(1),
                                             .totals = totals.data()});
}

template <class T>
nb::object halves(In<T, 2> points, In<double, 1> weights, std::optional<In<T, 3>> spans, In<std::int32_t, 1> rows,
                  In<std::int64_t, 1> begins, double least_span, int num_steps, int num_threads) {
    if (points.shape(1) < 3 || points.shape(1) > brushgs::kMostFeatures)
        throw nb::value_error("halves: points must have 3 to 16 features");
    auto is_second = brushgs::make_buffer<std::uint8_t>(rows.shape(0));
    {
        const nb::gil_scoped_release without_gil;
        brushgs::halve_groups(brushgs::Halving<T>{.points = points.data(),
                                                  .num_features = points.shape(1),
                                                  .weights = weights.data(),
                                                  .spans = data_or_null(spans),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = begins.shape(0) - 1,
                                                  .least_span = least_span,
                                                  .num_steps = num_steps,
                                                  .num_threads = num_threads,
                                                  .is_second = is_second.get()});
    }
    return row(is_second, rows.shape(0));
}

template <class T>
nb::object projected_areas(In<T, 2> scales, double finest, int num_threads) {
    const std::size_t count = scales.shape(0);
    auto areas = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::projected_areas(scales.data(), count, finest, num_threads, areas.get());
    }
    return row(areas, count);
}

template <class T>
nb::object seen_scales(In<T, 2> scales, double finest, int num_threads) {
    const std::size_t count = scales.shape(0);
    auto seen = brushgs::make_buffer<double>(3 * count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::seen_scales(scales.data(), count, finest, num_threads, seen.get());
    }
    return table(seen, count, 3);
}

template <class T>
nb::tuple sum_covariances(In<T, 2> means, In<T, 2> quats, In<T, 2> scales, In<double, 1> shares,
                          In<std::int32_t, 1> rows, In<std::int64_t, 1> begins, In<double, 2> centers,
                          int num_threads) {
    const std::size_t num_groups = centers.shape(0);
    auto within = brushgs::make_buffer<double>(9 * num_groups), between = brushgs::make_buffer<double>(9 * num_groups);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::sum_covariances(brushgs::Covariances<T>{.means = means.data(),
                                                         .quats = quats.data(),
                                                         .scales = scales.data(),
                                                         .shares = shares.data(),
                                                         .rows = rows.data(),
                                                         .begins = begins.data(),
                                                         .centers = centers.data(),
                                                         .num_groups = num_groups,
                                                         .num_threads = num_threads,
                                                         .within = within.get(),
                                                         .between = between.get()});
    }
    return nb::make_tuple(matrices(within, num_groups), matrices(between, num_groups));
}

nb::tuple principal_axes(In<double, 3> covariances, int num_threads) {
    const std::size_t count = covariances.shape(0);
    auto scales = brushgs::make_buffer<double>(3 * count), axes = brushgs::make_buffer<double>(9 * count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::principal_axes(covariances.data(), count, num_threads, scales.get(), axes.get());
    }
    return nb::make_tuple(table(scales, count, 3), matrices(axes, count));
}

template <class T>
nb::object stop_groups(In<T, 1> opacities, In<double, 1> areas, In<double, 1> footprints, In<std::int32_t, 1> rows,
                       In<std::int64_t, 1> begins, int num_threads) {
    const std::size_t num_groups = footprints.shape(0);
    auto stopped = brushgs::make_buffer<double>(num_groups);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::stop_groups(brushgs::Stopping<T>{.opacities = opacities.data(),
                                                  .areas = areas.data(),
                                                  .footprints = footprints.data(),
                                                  .rows = rows.data(),
                                                  .begins = begins.data(),
                                                  .num_groups = num_groups,
                                                  .num_threads = num_threads,
                                                  .stopped = stopped.get()});
    }
    return row(stopped, num_groups);
}

nb::object growth(In<double, 2> means, In<double, 2> scales, In<double, 3> axes, In<double, 1> opacities,
                  int num_threads) {
    const std::size_t count = means.shape(0);
    auto growth = brushgs::make_buffer<double>(count);
    {
        const nb::gil_scoped_release without_gil;
        brushgs::find_growth({.means = means.data(),
                              .scales = scales.data(),
                              .axes = axes.data(),
                              .opacities = opacities.data(),
                              .num_strokes = count,
                              .num_threads = num_threads,
                              .growth = growth.get()});
    }
    return row(growth, count);
}

template <class T>
nb::object morton_order(In<T, 2> points, In<double, 1> low, double step, int num_threads) {
    const std::size_t count = points.shape(0);
    auto order = brushgs::make_buffer<std::int64_t>(count);
    {
        const nb::gil_scoped_release without_gil;
        const auto keys = brushgs::make_buffer<std::uint64_t>(count);
        brushgs::morton_keys(points.data(), count, low.data(), step, num_threads, keys.get());
        const auto rows = brushgs::rows_by_key(keys.get(), count, num_threads);
        std::copy_n(rows.get(), count, order.get());
    }
    return row(order, count);
}

template <class T>
nb::object curve_order(In<T, 2> points, int num_threads) {
    const std::size_t count = points.shape(0);
    auto order = brushgs::make_buffer<std::int64_t>(count);
    {
        const nb::gil_scoped_release without_gil;
        const auto rows = brushgs::rows_along_curve(points.data(), count, points.shape(1), num_threads);
        std::copy_n(rows.get(), count, order.get());
    }
    return row(order, count);
}

void light_along(In<double, 1> places, In<double, 1> depths, double reach, Out<double, 1> from_above,
                 Out<double, 1> from_below) {
    const nb::gil_scoped_release without_gil;
    brushgs::light_along({.places = places.data(),
                          .depths = depths.data(),
                          .count = places.shape(0),
                          .reach = reach,
                          .from_above = from_above.data(),
                          .from_below = from_below.data()});
}

template <class T>
void def_groups(nb::module_& m) {
    m.def("sum_groups", &sum_groups<T>, "values"_a.noconvert(), "weights"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "num_threads"_a,
          "Of the groups that `group_rows` found, the sums [k] of the weights [N] and [k, D] of weight x values "
          "[N, D], added in the order of the rows.");
    m.def("add_rows", &add_rows<T>, "totals"_a.noconvert(), "rows"_a.noconvert(), "values"_a.noconvert(),
          "Add values [n, D], one after the other, to these rows [n] of totals [N, D].");
    m.def(
        "halves", &halves<T>, "points"_a.noconvert(), "weights"_a.noconvert(), "spans"_a.noconvert().none(),
        "rows"_a.noconvert(), "begins"_a.noconvert(), "least_span"_a, "num_steps"_a, "num_threads"_a,
        "Cut groups of points [N, D], as `group_rows` lists them, in two: [N] uint8 in the order of `rows`, 0 for the "
        "half of a group's first row. `spans` [N, 3, 3] or None, see halves.hpp.");
    m.def("morton_order", &morton_order<T>, "points"_a.noconvert(), "low"_a.noconvert(), "step"_a, "num_threads"_a,
          "The rows [N] int64 of points [N, 3] along the Morton curve of (point - low) * step, ties by row.");
    m.def("morton_order", &curve_order<T>, "points"_a.noconvert(), "num_threads"_a,
          "The same along the curve with 2^21 steps over the largest extent of the points [N, D], of which the first "
          "three numbers count.");
}

template <class T>
void def_moments(nb::module_& m) {
    m.def("projected_areas", &projected_areas<T>, "scales"_a.noconvert(), "finest"_a, "num_threads"_a,
          "The mean projected area over pi [N] of ellipsoids of half axes [N, 3], as visible in pictures.");
    m.def("seen_scales", &seen_scales<T>, "scales"_a.noconvert(), "finest"_a, "num_threads"_a,
          "Half axes [N, 3] as visible in pictures, see moments.hpp.");
    m.def("sum_covariances", &sum_covariances<T>, "means"_a.noconvert(), "quats"_a.noconvert(), "scales"_a.noconvert(),
          "shares"_a.noconvert(), "rows"_a.noconvert(), "begins"_a.noconvert(), "centers"_a.noconvert(),
          "num_threads"_a,
          "Of the groups that `group_rows` found, with centers [k, 3], the mean covariance of their members and the "
          "covariance of their means, [k, 3, 3] each, weighted by shares [N].");
    m.def("stop_groups", &stop_groups<T>, "opacities"_a.noconvert(), "areas"_a.noconvert(), "footprints"_a.noconvert(),
          "rows"_a.noconvert(), "begins"_a.noconvert(), "num_threads"_a,
          "The probability [k] that a ray through each footprint [k] is stopped by the members of a group, of "
          "opacities [N] and areas [N], at random places in it.");
}

}  // namespace

void bind_rows(nb::module_& m) {
    m.def("nearest", &nearest, "points"_a.noconvert(), "centers"_a.noconvert(), "num_threads"_a,
          "For points [N, D], D at most MOST_DIMENSIONS, the distance [N] to the nearest of the centers [k, D], and "
          "its row [N] int32, the first of equally near ones.");
    m.def("most_draws", &brushgs::most_draws, "num_clusters"_a, "How many random numbers a start of k-means may use.");
    m.def("start_centers", &start_centers, "points"_a.noconvert(), "weights"_a.noconvert(), "num_clusters"_a,
          "draws"_a.noconvert(), "num_threads"_a,
          "First centers [k, D] of k-means over points [N, D] along a curve, with weights [N] and draws [most_draws] "
          "from 0 to 1, see lloyd.hpp.");
    m.def("find_clusters", &find_clusters, nb::kw_only(), "points"_a.noconvert(), "weights"_a.noconvert(),
          "num_clusters"_a, "draws"_a.noconvert(), "num_steps"_a, "gain"_a, "num_threads"_a,
          "Cluster points [N, D] in any order: labels [N] int32, their number, that of the steps, and the inertia, see "
          "lloyd.hpp.");
    m.def("nearest_again", &nearest_again, "points"_a.noconvert(), "centers"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "num_threads"_a,
          "What `nearest` gives, sooner for points that `group_rows` groups by what was nearest before.");
    m.def("nearer", &nearer, "points"_a.noconvert(), "centers"_a.noconvert(), "rows"_a.noconvert(),
          "begins"_a.noconvert(), "others"_a.noconvert(), "first"_a, "distances"_a.noconvert(), "labels"_a.noconvert(),
          "num_threads"_a,
          "Bring distances [N] and labels [N] int32 of what is nearest to points [N, D], which `group_rows` groups by "
          "these labels, up to date where one of the others [m, D], labelled from `first` on, is nearer.");
    m.def("group_rows", &group_rows, "labels"_a.noconvert(), "num_groups"_a,
          "The rows [N] int32 of labels [N] int32 group by group, each ascending, and where the groups begin [k + 1].");
    def_groups<float>(m);
    def_groups<double>(m);
    def_moments<float>(m);
    def_moments<double>(m);
    m.def("principal_axes", &principal_axes, "covariances"_a.noconvert(), "num_threads"_a,
          "Standard deviations [N, 3], ascending, and axes [N, 3, 3], as columns, of covariances; see moments.hpp.");
    m.def("growth", &growth, "means"_a.noconvert(), "scales"_a.noconvert(), "axes"_a.noconvert(),
          "opacities"_a.noconvert(), "num_threads"_a, "The growth [k] of strokes that closes gaps, see gaps.hpp.");
    m.def("light_along", &light_along, "places"_a.noconvert(), "depths"_a.noconvert(), "reach"_a,
          "from_above"_a.noconvert(), "from_below"_a.noconvert(),
          "Write for places [N] on a line minus the optical depth [N] of what lies above each and below each, within "
          "reach, see light_along.hpp.");
    m.def("neighbors", &neighbors, "points"_a.noconvert(), "rows"_a.noconvert(), "num_threads"_a,
          "Write for each of the points [N, D] the rows [N, k] int32 of the k others nearest to it, nearest first, "
          "ties by row; k is below N and at most MOST_NEIGHBORS.");
    m.def("several_nearest", &several_nearest, "points"_a.noconvert(), "queries"_a.noconvert(),
          "distances"_a.noconvert(), "rows"_a.noconvert(), "num_threads"_a,
          "Write for each of the queries [Q, D] the distances [Q, k] and rows [Q, k] int32 of the k points [N, D] "
          "nearest to it, nearest first, ties by row; k is at most N and MOST_NEIGHBORS.");
    m.def("components", &components, "a"_a.noconvert(), "b"_a.noconvert(), "components"_a.noconvert(),
          "Write for each of N rows its component [N] int32, by the links a [M] to b [M] between rows. Components are "
          "numbered from 0, in the order of their first rows.");
    m.def("trace_lines", &trace_lines, "directions"_a.noconvert(), "spacing"_a.noconvert(), "taken"_a.noconvert(),
          "seeds"_a.noconvert(), "factors"_a.noconvert(), nb::kw_only(), "step"_a, "shortest"_a, "longest"_a, "end"_a,
          "Evenly spaced lines along the directions [H, W, 2] of a picture (cosine and sine of twice the angle), at "
          "the spacing [H, W] in pixels, 0 where there are none; dots where `step` is 0. See `LineRules`. Returns "
          "points [2 P] (x, y), the first point of each line [L + 1] int64, and its level [L] int32.");
}

}  // namespace bindings
