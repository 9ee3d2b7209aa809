#include "brushgs/stroke_levels.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "brushgs/cpu.hpp"
#include "brushgs/sum_rows.hpp"

namespace brushgs {

namespace {

constexpr int kQuadrature = 4;         // midpoints on each side of a texel's hat
constexpr double kTooSmall = 1e-6;     // a weight; 255 texels of it stay far below half a step of 8 bits
constexpr double kFaintPaint = 2.0;    // of 255: the height of less is mostly noise, and fades to none
constexpr double kCanvas = 127.5;      // the height where there is no paint
constexpr std::size_t kAliased = 512;  // columns: rows 4 KiB apart would fall on each other in the cache

// The hat function of a texel, clipped at the ends of the box, integrated from the left up to x.
double hat_integral(double x, double texel, double last) {
    const double inside = std::clamp(std::clamp(x, 0.0, last) - texel, -1.0, 1.0);
    return 0.5 + inside - 0.5 * inside * std::fabs(inside);
}

// Adds `share` of the mean over a pixel of the source at `center` to the moments of one texel of the level.
void add_pixel_mean(double center, double footprint, double share, std::size_t num_source, double* moments) {
    const auto reach = static_cast<std::ptrdiff_t>(std::ceil(footprint / 2)) + 1;
    const auto middle = static_cast<std::ptrdiff_t>(std::nearbyint(center));
    const auto last = static_cast<std::ptrdiff_t>(num_source) - 1;
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(middle - reach, 0); k <= std::min(middle + reach, last); ++k) {
        const double texel = static_cast<double>(k), end = static_cast<double>(last);
        const double mean =
            (hat_integral(center + footprint / 2, texel, end) - hat_integral(center - footprint / 2, texel, end)) /
            footprint;
        moments[k] += share * mean;
    }
}

// Solves G x = moments in place, G the Gram matrix of hat functions: 2/3, and 1/6 between neighbors, by the Thomas
// algorithm. The outermost hats are halves, cut at the border.
void solve_gram(std::size_t rows, std::size_t columns, double* x) {
    const double beside = 1.0 / 6;
    std::vector<double> diagonal(rows, 2.0 / 3);
    diagonal.front() = diagonal.back() = 1.0 / 3;
    for (std::size_t row = 1; row < rows; ++row) {
        const double factor = beside / diagonal[row - 1];
        diagonal[row] -= factor * beside;
        for (std::size_t k = 0; k < columns; ++k) x[row * columns + k] -= factor * x[(row - 1) * columns + k];
    }
    for (std::size_t k = 0; k < columns; ++k) x[(rows - 1) * columns + k] /= diagonal[rows - 1];
    for (std::size_t row = rows - 1; row-- > 0;)
        for (std::size_t k = 0; k < columns; ++k)
            x[row * columns + k] = (x[row * columns + k] - beside * x[(row + 1) * columns + k]) / diagonal[row];
}

// Ties to even, like NumPy: the sum has no bits left for a fraction.
double rounded(double value) {
    constexpr double whole = 6755399441055744.0;  // 1.5 x 2^52
    return (value + whole) - whole;
}

// Columns in memory for a row of some: whole runs, as single columns take as long as a run.
std::size_t padded(std::size_t columns) {
    const std::size_t whole = (columns + kRowRun - 1) / kRowRun * kRowRun;
    return whole % kAliased == 0 ? whole + kRowRun : whole;
}

std::uint8_t byte_of(double value) { return static_cast<std::uint8_t>(std::clamp(rounded(value), 0.0, 255.0)); }

}  // namespace

LevelFilter::LevelFilter(std::size_t num_source, std::size_t num_texels, double scale, double footprint)
    : num_source_(num_source), num_texels_(num_texels) {
    if (footprint == 0) return;
    weights_.resize(num_texels * num_source);
    const double steps = static_cast<double>(num_texels - 1), last = static_cast<double>(num_source - 1);
    const double spacing = last * scale / steps;  // source texels between two texels
    for (int step = -kQuadrature; step < kQuadrature; ++step) {
        const double offset = (step + 0.5) / kQuadrature, share = (1 - std::fabs(offset)) / kQuadrature;
        for (std::size_t i = 0; i < num_texels; ++i) {
            if (i == (offset < 0 ? 0 : num_texels - 1)) continue;  // beyond the outermost texels
            const double center = (static_cast<double>(i) - steps / 2) * spacing + last / 2 + offset * spacing;
            add_pixel_mean(center, footprint, share, num_source, &weights_[i * num_source]);
        }
    }
    solve_gram(num_texels, num_source, weights_.data());
    for (double& weight : weights_)
        if (std::fabs(weight) < kTooSmall) weight = 0;
    for (std::size_t i = 0; i < num_texels; ++i) {
        const double* const row = &weights_[i * num_source];
        const double* const end = row + num_source;
        const auto shows = [](double weight) { return weight != 0; };
        const double* const begin = std::find_if(row, end, shows);
        begins_.push_back(static_cast<std::size_t>(begin - row));
        std::size_t behind = num_source;
        while (behind > begins_.back() && row[behind - 1] == 0) --behind;
        ends_.push_back(behind);
    }
}

