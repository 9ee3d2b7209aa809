// Pictures: light on their height, paper, coats, bytes; and the levels of a stroke image.
#include <cstdint>
#include <string>
#include <vector>

#include "brushgs/coats.hpp"
#include "brushgs/finish.hpp"
#include "brushgs/light.hpp"
#include "brushgs/press.hpp"
#include "brushgs/stroke_levels.hpp"
#include "hash.hpp"
#include "inputs.hpp"

namespace native {

namespace {

constexpr int kWidth = 203, kHeight = 111;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

template <class T>
struct Picture {
    std::vector<T> rgb, alpha, depth, height;
    explicit Picture(std::uint64_t seed) {
        Random random(seed);
        rgb = random.numbers<T>(3 * kPixels, 0, 1);
        alpha = random.numbers<T>(kPixels, 0, 1);
        depth = random.numbers<T>(kPixels, 1, 5);
        height = random.numbers<T>(kPixels, 0, 3);
    }
};

template <class T>
void run_planes(Cases& cases) {
    const Picture<T> front(51), back(52);
    const std::string scalar = name_of_scalar<T>;
    const std::vector<double> blur{0.0625, 0.25, 0.375, 0.25, 0.0625};
    for (const double gloss : {0.0, 0.4})
        cases.run("light: " + std::string(gloss > 0 ? "shine, " : "") + scalar, [&](int num_threads) {
            std::vector<T> lit(3 * kPixels);
            const brushgs::LightParams<T> params{.rgb = front.rgb.data(),
                                                 .heights = front.height.data(),
                                                 .alpha = front.alpha.data(),
                                                 .lit = lit.data(),
                                                 .width = kWidth,
                                                 .height = kHeight,
                                                 .blur = blur,
                                                 .lamp = {-0.7, -0.4},
                                                 .half_way = {-0.3, -0.2},
                                                 .strength = 0.6,
                                                 .gloss = gloss,
                                                 .exponent = 30,
                                                 .num_threads = num_threads};
            brushgs::light(params);
            Hash hash;
            hash.add(lit);
            return hash.value();
        });
    cases.run("coats: " + scalar, [&](int num_threads) {
        Picture<T> below = back;
        brushgs::lay_over<T>({front.rgb.data(), front.alpha.data(), front.depth.data(), front.height.data()},
                             {below.rgb.data(), below.alpha.data(), below.depth.data(), below.height.data()}, T(0.8),
                             kPixels, num_threads,
                             {below.rgb.data(), below.alpha.data(), below.depth.data(), below.height.data()});
        std::vector<T> picture(3 * kPixels), height(kPixels);
        brushgs::lay_on_ground<T>(below.rgb.data(), below.alpha.data(), back.rgb.data(), front.rgb.data(), kPixels,
                                  num_threads, picture.data());
        brushgs::raise_ground<T>(below.alpha.data(), back.height.data(), below.height.data(), T(0.8), kPixels,
                                 num_threads, height.data());
        Hash hash;
        for (const auto* plane : {&below.rgb, &below.alpha, &below.depth, &below.height, &picture, &height})
            hash.add(*plane);
        return hash.value();
    });
    cases.run("paper and bytes: " + scalar, [&](int num_threads) {
        std::vector<T> rgb(3 * kPixels), alpha(kPixels);
        brushgs::press<T>({front.rgb.data(), front.alpha.data(), back.alpha.data(), T(0.7), T(0.1), kPixels, rgb.data(),
                           alpha.data()});
        std::vector<std::uint8_t> bytes(3 * kPixels);
        brushgs::finish(rgb.data(), alpha.data(), back.rgb.data(), true, kPixels, num_threads, bytes.data());
        Hash hash;
        hash.add(rgb);
        hash.add(alpha);
        hash.add(bytes);
        return hash.value();
    });
}

void run_stroke_levels(Cases& cases) {
    constexpr std::size_t rows = 40, columns = 96;
    Random random(53);
    std::vector<std::uint8_t> coverage(rows * columns), height(rows * columns);
    for (auto& texel : coverage) texel = random.byte();
    for (auto& texel : height) texel = random.byte();
    const brushgs::LevelFilter whole_u(columns, columns, 1, 0), whole_v(rows, rows, 1, 0);
    const brushgs::LevelFilter part_u(columns, 30, 1.2, 5), part_v(rows, 9, 1.3, 7);
    cases.run("stroke levels", [&](int num_threads) {
        std::vector<std::uint8_t> painted(rows * columns + rows * 30 + 9 * 30), raised(painted.size());
        const std::size_t second = rows * columns, third = second + rows * 30;
        const brushgs::LevelFilter *const along_u[] = {&whole_u, &part_u}, *const along_v[] = {&whole_v, &part_v};
        const brushgs::StrokeLevel levels[] = {{0, 0, painted.data(), raised.data()},
                                               {1, 0, painted.data() + second, raised.data() + second},
                                               {1, 1, painted.data() + third, raised.data() + third}};
        brushgs::fill_levels({coverage.data(), height.data(), rows, columns}, along_u, along_v, levels, num_threads);
        Hash hash;
        hash.add(painted);
        hash.add(raised);
        return hash.value();
    });
}

}  // namespace

void run_plane_cases(Cases& cases) {
    run_planes<float>(cases);
    run_planes<double>(cases);
    run_stroke_levels(cases);
}

}  // namespace native
