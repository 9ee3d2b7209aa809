// Python: what is done to pictures, and the copies of stroke images.
#include "bindings.hpp"
#include "brushgs/coats.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/light.hpp"
#include "brushgs/oklab.hpp"
#include "brushgs/photometric.hpp"
#include "brushgs/press.hpp"
#include "brushgs/stroke_levels.hpp"
#include "brushgs/wet.hpp"

namespace bindings {

namespace {

template <class T>
void finish(In<T, 3> rgb, In<T, 2> alpha, AnyIn<T> background, int num_threads, Out<std::uint8_t, 3> bytes) {
    const nb::gil_scoped_release without_gil;
    brushgs::finish(rgb.data(), alpha.data(), background.data(), background.ndim() == 3, alpha.size(), num_threads,
                    bytes.data());
}

template <class T>
void def_finish(nb::module_& m) {
    m.def("finish", &finish<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "background"_a.noconvert(),
          "num_threads"_a, "bytes"_a.noconvert(),
          "Write a picture on a background, [3] or [H, W, 3], to bytes [H, W, 3].");
}

template <class T>
void press(In<T, 3> rgb, In<T, 2> alpha, In<T, 2> grain, double dry, double softness, Out<T, 3> pressed_rgb,
           Out<T, 2> pressed_alpha) {
    const nb::gil_scoped_release without_gil;
    brushgs::press<T>({.rgb = rgb.data(),
                       .alpha = alpha.data(),
                       .grain = grain.data(),
                       .dry = static_cast<T>(dry),
                       .softness = static_cast<T>(softness),
                       .num_pixels = alpha.size(),
                       .pressed_rgb = pressed_rgb.data(),
                       .pressed_alpha = pressed_alpha.data()});
}

template <class T>
void def_press(nb::module_& m) {
    m.def("press", &press<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "grain"_a.noconvert(), "dry"_a,
          "softness"_a, "pressed_rgb"_a.noconvert(), "pressed_alpha"_a.noconvert(),
          "Write the part of a picture that the grain of a paper takes, see brushgs/rendering/tooth.py.");
}

template <class T>
void lay_over(In<T, 3> rgb, In<T, 2> alpha, std::optional<In<T, 2>> depth, std::optional<In<T, 2>> height,
              Out<T, 3> below_rgb, Out<T, 2> below_alpha, std::optional<Out<T, 2>> below_depth,
              std::optional<Out<T, 2>> below_height, double hidden, int num_threads) {
    const bool has_depth = depth && below_depth, has_height = height && below_height;
    const brushgs::Layer<T> front{rgb.data(), alpha.data(), data_or_null(depth), data_or_null(height)};
    const brushgs::LayerOut<T> out{below_rgb.data(), below_alpha.data(), has_depth ? below_depth->data() : nullptr,
                                   has_height ? below_height->data() : nullptr};
    const nb::gil_scoped_release without_gil;
    brushgs::lay_over<T>(front, {out.rgb, out.alpha, out.depth, out.height}, static_cast<T>(hidden), alpha.size(),
                         num_threads, out);
}

template <class T>
void lay_on_ground(In<T, 3> rgb, In<T, 2> alpha, In<T, 3> ground, std::optional<In<T, 3>> tint, Out<T, 3> picture,
                   int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::lay_on_ground<T>(rgb.data(), alpha.data(), ground.data(), data_or_null(tint), alpha.size(), num_threads,
                              picture.data());
}

template <class T>
void raise_ground(In<T, 2> alpha, In<T, 2> ground, std::optional<In<T, 2>> paint, double hidden, Out<T, 2> height,
                  int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::raise_ground<T>(alpha.data(), ground.data(), data_or_null(paint), static_cast<T>(hidden), alpha.size(),
                             num_threads, height.data());
}

template <class T>
void def_coats(nb::module_& m) {
    m.def("lay_over", &lay_over<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "depth"_a.noconvert().none(), "height"_a.noconvert().none(), "below_rgb"_a.noconvert(),
          "below_alpha"_a.noconvert(), "below_depth"_a.noconvert().none(), "below_height"_a.noconvert().none(),
          "hidden"_a, "num_threads"_a,
          "Lay a frame over the one below, in place; depth and height only where both have them. See coats.hpp.");
    m.def("lay_on_ground", &lay_on_ground<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "ground"_a.noconvert(), "tint"_a.noconvert().none(), "picture"_a.noconvert(), "num_threads"_a,
          "Write the picture of a frame on its ground, which is seen through a tint. See coats.hpp.");
    m.def("raise_ground", &raise_ground<T>, nb::kw_only(), "alpha"_a.noconvert(), "ground"_a.noconvert(),
          "paint"_a.noconvert().none(), "hidden"_a, "height"_a.noconvert(), "num_threads"_a,
          "Write the height of a ground under paint, and of the paint. See coats.hpp.");
}

template <class T>
void light(In<T, 3> rgb, In<T, 2> height, std::optional<In<T, 2>> alpha, In<double, 1> blur, In<double, 1> lamp,
           In<double, 1> half_way, double strength, double gloss, int exponent, int num_threads, Out<T, 3> lit) {
    const brushgs::LightParams<T> params{.rgb = rgb.data(),
                                         .heights = height.data(),
                                         .alpha = data_or_null(alpha),
                                         .lit = lit.data(),
                                         .width = static_cast<int>(rgb.shape(1)),
                                         .height = static_cast<int>(rgb.shape(0)),
                                         .blur = {blur.data(), blur.size()},
                                         .lamp = {lamp(0), lamp(1)},
                                         .half_way = {half_way(0), half_way(1)},
                                         .strength = strength,
                                         .gloss = gloss,
                                         .exponent = exponent,
                                         .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::light(params);
}

template <class T>
void def_light(nb::module_& m) {
    m.def("light", &light<T>, nb::kw_only(), "rgb"_a.noconvert(), "height"_a.noconvert(), "alpha"_a.noconvert().none(),
          "blur"_a.noconvert(), "lamp"_a.noconvert(), "half_way"_a.noconvert(), "strength"_a, "gloss"_a, "exponent"_a,
          "num_threads"_a, "lit"_a.noconvert(),
          "Write a picture [H, W, 3] in the light that falls on its height [H, W], see light.hpp. blur: the weights of "
          "an odd number of pixels; lamp and half_way: x and y of these directions, over their z.");
}

template <class T>
void space_noise(In<T, 2> depth, In<double, 2> rays, In<double, 1> focus, double reach, double finest, int octaves,
                 std::uint32_t seed, int num_threads, Out<T, 3> noise) {
    brushgs::SpaceNoiseParams<T> params{};
    params.depth = depth.data();
    params.noise = noise.data();
    params.width = static_cast<int>(depth.shape(1));
    params.height = static_cast<int>(depth.shape(0));
    params.reach = reach;
    params.finest = finest;
    params.octaves = octaves;
    params.seed = seed;
    params.num_threads = num_threads;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        params.across[axis] = rays(0, axis);
        params.down[axis] = rays(1, axis);
        params.corner[axis] = rays(2, axis);
        params.origin[axis] = rays(3, axis);
        params.focus[axis] = focus(axis);
    }
    const nb::gil_scoped_release without_gil;
    brushgs::space_noise(params);
}

template <class T>
void smooth_planes(Out<T, 3> planes, std::optional<In<T, 3>> guide, std::optional<In<T, 2>> hold, double sigma,
                   int rounds, int num_threads) {
    const brushgs::SmoothParams<T> params{.planes = planes.data(),
                                          .guide = data_or_null(guide),
                                          .hold = data_or_null(hold),
                                          .width = static_cast<int>(planes.shape(1)),
                                          .height = static_cast<int>(planes.shape(0)),
                                          .channels = static_cast<int>(planes.shape(2)),
                                          .sigma = sigma,
                                          .rounds = rounds,
                                          .num_threads = num_threads};
    if (params.channels != 1 && params.channels != 3)
        throw nb::value_error("smooth_planes: planes must have 1 or 3 channels");
    const nb::gil_scoped_release without_gil;
    brushgs::smooth_planes(params);
}

template <class T>
void key_colors(In<T, 3> rgb, In<T, 2> alpha, double low, double high, double darkest, double gamma, double chroma,
                double solid, int num_threads, Out<T, 3> keyed) {
    const brushgs::KeyParams<T> params{.rgb = rgb.data(),
                                       .alpha = alpha.data(),
                                       .keyed = keyed.data(),
                                       .num_pixels = alpha.size(),
                                       .low = static_cast<T>(low),
                                       .high = static_cast<T>(high),
                                       .darkest = static_cast<T>(darkest),
                                       .gamma = static_cast<T>(gamma),
                                       .chroma = static_cast<T>(chroma),
                                       .solid = static_cast<T>(solid),
                                       .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    brushgs::key_colors(params);
}

template <class T>
brushgs::WashNumbers<T> wash_numbers(const In<double, 1>& values) {
    brushgs::WashNumbers<T> numbers;
    static_assert(sizeof numbers % sizeof(T) == 0);
    if (values.size() != sizeof numbers / sizeof(T)) throw nb::value_error("numbers must be those of Washes");
    T* const to = reinterpret_cast<T*>(&numbers);
    for (std::size_t i = 0; i < values.size(); ++i) to[i] = static_cast<T>(values(i));
    return numbers;
}

template <class T>
void part_washes(In<T, 3> coarse, In<T, 3> middle, In<T, 3> fine, In<T, 3> noise, In<double, 1> numbers,
                 int num_threads, Out<T, 3> densities, Out<T, 3> means, Out<T, 2> tones) {
    const brushgs::WashParams<T> params{.coarse = coarse.data(),
                                        .middle = middle.data(),
                                        .fine = fine.data(),
                                        .noise = noise.data(),
                                        .densities = densities.data(),
                                        .means = means.data(),
                                        .tones = tones.data(),
                                        .num_pixels = tones.size(),
                                        .num_threads = num_threads};
    const auto of_washes = wash_numbers<T>(numbers);
    const nb::gil_scoped_release without_gil;
    brushgs::part_washes(params, of_washes);
}

template <class T>
void mix_washes(In<T, 3> densities, In<T, 3> means, In<T, 3> blurred, In<T, 2> tones, In<T, 3> noise, In<T, 2> alpha,
                std::optional<In<T, 3>> soft, std::optional<In<T, 2>> grain, std::optional<In<T, 2>> border,
                std::optional<In<T, 3>> paper, In<double, 1> numbers, int num_threads, Out<T, 3> rgb,
                Out<T, 2> covered) {
    const brushgs::MixParams<T> params{.densities = densities.data(),
                                       .means = means.data(),
                                       .blurred = blurred.data(),
                                       .tones = tones.data(),
                                       .noise = noise.data(),
                                       .alpha = alpha.data(),
                                       .soft = data_or_null(soft),
                                       .grain = data_or_null(grain),
                                       .border = data_or_null(border),
                                       .paper = data_or_null(paper),
                                       .rgb = rgb.data(),
                                       .covered = covered.data(),
                                       .num_pixels = alpha.size(),
                                       .num_threads = num_threads};
    const auto of_washes = wash_numbers<T>(numbers);
    const nb::gil_scoped_release without_gil;
    brushgs::mix_washes(params, of_washes);
}

template <class T>
void def_wet(nb::module_& m) {
    m.def("space_noise", &space_noise<T>, nb::kw_only(), "depth"_a.noconvert(), "rays"_a.noconvert(),
          "focus"_a.noconvert(), "reach"_a, "finest"_a, "octaves"_a, "seed"_a, "num_threads"_a, "noise"_a.noconvert(),
          "Write noise [H, W, 3] at the points of space that a depth [H, W] shows, see wet.hpp.");
    m.def("smooth_planes", &smooth_planes<T>, nb::kw_only(), "planes"_a.noconvert(), "guide"_a.noconvert().none(),
          "hold"_a.noconvert().none(), "sigma"_a, "rounds"_a, "num_threads"_a,
          "Smooth planes [H, W, 1 or 3] in place, held back by the steps of a guide [H, W, 3], see wet.hpp.");
    m.def("key_colors", &key_colors<T>, nb::kw_only(), "rgb"_a.noconvert(), "alpha"_a.noconvert(), "low"_a, "high"_a,
          "darkest"_a, "gamma"_a, "chroma"_a, "solid"_a, "num_threads"_a, "keyed"_a.noconvert(),
          "Write the colors [H, W, 3] of a picture as those of a watercolour on white, see wet.hpp.");
    m.def("part_washes", &part_washes<T>, nb::kw_only(), "coarse"_a.noconvert(), "middle"_a.noconvert(),
          "fine"_a.noconvert(), "noise"_a.noconvert(), "numbers"_a.noconvert(), "num_threads"_a,
          "densities"_a.noconvert(), "means"_a.noconvert(), "tones"_a.noconvert(),
          "Write the densities [H, W, 9] of three washes, their means [H, W, 3] and a tone [H, W], see wet.hpp.");
    m.def("mix_washes", &mix_washes<T>, nb::kw_only(), "densities"_a.noconvert(), "means"_a.noconvert(),
          "blurred"_a.noconvert(), "tones"_a.noconvert(), "noise"_a.noconvert(), "alpha"_a.noconvert(),
          "soft"_a.noconvert().none(), "grain"_a.noconvert().none(), "border"_a.noconvert().none(),
          "paper"_a.noconvert().none(), "numbers"_a.noconvert(), "num_threads"_a, "rgb"_a.noconvert(),
          "covered"_a.noconvert(), "Write the covering paint of three washes on a paper, see wet.hpp.");
}

template <class T>
double photometric(In<T, 3> painted, In<T, 3> target, In<double, 1> window, double share,
                   std::pair<double, double> stabilizers, int num_threads, Out<T, 3> gradient) {
    if (window.size() != brushgs::kWindowTaps) throw nb::value_error("photometric: window must have 11 weights");
    if (const auto channels = painted.shape(2); channels != 1 && channels != 3)
        throw nb::value_error("photometric: pictures must have 1 or 3 channels");
    const brushgs::PhotometricParams<T> params{.painted = painted.data(),
                                               .target = target.data(),
                                               .gradient = gradient.data(),
                                               .width = static_cast<int>(painted.shape(1)),
                                               .height = static_cast<int>(painted.shape(0)),
                                               .channels = static_cast<int>(painted.shape(2)),
                                               .window = window.data(),
                                               .share = share,
                                               .stabilizers = {stabilizers.first, stabilizers.second},
                                               .num_threads = num_threads};
    const nb::gil_scoped_release without_gil;
    return brushgs::photometric(params);
}

template <class T>
void def_photometric(nb::module_& m) {
    m.def("photometric", &photometric<T>, nb::kw_only(), "painted"_a.noconvert(), "target"_a.noconvert(),
          "window"_a.noconvert(), "share"_a, "stabilizers"_a, "num_threads"_a, "gradient"_a.noconvert(),
          "The loss of a painted picture [H, W, C] to its target; its gradient by the painted one is written. See "
          "photometric.hpp. window: 11 weights along an axis; share: of dissimilarity in the loss.");
}

// Tables as Python holds them: light [n], roots [n], and the matrices [3, 3] before and after the roots.
using OklabArrays = std::tuple<In<float, 1>, In<float, 1>, In<float, 2>, In<float, 2>>;

brushgs::OklabTables oklab_tables(const OklabArrays& arrays) {
    const auto& [light, roots, cones, lab] = arrays;
    return {light.data(), light.shape(0), roots.data(), roots.shape(0), cones.data(), lab.data()};
}

void oklab_planes(const OklabArrays& tables, In<float, 3> rgb, Out<float, 3> planes, int num_threads) {
    const auto found = oklab_tables(tables);
    const nb::gil_scoped_release without_gil;
    brushgs::oklab_planes(found, rgb.data(), rgb.shape(0) * rgb.shape(1), num_threads, planes.data());
}

void seen_planes(const OklabArrays& tables, In<float, 3> rgb, In<float, 2> alpha, Out<float, 4> planes,
                 int num_threads) {
    const auto found = oklab_tables(tables);
    const nb::gil_scoped_release without_gil;
    brushgs::seen_planes(found, {rgb.data(), alpha.data(), alpha.shape(0), alpha.shape(1)}, num_threads, planes.data());
}

void seen_errors(In<float, 4> plain, In<float, 4> painted, float low, float high, Out<double, 2> errors,
                 int num_threads) {
    const nb::gil_scoped_release without_gil;
    brushgs::seen_errors({.plain = plain.data(),
                          .painted = painted.data(),
                          .height = errors.shape(0),
                          .width = errors.shape(1),
                          .low = low,
                          .high = high,
                          .num_threads = num_threads,
                          .errors = errors.data()});
}

// Stroke levels

void fill_levels(In<std::uint8_t, 2> coverage, std::optional<In<std::uint8_t, 2>> height,
                 const std::vector<const brushgs::LevelFilter*>& along_u,
                 const std::vector<const brushgs::LevelFilter*>& along_v, In<std::int32_t, 2> codes,
                 const std::vector<Out<std::uint8_t, 2>>& coverages, const std::vector<Out<std::uint8_t, 2>>& heights,
                 int num_threads) {
    const brushgs::StrokeImage image{coverage.data(), data_or_null(height), coverage.shape(0), coverage.shape(1)};
    std::vector<brushgs::StrokeLevel> levels;
    for (std::size_t i = 0; i < coverages.size(); ++i)
        levels.push_back({static_cast<std::size_t>(codes(i, 0)), static_cast<std::size_t>(codes(i, 1)),
                          coverages[i].data(), height ? heights[i].data() : nullptr});
    const nb::gil_scoped_release without_gil;
    brushgs::fill_levels(image, along_u, along_v, levels, num_threads);
}

void pack_levels(const std::vector<In<std::uint8_t, 2>>& coverages, const std::vector<In<std::uint8_t, 2>>& heights,
                 const std::vector<Out<std::uint16_t, 1>>& pairs,
                 const std::vector<Out<std::uint32_t, 1>>& pairs_with_height) {
    const nb::gil_scoped_release without_gil;
    for (std::size_t i = 0; i < coverages.size(); ++i)
        brushgs::pack_level({.coverage = coverages[i].data(),
                             .height = heights.empty() ? nullptr : heights[i].data(),
                             .rows = coverages[i].shape(0),
                             .columns = coverages[i].shape(1),
                             .pairs = pairs[i].data(),
                             .with_height = pairs_with_height.empty() ? nullptr : pairs_with_height[i].data()});
}

void def_stroke_levels(nb::module_& m) {
    nb::class_<brushgs::LevelFilter>(m, "LevelFilter", "The weights of the texels of a source in those of a level.")
        .def(nb::init<std::size_t, std::size_t, double, double>(), nb::kw_only(), "num_source"_a, "num_texels"_a,
             "scale"_a, "footprint"_a, "See stroke_levels.hpp; a footprint of 0 is the source itself.")
        .def(
            "weights",
            [](const brushgs::LevelFilter& self) {
                const std::size_t shape[2] = {self.num_texels(), self.num_source()};
                return nb::ndarray<nb::numpy, const double, nb::ndim<2>>(self.weights().data(), 2, shape);
            },
            nb::rv_policy::copy, "[num_texels, num_source]; not of the source itself.")
        .def(
            "apply",
            [](const brushgs::LevelFilter& self, In<double, 2> texels, Out<double, 2> result) {
                const nb::gil_scoped_release without_gil;
                self.apply(texels.data(), texels.shape(1), result.data());
            },
            nb::kw_only(), "texels"_a.noconvert(), "result"_a.noconvert(),
            "Write weights x texels [num_source, columns] to the result; not of the source itself.");
    m.def("fill_levels", &fill_levels, nb::kw_only(), "coverage"_a.noconvert(), "height"_a.noconvert().none(),
          "along_u"_a, "along_v"_a, "codes"_a.noconvert(), "coverages"_a.noconvert(), "heights"_a.noconvert(),
          "num_threads"_a,
          "Fill for each of L codes [L, 2], rows of the filters along u and v, an image of the coverage and, where "
          "there is a height, one of that; see stroke_levels.hpp.");
    m.def("pack_levels", &pack_levels, nb::kw_only(), "coverages"_a.noconvert(), "heights"_a.noconvert(),
          "pairs"_a.noconvert(), "pairs_with_height"_a.noconvert(),
          "Write the texels of L levels as painters read them; no heights, or no pairs with height, are empty lists.");
}

}  // namespace

void bind_layers(nb::module_& m) {
    def_light<float>(m);
    def_light<double>(m);
    def_photometric<float>(m);
    def_photometric<double>(m);
    def_finish<float>(m);
    def_finish<double>(m);
    def_press<float>(m);
    def_press<double>(m);
    def_wet<float>(m);
    def_wet<double>(m);
    def_coats<float>(m);
    def_coats<double>(m);
    m.def("new_plane_float32", &new_plane<float>, "shape"_a, "An uninitialised array for a frame.");
    m.def("new_plane_float64", &new_plane<double>, "shape"_a, "An uninitialised array for a frame.");
    m.def("oklab_planes", &oklab_planes, nb::kw_only(), "tables"_a, "rgb"_a.noconvert(), "planes"_a.noconvert(),
          "num_threads"_a, "Write OKLab planes [3, H, W] of a picture [H, W, 3], 0 to 1; see oklab.hpp.");
    m.def("seen_planes", &seen_planes, nb::kw_only(), "tables"_a, "rgb"_a.noconvert(), "alpha"_a.noconvert(),
          "planes"_a.noconvert(), "num_threads"_a,
          "Write OKLab planes [2, 3, h, w] of a premultiplied picture [H, W, 3] of half the size, over black and over "
          "white; see oklab.hpp.");
    m.def("seen_errors", &seen_errors, nb::kw_only(), "plain"_a.noconvert(), "painted"_a.noconvert(), "low"_a, "high"_a,
          "errors"_a.noconvert(), "num_threads"_a,
          "Write the squared errors [H, W] between two of these planes, mean over black and white; see oklab.hpp.");
    def_stroke_levels(m);
}

}  // namespace bindings
