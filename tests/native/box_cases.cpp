// Boxes: pictures with every kernel, in every order and with all that a stroke may have; their derivative; fragments.
#include <string>
#include <vector>

#include "brushgs/fragments.hpp"
#include "brushgs/painted_sums.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/raster_backward.hpp"
#include "brushgs/trace.hpp"
#include "hash.hpp"
#include "inputs.hpp"

namespace native {

namespace {

constexpr int kWidth = 150, kHeight = 90;  // no whole number of tiles
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
constexpr std::size_t kCount = 500;

// What the cases differ in.
struct Painting {
    const char* name;
    bool is_soft, has_underpaint, has_streaks, has_relief, has_limits;
    brushgs::Blend blend = brushgs::Blend::cover;
};
constexpr Painting kOfAnyKernel[] = {
    {"hard", false, false, false, false, false},
    {"hard, relief", false, false, false, true, false},
    {"hard, limits", false, false, false, false, true},
    {"glazes", false, false, false, false, false, brushgs::Blend::glaze},
};
constexpr Painting kOfImages[] = {
    {"soft", true, false, false, false, false},
    {"soft, relief, limits", true, false, false, true, true},
    {"hard, underpaint", false, true, false, false, false},
    {"hard, streaks", false, false, true, false, false},
    {"hard, everything", false, true, true, true, true},
    {"soft, underpaint", true, true, false, false, false},
    {"soft, streaks", true, false, true, false, false},
    {"soft, everything", true, true, true, true, true},
};
struct NamedKernel {
    const char* name;
    brushgs::Kernel kernel;
    bool is_image;
};
constexpr NamedKernel kKernels[] = {{"bilinear", brushgs::Kernel::bilinear, true},
                                    {"nearest", brushgs::Kernel::nearest, true},
                                    {"gaussian", brushgs::Kernel::gaussian, false},
                                    {"ellipse", brushgs::Kernel::ellipse, false}};

// A stroke image in three sizes: bristles with gaps between them.
class StrokeLevels {
public:
    StrokeLevels() {
        Random random(41);
        for (const int columns : {64, 17, 2}) {
            const int rows = columns / 2 + 1;
            const auto size = static_cast<std::size_t>(rows * columns) + 1;
            std::vector<std::uint16_t> pairs(size);
            std::vector<std::uint32_t> with_height(size);
            for (std::size_t i = 0; i < size; ++i) {
                const auto texel = [&] { return static_cast<std::uint16_t>(random.byte() < 90 ? 0 : random.byte()); };
                pairs[i] = static_cast<std::uint16_t>(texel() | texel() << 8);
                with_height[i] = pairs[i] | static_cast<std::uint32_t>(random.bits() >> 48) << 16;
            }
            pairs_.push_back(pairs);
            with_height_.push_back(with_height);
            sizes_.push_back({columns, rows});
        }
        for (std::size_t k = 0; k < pairs_.size(); ++k)
            levels.push_back({pairs_[k].data(), sizes_[k].columns, sizes_[k].rows, 1 + 0.125 * static_cast<double>(k),
                              1 + 0.25 * static_cast<double>(k), with_height_[k].data()});
    }
    StrokeLevels(const StrokeLevels&) = delete;
    std::vector<brushgs::Level> levels;

private:
    struct Size {
        int columns, rows;
    };
    std::vector<std::vector<std::uint16_t>> pairs_;
    std::vector<std::vector<std::uint32_t>> with_height_;
    std::vector<Size> sizes_;
};

// Boxes, nearest first: most of them small, some beyond the picture.
template <class T>
struct Boxes {
    std::vector<T> centers, half_extents, angles, colors, opacities, depths, softness, setbacks, weights, slopes,
        reliefs, limits, fades;
    std::vector<std::uint16_t> noise;
    std::vector<std::uint8_t> starts;

