// Gaussians: projection, its derivative, tracks along a path, and what is nearest to what.
#include <string>
#include <vector>

#include "brushgs/nearest.hpp"
#include "brushgs/project.hpp"
#include "brushgs/project_backward.hpp"
#include "brushgs/track.hpp"
#include "hash.hpp"
#include "inputs.hpp"

namespace native {

namespace {

constexpr int kWidth = 320, kHeight = 200;
constexpr std::size_t kCount = 1500;

// What the cases of projection differ in.
struct Projection {
    const char* name;
    brushgs::Lock lock;
    int sh_degree;
    bool antialiased, fades, with_setbacks;
    double softness;
};
constexpr Projection kProjections[] = {
    {"off", brushgs::Lock::off, 0, false, false, false, 0},
    {"anchor", brushgs::Lock::anchor, 1, true, false, true, 0},
    {"given", brushgs::Lock::given, 2, false, true, false, 0.5},
    {"given all", brushgs::Lock::given, 3, true, true, true, 1.5},
};

template <class T>
struct ProjectionInputs {
    Gaussians<T> gaussians;
    std::vector<double> sigmas;
    std::vector<float> directions, area_scales;
    brushgs::ProjectParams params;

    explicit ProjectionInputs(const Projection& projection)
        : gaussians(11, kCount, static_cast<std::size_t>((projection.sh_degree + 1) * (projection.sh_degree + 1))) {
        Random random(12);
        sigmas = random.numbers<double>(kCount, 1, 3);
        directions = random.numbers<float>(kCount, -3, 3);
        area_scales = random.numbers<float>(kCount, 1, 2);
        const bool is_given = projection.lock == brushgs::Lock::given;
        params = {.view = view_from(0.3, kWidth, kHeight),
                  .num_sigmas = 2,
                  .sigmas_of_row = projection.with_setbacks ? sigmas.data() : nullptr,
                  .low_pass = 0.3,
                  .sh_degree = projection.sh_degree,
                  .num_threads = 1,
                  .lock = projection.lock,
                  .directions = is_given ? directions.data() : nullptr,
                  .area_scales = is_given ? area_scales.data() : nullptr,
                  .antialiased = projection.antialiased,
                  .fades = projection.fades,
                  .with_setbacks = projection.with_setbacks,
                  .softness = projection.softness};
    }
};

template <class T>
std::uint64_t hash_of_boxes(const brushgs::BoxColumns<T>& boxes) {
    Hash hash;
    hash.add(boxes.centers, 2 * boxes.count);
    hash.add(boxes.half_extents, 2 * boxes.count);
    hash.add(boxes.angles, boxes.count);
    hash.add(boxes.depths, boxes.count);
    hash.add(boxes.colors, 3 * boxes.count);
    hash.add(boxes.opacities, boxes.count);
    hash.add(boxes.ids, boxes.count);
    if (boxes.softness != nullptr) hash.add(boxes.softness, boxes.count);
    if (boxes.setbacks != nullptr) hash.add(boxes.setbacks, boxes.count);
    for (const std::size_t culled :
         {boxes.culled.behind_near, boxes.culled.not_finite, boxes.culled.faint, boxes.culled.outside}) {
        const auto number = static_cast<std::uint64_t>(culled);
        hash.add(&number, 1);
    }
    return hash.value();
}

template <class T>
std::uint64_t hash_of_gradients(const ProjectionInputs<T>& inputs, const brushgs::ProjectParams& params) {
    const auto boxes = brushgs::project(inputs.gaussians.columns(), params);
    Random random(13);
    const auto v_centers = random.numbers<T>(2 * boxes.count, -1, 1),
               v_half = random.numbers<T>(2 * boxes.count, -1, 1);
    const auto v_angles = random.numbers<T>(boxes.count, -1, 1), v_depths = random.numbers<T>(boxes.count, -1, 1);
    const auto v_colors = random.numbers<T>(3 * boxes.count, -1, 1),
               v_opacities = random.numbers<T>(boxes.count, -1, 1);
    std::vector<T> v_means(3 * kCount), v_quats(4 * kCount), v_scales(3 * kCount), v_weights(kCount),
        v_sh(inputs.gaussians.sh.size());
    brushgs::project_backward<T>(inputs.gaussians.columns(), params,
                                 {boxes.count, boxes.ids, boxes.colors, v_centers.data(), v_half.data(),
                                  v_angles.data(), v_depths.data(), v_colors.data(), v_opacities.data()},
                                 {v_means.data(), v_quats.data(), v_scales.data(), v_weights.data(), v_sh.data()});
    Hash hash;
    for (const auto* values : {&v_means, &v_quats, &v_scales, &v_weights, &v_sh}) hash.add(*values);
    return hash.value();
}

template <class T>
void run_projections(Cases& cases) {
    for (const Projection& projection : kProjections) {
        const ProjectionInputs<T> inputs(projection);
        const std::string name = std::string(projection.name) + ", " + name_of_scalar<T>;
        cases.run("project: " + name, [&](int num_threads) {
            brushgs::ProjectParams params = inputs.params;
            params.num_threads = num_threads;
            return hash_of_boxes(brushgs::project(inputs.gaussians.columns(), params));
        });
        cases.run("project, backward: " + name, [&](int num_threads) {
            brushgs::ProjectParams params = inputs.params;
            params.num_threads = num_threads;
            params.with_setbacks = false;
            params.softness = 0;
            return hash_of_gradients(inputs, params);
        });
    }
}

template <class T>
void run_tracks(Cases& cases, bool is_moving, bool is_pulled) {
    constexpr std::size_t num_views = 24, count = 300;
    const Gaussians<T> gaussians(21, is_moving ? num_views * count : count, 1);
    std::vector<brushgs::View> views;
    for (std::size_t k = 0; k < num_views; ++k)
        views.push_back(view_from(-0.4 + 0.035 * static_cast<double>(k), kWidth, kHeight));
    Random random(22);
    const auto carried = random.numbers<float>(num_views * count, -3, 3);
    std::vector<std::uint8_t> jumps(num_views * count);
    for (auto& jump : jumps) jump = random.byte() < 8;
    std::vector<brushgs::Turn> targets(num_views * count);
    for (auto& target : targets) target = static_cast<brushgs::Turn>(256 * (random.byte() - 128));
    std::vector<std::uint8_t> pulls(num_views * count);
    for (auto& pull : pulls) pull = static_cast<std::uint8_t>(random.byte());
    for (const bool is_closed : {false, true}) {
        const brushgs::TrackParams all{.views = views.data(),
                                       .num_views = num_views,
                                       .is_closed = is_closed,
                                       .is_coarse = is_moving && is_closed,
                                       .step = 1.5,
                                       .most_turn = 0.2,
                                       .growth = 1.25,
                                       .low_pass = 0.3,
                                       .rows_per_view = is_moving ? count : 0,
                                       .carried = is_moving ? carried.data() : nullptr,
                                       .jumps = is_moving ? jumps.data() : nullptr,
                                       .targets = is_pulled ? targets.data() : nullptr,
                                       .pulls = is_pulled ? pulls.data() : nullptr,
                                       .num_threads = 1};
        const std::string name = std::string(is_moving ? "moving" : "at rest") +
                                 (is_closed ? " on a closed path" : "") + (is_pulled ? ", pulled" : "");
        cases.run("track: " + name + ", " + name_of_scalar<T>, [&](int num_threads) {
            brushgs::TrackParams params = all;
            params.num_threads = num_threads;
            auto columns = gaussians.columns();
            columns.count = count;
            const auto tracks = brushgs::track_directions(columns, params);
            Hash hash;
            hash.add(tracks.turns.get(), num_views * count);
            hash.add(tracks.area_scales.get(), num_views * count);
            return hash.value();
        });
    }
}

void run_nearest(Cases& cases) {
    constexpr std::size_t num_points = 2000, num_centers = 70, num_dimensions = 9, num_neighbors = 6;
    Random random(31);
    const auto points = random.numbers<float>(num_points * num_dimensions, -1, 1);
    const auto centers = random.numbers<double>(num_centers * num_dimensions, -1, 1);
    const auto places = random.numbers<double>(num_points * 3, -1, 1);
    cases.run("nearest", [&](int num_threads) {
        const auto found = brushgs::find_nearest(
            {points.data(), centers.data(), num_points, num_centers, num_dimensions, num_threads});
        Hash hash;
        hash.add(found.distances.get(), num_points);
        hash.add(found.rows.get(), num_points);
        return hash.value();
    });
    cases.run("neighbors", [&](int num_threads) {
        std::vector<std::int32_t> rows(num_points * num_neighbors);
        brushgs::find_neighbors({places.data(), num_points, num_neighbors, 3, num_threads}, rows.data());
        Hash hash;
        hash.add(rows);
        return hash.value();
    });
}

}  // namespace

void run_gaussian_cases(Cases& cases) {
    run_projections<float>(cases);
    run_projections<double>(cases);
    for (const bool is_moving : {false, true}) {
        for (const bool is_pulled : {false, true}) {
            run_tracks<float>(cases, is_moving, is_pulled);
            run_tracks<double>(cases, is_moving, is_pulled);
        }
    }
    run_nearest(cases);
}

}  // namespace native
