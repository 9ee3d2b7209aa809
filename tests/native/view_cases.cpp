// What a page makes of a scene beside strokes: up, front, framing, form, relief and stage; of hostile scenes too. These
// use functions of the C library, which round apart on other systems: results are hashed in steps of a millionth.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "brushgs/first_view.hpp"
#include "brushgs/framing.hpp"
#include "brushgs/stage.hpp"
#include "brushgs/stroke_form.hpp"
#include "brushgs/stroke_relief.hpp"
#include "hash.hpp"
#include "inputs.hpp"

namespace native {

namespace {

constexpr std::size_t kCount = 1200;
constexpr double kCones[9] = {0.4122214708, 0.5363325363, 0.0514459929, 0.2119034982, 0.6806995451,
                              0.1073969566, 0.0883024619, 0.2817188376, 0.6299787005};
constexpr double kLab[9] = {0.2104542553, 0.7936177850, -0.0040720468, 1.9779984951, -2.4285922050,
                            0.4505937099, 0.0259040371, 0.7827717662,  -0.8086757660};
constexpr double kWhite[9] = {0.4339, 0.3762, 0.1899, 0.2126, 0.7152, 0.0722, 0.0178, 0.1095, 0.8729};

// Of a hash, what is alike on all systems: steps of a millionth of 1 or of the number itself.
class Steps {
public:
    void add(double value) {
        is_finite_ = is_finite_ && std::isfinite(value);
        const double size = std::abs(value) > 1 ? std::abs(value) : 1;
        steps_.push_back(std::isfinite(value) ? std::round(value / size * 1e6) : 0);
    }
    template <class Values>
    void add_all(const Values& values) {
        for (const auto& value : values) add(static_cast<double>(value));
    }
    bool is_finite() const { return is_finite_; }
    std::uint64_t hash() const {
        Hash hash;
        hash.add(steps_);
        return hash.value();
    }

private:
    std::vector<double> steps_;
    bool is_finite_ = true;
};

// What may be in a file: the readers let only finite numbers and quaternions other than zero pass.
template <class T>
std::vector<std::pair<std::string, Gaussians<T>>> scenes() {
    std::vector<std::pair<std::string, Gaussians<T>>> all;
    const auto add = [&](const char* name, std::size_t count, const auto& change) {
        Gaussians<T> scene(71, count, 1);
        change(scene);
        all.emplace_back(name, std::move(scene));
    };
    const auto fill = [](std::vector<T>& column, double value) {
        for (T& one : column) one = static_cast<T>(value);
    };
    add("usual", kCount, [](auto&) {});
    add("no row", 0, [](auto&) {});
    add("one row", 1, [](auto&) {});
    add("two rows", 2, [](auto&) {});
    add("one place", 40, [&](auto& scene) { fill(scene.means, 0.5); });
    add("a plane", kCount, [](auto& scene) {
        for (std::size_t i = 1; i < scene.means.size(); i += 3) scene.means[i] = 0;
    });
    add("no size", kCount, [&](auto& scene) { fill(scene.scales, 0); });
    add("invisible", kCount, [&](auto& scene) { fill(scene.opacities, 0); });
    add("far", kCount, [](auto& scene) {
        for (std::size_t i = 0; i < 9; ++i) scene.means[i] = static_cast<T>(i % 2 == 0 ? 1e15 : -1e15);
    });
    add("huge", kCount, [](auto& scene) {
        for (std::size_t i = 0; i < 9; ++i) scene.scales[i] = static_cast<T>(1e12);
    });
    add("tiny", kCount, [](auto& scene) {
        for (auto* column : {&scene.means, &scene.scales})
            for (T& value : *column) value *= static_cast<T>(1e-12);
    });
    add("glaring", kCount, [&](auto& scene) { fill(scene.sh, 1e6); });
    return all;
}

template <class T>
Steps first_view(const Gaussians<T>& scene, int num_threads) {
    Steps steps;
    if (scene.count == 0) return steps;  // no caller asks
    const auto sample =
        brushgs::take_view_sample<T>({scene.means.data(), scene.quats.data(), scene.scales.data(),
                                      scene.opacities.data(), scene.sh.data(), scene.count, scene.sh_terms});
    const auto chances = brushgs::up_chances(sample, num_threads);
    steps.add_all(chances);
    steps.add(static_cast<double>(brushgs::believed_axis(chances)));
    constexpr double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (sample.count == 0) return steps;
    const brushgs::Front front = brushgs::find_front(sample, level, num_threads);
    steps.add(front.azimuth);
    steps.add(front.lean);
    return steps;
}

template <class T>
Steps framing(const Gaussians<T>& scene, int) {
    Steps steps;
    if (scene.count == 0) return steps;
    const brushgs::SceneView<T> view{scene.means.data(),     scene.quats.data(), scene.scales.data(),
                                     scene.opacities.data(), scene.sh.data(),    scene.count,
                                     scene.sh_terms};
    constexpr double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, up[3] = {0, -1, 0}, tangents[2] = {0.5, 1};
    steps.add(brushgs::has_surroundings<T>(view, level) ? 1 : 0);
    steps.add_all(brushgs::dense_rows<T>(view));
    steps.add_all(brushgs::attached_rows<T>(view, {{-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4}}));
    steps.add_all(brushgs::find_crumbs<T>(view, up, -0.4, 0.8));
    const std::vector<double> points(scene.means.begin(), scene.means.end());
    const brushgs::Eye eye = brushgs::fit_eye(points.data(), scene.count, tangents);
    steps.add_all(eye.place);
    steps.add(eye.distance);
    return steps;
}

template <class T>
Steps form(const Gaussians<T>& scene, int num_threads) {
    Steps steps;
    if (scene.count == 0) return steps;
    const auto found = brushgs::form_of<T>({scene.means.data(), scene.quats.data(), scene.scales.data(),
                                            scene.sh.data(), scene.count, scene.sh_terms, kWhite, num_threads});
    const auto field = brushgs::form_field<T>(found,
                                              {scene.means.data(), scene.scales.data(), scene.opacities.data(),
                                               scene.sh.data(), scene.count, scene.sh_terms, kWhite},
                                              false);
    std::vector<T> quats(4 * scene.count), scales(3 * scene.count);
    brushgs::turn_strokes(found, field.pairs.data(), field.weights.data(), {}, scene.quats.data(), quats.data(),
                          scales.data());
    steps.add_all(scales);
    steps.add_all(quats);
    return steps;
}

template <class T>
Steps relief(const Gaussians<T>& scene, int) {
    Steps steps;
    if (scene.count == 0) return steps;
    const brushgs::PaintedStrokes<T> strokes{
        scene.scales.data(), scene.opacities.data(), scene.sh.data(), scene.count, scene.sh_terms, kCones, kLab};
    std::vector<double> found(2 * scene.count);
    brushgs::relative_reliefs(strokes, brushgs::median_log_size(scene.scales.data(), scene.count), 0.8,
                              brushgs::light_range(strokes), found.data());
    steps.add_all(found);
    return steps;
}

template <class T>
Steps stage(const Gaussians<T>& scene, int) {
    Steps steps;
    if (scene.count == 0) return steps;
    Random random(72);
    const brushgs::Oklab oklab(kCones, kLab);
    constexpr double axes[9] = {1, 0, 0, 0, -1, 0, 0, 0, 1}, lamp[3] = {-0.56, 0.71, -0.42};
    const auto site = brushgs::find_site<T>({scene.means.data(), scene.quats.data(), scene.scales.data(),
                                             scene.opacities.data(), scene.sh.data(), scene.count, scene.sh_terms},
                                            axes, lamp, oklab);
    const brushgs::Place& place = site.place;
    const double radius = place.radius;
    const auto shadow =
        brushgs::cast_shadow({site.points.data(), site.weights.data(), site.lab.data(), scene.count, radius, lamp});
    const auto profile = brushgs::profile_around(place, 6 * radius, site.ground.extent);
    const auto view = profile.view();
    const auto shades = shadow.view(place);
    const auto usual = brushgs::stroke_sizes(view, place, 6 * radius, 5 * radius);
    const auto draw = [&](std::size_t, std::size_t count) {
        return random.numbers<double>(brushgs::kSpotNoise * count, -1, 1);
    };
    const auto spots =
        brushgs::lay_layers(view, usual.data(), brushgs::size_beside(scene.count), radius, {shades}, draw);
    const auto waves = random.numbers<double>(8 * brushgs::kWaves, 0, 1);
    const auto& maps = site.ground;
    const brushgs::GroundView ground(maps.coverage.data(), maps.lab.data(), maps.extent, radius);
    const auto* const own = maps.is_found ? &ground : nullptr;
    auto lab = brushgs::surface_colors(view, spots.view(), {{0.6, 0.02, 0.03}, {0.4, -0.01, -0.02}, 0.14, 0}, own);
    brushgs::shade_colors(spots.view(), shades, 0.6, own, lab.data());
    const auto frames = brushgs::stage_frames(view, spots.view(), waves.data(), radius, true);
    const auto strokes = brushgs::strokes_on(place, spots.view(), frames.data(), lab.data(),
                                             {2.4, {0.008, 0.004}, nullptr, nullptr}, oklab);
    for (std::size_t i = 0; i < strokes.means.size(); ++i) {
        const std::size_t k = i % 3;
        steps.add((static_cast<double>(strokes.means[i]) - place.foot[k]) / radius);
        steps.add(static_cast<double>(strokes.scales[i]) / radius);
    }
    steps.add_all(strokes.quats);
    steps.add_all(strokes.sh);
    steps.add_all(maps.coverage);
    steps.add_all(maps.lab);
    steps.add(maps.level);
    return steps;
}

}  // namespace

template <class T>
void run_views(Cases& cases) {
    using Work = Steps (*)(const Gaussians<T>&, int);
    const std::pair<const char*, Work> works[] = {{"first view", first_view<T>},
                                                  {"framing", framing<T>},
                                                  {"form", form<T>},
                                                  {"relief", relief<T>},
                                                  {"stage", stage<T>}};
    for (const auto& scene : scenes<T>()) {
        for (const auto& [work_name, work] : works) {
            const std::string name = std::string(work_name) + ", " + scene.first + ": " + name_of_scalar<T>;
            cases.run(name, [&, work = work](int num_threads) { return work(scene.second, num_threads).hash(); });
            cases.hold(name + " is finite", work(scene.second, 1).is_finite());
        }
    }
}

void run_view_cases(Cases& cases) {
    run_views<float>(cases);
    run_views<double>(cases);
}

}  // namespace native