void LevelFilter::apply(const double* texels, std::size_t columns, double* result) const {
    const auto sum_rows = pick_kernel(&baseline::sum_rows, &BRUSHGS_AVX2::sum_rows, &BRUSHGS_AVX512::sum_rows);
    for (std::size_t i = 0; i < num_texels_; ++i)
        sum_rows(
            {texels + begins_[i] * columns, &weights_[i * num_source_ + begins_[i]], ends_[i] - begins_[i], columns},
            result + i * columns);
}

void fill_levels(const StrokeImage& image, std::span<const LevelFilter* const> along_u,
                 std::span<const LevelFilter* const> along_v, std::span<const StrokeLevel> levels, int num_threads) {
    const std::size_t rows = image.rows, columns = image.columns;
    const std::size_t num_planes = image.height == nullptr ? 1 : 2;  // coverage, and height over 1/2 times coverage
    const std::size_t across = padded(num_planes * rows);
    std::vector<double> source(columns * across);  // [columns, planes x rows]: filtered along its first axis
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const double paint = image.coverage[y * columns + x];
            source[x * across + y] = paint;
            if (image.height != nullptr)
                source[x * across + rows + y] = (image.height[y * columns + x] - kCanvas) * paint;
        }
    std::vector<std::size_t> firsts;  // of the runs of levels of one level along u
    for (std::size_t i = 0; i < levels.size(); ++i)
        if (i == 0 || levels[i].u != levels[i - 1].u) firsts.push_back(i);

    parallel_for(firsts.size(), num_threads, [&](std::size_t run) {
        const std::size_t first = firsts[run];
        const std::size_t end = run + 1 < firsts.size() ? firsts[run + 1] : levels.size();
        const LevelFilter& u = *along_u[levels[first].u];
        const std::size_t width = u.num_texels(), wide = padded(num_planes * width);
        std::vector<double> filtered, turned(rows * wide), result;  // [rows, planes x width]
        if (!u.is_source()) {
            filtered.resize(width * across);
            u.apply(source.data(), across, filtered.data());
        }
        const double* const texels = u.is_source() ? source.data() : filtered.data();
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t plane = 0; plane < num_planes; ++plane)
                for (std::size_t y = 0; y < rows; ++y)
                    turned[y * wide + plane * width + x] = texels[x * across + plane * rows + y];
        for (std::size_t i = first; i < end; ++i) {
            const LevelFilter& v = *along_v[levels[i].v];
            const double* level = turned.data();
            if (!v.is_source()) {
                result.resize(v.num_texels() * wide);
                v.apply(turned.data(), wide, result.data());
                level = result.data();
            }
            for (std::size_t y = 0; y < v.num_texels(); ++y) {
                const double* const paint = level + y * wide;
                const double* const above = paint + width;
                std::uint8_t* const coverage = levels[i].coverage + y * width;
                for (std::size_t x = 0; x < width; ++x) coverage[x] = byte_of(paint[x]);
                if (num_planes == 1) continue;
                std::uint8_t* const height = levels[i].height + y * width;
                for (std::size_t x = 0; x < width; ++x)
                    height[x] = byte_of(kCanvas + above[x] / (paint[x] > kFaintPaint ? paint[x] : kFaintPaint));
            }
        }
    });
}

void pack_level(const PackedLevel& level) {
    const std::size_t rows = level.rows, columns = level.columns;
    const std::size_t num_rows = std::max<std::size_t>(rows, 2), width = std::max<std::size_t>(columns, 2);
    const auto pair_up = [&](const std::uint8_t* texels, auto* result, int shift, auto add) {
        using Word = std::remove_reference_t<decltype(*result)>;
        for (std::size_t y = 0; y < num_rows; ++y) {
            const std::uint8_t* const here = texels + std::min(y, rows - 1) * columns;
            const std::uint8_t* const below = texels + std::min(y + 1, rows - 1) * columns;
            Word* const row = result + y * width;
            for (std::size_t x = 0; x < columns; ++x) {
                const auto pair = static_cast<std::uint32_t>(here[x] | below[x] << 8) << shift;
                row[x] = static_cast<Word>(add ? row[x] | pair : pair);
            }
            if (columns == 1) row[1] = row[0];
        }
    };
    pair_up(level.coverage, level.pairs, 0, false);
    level.pairs[num_rows * width] = 0;
    if (level.with_height == nullptr) return;
    pair_up(level.coverage, level.with_height, 0, false);
    pair_up(level.height == nullptr ? level.coverage : level.height, level.with_height, 16, true);
    level.with_height[num_rows * width] = 0;
}

}  // namespace brushgs