    Boxes() {
        Random random(42);
        noise.resize(2 * (256 + brushgs::kBristles + 2 * brushgs::kBristleMargin + 2));
        for (auto& packed : noise) packed = static_cast<std::uint16_t>(random.bits() >> 48);
        double depth = 2;
        for (std::size_t i = 0; i < kCount; ++i) {
            depth += random.between(0, 0.02);
            depths.push_back(static_cast<T>(depth));
            const double setback = random.between(0, 0.5);
            setbacks.push_back(static_cast<T>(setback));
            fades.push_back(static_cast<T>(depth - 0.3));
            fades.push_back(static_cast<T>(1 / 0.15));
            for (const int side : {kWidth, kHeight}) {
                centers.push_back(static_cast<T>(random.between(-0.1 * side, 1.1 * side)));
                half_extents.push_back(static_cast<T>(random.mostly_low(0.4, 40)));
                weights.push_back(static_cast<T>(random.between(0, 0.2)));
                slopes.push_back(static_cast<T>(random.between(0, 0.1)));
                reliefs.push_back(static_cast<T>(random.between(0, 2)));
            }
            starts.push_back(random.byte());
        }
        angles = random.numbers<T>(kCount, -3, 3);
        colors = random.numbers<T>(3 * kCount, 0, 1);
        opacities = random.numbers<T>(kCount, 0, 1.1);
        for (T& opacity : opacities) opacity = opacity < 1 ? opacity : 1;
        softness = random.numbers<T>(kCount, 0, 0.3);
        limits = random.numbers<T>(kPixels, 2, 12);
    }

    brushgs::BoxView<T> view(const Painting& painting) const {
        brushgs::BoxView<T> boxes{.count = kCount,
                                  .centers = centers.data(),
                                  .half_extents = half_extents.data(),
                                  .angles = angles.data(),
                                  .colors = colors.data(),
                                  .opacities = opacities.data(),
                                  .layers = {},
                                  .depths = depths.data()};
        if (painting.blend == brushgs::Blend::cover) boxes.layers = {1, {{depths.data(), 1}}};
        if (painting.is_soft) boxes.softness = softness.data();
        if (painting.has_underpaint)
            boxes.underpaint = {.setbacks = setbacks.data(), .reach = 1.2, .reaches = nullptr, .opacity = 0.8};
        if (painting.has_streaks) boxes.streaks = {noise.data(), starts.data(), weights.data(), slopes.data()};
        if (painting.has_relief) boxes.reliefs = reliefs.data();
        if (painting.has_limits) {
            boxes.limits = limits.data();
            boxes.fades = fades.data();
        }
        return boxes;
    }
};

template <class T>
struct Planes {
    std::vector<T> rgb, alpha, depth, height;
    Planes() : rgb(3 * kPixels), alpha(kPixels), depth(kPixels), height(kPixels) {}
};

template <class T>
class BoxCases {
public:
    explicit BoxCases(Cases& cases) : cases_(cases) {
        for (std::size_t i = 0; i < kCount; ++i) {
            const auto half_u = static_cast<double>(boxes_.half_extents[2 * i]);
            level_of_box_.push_back(half_u > 20 ? 0 : (half_u > 4 ? 1 : 2));
        }
    }

    void run() {
        for (const NamedKernel& kernel : kKernels) {
            for (const Painting& painting : kOfAnyKernel) run(kernel, painting);
            if (!kernel.is_image) continue;
            for (const Painting& painting : kOfImages) run(kernel, painting);
        }
    }

private:
    void run(const NamedKernel& kernel, const Painting& painting) {
        const std::string name = std::string(kernel.name) + ", " + painting.name + ", " + name_of_scalar<T>;
        cases_.run("paint: " + name, [&](int num_threads) {
            Planes<T> planes;
            Hash hash;
            paint(kernel, painting, num_threads, planes);
            for (const auto* plane : {&planes.rgb, &planes.alpha, &planes.depth, &planes.height}) hash.add(*plane);
            return hash.value();
        });
        if (painting.blend == brushgs::Blend::glaze || painting.has_relief) return;
        cases_.run("fragments: " + name, [&](int num_threads) { return fragments(kernel, painting, num_threads); });
        if (painting.is_soft || painting.has_limits) return;
        cases_.run("paint, backward: " + name,
                   [&](int num_threads) { return backward(kernel, painting, num_threads); });
        if (kernel.is_image || painting.has_underpaint || painting.has_streaks) return;
        cases_.run("sums: " + name, [&](int num_threads) { return sums(kernel, painting, num_threads); });
    }

    brushgs::RasterParams params(const NamedKernel& kernel, const Painting& painting, int num_threads) const {
        brushgs::RasterParams all{.kernel = kernel.kernel,
                                  .width = kWidth,
                                  .height = kHeight,
                                  .num_threads = -num_threads,  // exactly so many
                                  .min_transmittance = 1e-4 * (1 - 1e-5),
                                  .blend = painting.blend,
                                  .levels = {},
                                  .level_of_box = {}};
        if (kernel.is_image) {
            all.levels = levels_.levels;
            all.level_of_box = level_of_box_;
        }
        return all;
    }

    void paint(const NamedKernel& kernel, const Painting& painting, int num_threads, Planes<T>& planes,
               brushgs::Trace<T>* trace = nullptr) const {
        brushgs::BoxView<T> boxes = boxes_.view(painting);
        std::vector<T> logarithms;
        if (painting.blend == brushgs::Blend::glaze) {
            for (const T color : boxes_.colors) logarithms.push_back(-2 * color);
            boxes.colors = logarithms.data();
        }
        brushgs::Picture<T> picture{planes.rgb.data(), planes.alpha.data(), {}};
        if (boxes.layers.count > 0) picture.layers = {1, {{planes.depth.data(), 1}}};
        if (painting.has_relief) picture.height = planes.height.data();
        brushgs::rasterize(params(kernel, painting, num_threads), boxes, picture, trace);
    }

    std::uint64_t fragments(const NamedKernel& kernel, const Painting& painting, int num_threads) const {
        brushgs::RasterParams rows = params(kernel, painting, num_threads);
        rows.first_row = 0;
        rows.end_row = kHeight;
        const auto found = brushgs::find_fragments(rows, boxes_.view(painting));
        Hash hash;
        hash.add(found.starts.get(), found.num_pixels + 1);
        hash.add(found.rows.get(), found.count);
        hash.add(found.weights.get(), found.count);
        hash.add(found.shades.get(), found.count);
        hash.add(found.is_underpaint.get(), found.count);
        return hash.value();
    }

    std::uint64_t backward(const NamedKernel& kernel, const Painting& painting, int num_threads) const {
        Planes<T> planes;
        brushgs::Trace<T> trace;
        paint(kernel, painting, num_threads, planes, &trace);
        Random random(43);
        const auto v_rgb = random.numbers<T>(3 * kPixels, -1, 1), v_alpha = random.numbers<T>(kPixels, -1, 1),
                   v_depth = random.numbers<T>(kPixels, -1, 1);
        const brushgs::PictureGradients<T> picture{
            planes.rgb.data(), planes.alpha.data(), {1, {{planes.depth.data(), 1}}},
            v_rgb.data(),      v_alpha.data(),      {1, {{v_depth.data(), 1}}}};
        std::vector<T> v_centers(2 * kCount), v_half(2 * kCount), v_angles(kCount), v_colors(3 * kCount),
            v_opacities(kCount), v_depths(kCount);
        std::vector<std::vector<double>> v_texels;
        std::vector<double*> texels;
        if (kernel.is_image)
            for (const auto& level : levels_.levels)
                v_texels.emplace_back(static_cast<std::size_t>(level.rows * level.columns));
        for (auto& of_level : v_texels) texels.push_back(of_level.data());
        brushgs::rasterize_backward<T>(params(kernel, painting, num_threads), boxes_.view(painting), &trace, picture,
                                       {v_centers.data(),
                                        v_half.data(),
                                        v_angles.data(),
                                        v_colors.data(),
                                        v_opacities.data(),
                                        {1, {{v_depths.data(), 1}}}},
                                       texels);
        Hash hash;
        for (const auto* values : {&v_centers, &v_half, &v_angles, &v_colors, &v_opacities, &v_depths})
            hash.add(*values);
        for (const auto& of_level : v_texels) hash.add(of_level);
        return hash.value();
    }

    std::uint64_t sums(const NamedKernel& kernel, const Painting& painting, int num_threads) const {
        Random random(44);
        const auto values = random.numbers<T>(3 * kPixels, -1, 1), weights = random.numbers<T>(kPixels, 0, 1);
        std::vector<T> of_values(3 * kCount), shares(kCount);
        brushgs::sum_painted<T>(params(kernel, painting, num_threads), boxes_.view(painting),
                                {values.data(), weights.data()}, {of_values.data(), shares.data()});
        Hash hash;
        hash.add(of_values);
        hash.add(shares);
        return hash.value();
    }

    Cases& cases_;
    const Boxes<T> boxes_;
    const StrokeLevels levels_;
    std::vector<std::uint16_t> level_of_box_;
};

}  // namespace

void run_box_cases(Cases& cases) {
    BoxCases<float>(cases).run();
    BoxCases<double>(cases).run();
}

}  // namespace native
