// Maps of level ground, and the shadow on it.
#include <algorithm>
#include <cmath>
#include <span>

#include "brushgs/stage.hpp"
#include "brushgs/subject.hpp"

namespace brushgs {

namespace {

constexpr double kLeastWeight = 1e-18;  // of a blur, relative to its middle
constexpr double kLowest = 0.004;       // share of the paint below the foot: fringes hang lower
constexpr double kTails = 0.01;         // share of the paint outside of the subject's width, on each side
constexpr double kLeast = 0.05;         // minimum width and height of a subject, in radii

struct Layer {
    double low, high;  // heights, in radii
};
constexpr Layer kLayers[] = {{0.0, 0.25}, {0.25, 0.6}, {0.6, 1.2}, {1.2, 9.0}};
constexpr double kHighest = 2.0;                         // height beyond which edges are not softer
constexpr double kBlur = 0.02, kBlurByHeight = 0.07;     // of an edge, in radii: at the ground, and by radii above it
constexpr double kDensity = 1.6, kContactDensity = 1.2;  // optical depth of paint that covers the ground once
constexpr double kTouching = 0.15, kContactBlur = 0.05;  // height of paint that darkens the ground; its blur
constexpr double kNearHeight = 0.45, kReflectedBlur = 0.16;  // height of paint that reflects its color; its blur

// Blurs along the first axis.
void blur_rows(std::size_t rows, std::size_t columns, const std::vector<double>& weights,
               const std::vector<double>& from, std::vector<double>& to) {
    to.assign(rows * columns, 0.0);
    const std::size_t reach = weights.size();
    for (std::size_t row = 0; row < rows; ++row) {
        double* const sums = to.data() + row * columns;
        const std::size_t first = row + 1 > reach ? row + 1 - reach : 0, end = std::min(rows, row + reach);
        for (std::size_t other = first; other < end; ++other) {
            const double weight = weights[other > row ? other - row : row - other];
            const double* const values = from.data() + other * columns;
            for (std::size_t i = 0; i < columns; ++i) sums[i] += weight * values[i];
        }
    }
}

void transpose(std::size_t rows, std::size_t columns, const std::vector<double>& from, std::vector<double>& to) {
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t i = 0; i < columns; ++i) to[i * rows + row] = from[row * columns + i];
}

// Weights of a cell at its distance to another of `count` in a row; their sum is at most 1.
std::vector<double> blur_weights(std::size_t count, double sigma) {
    std::vector<double> weights;
    for (std::size_t step = 0; step < count; ++step) {
        const double steps = static_cast<double>(step) / sigma, weight = std::exp(-0.5 * steps * steps);
        if (!(weight >= kLeastWeight)) break;
        weights.push_back(weight);
    }
    double sum = 0;  // at the middle
    for (std::size_t cell = 0; cell < count; ++cell) {
        const std::size_t middle = count / 2, step = cell > middle ? cell - middle : middle - cell;
        sum += step < weights.size() ? weights[step] : 0;
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

// Sums of values on level points, blurred: paint over area.
class Density {
public:
    Density(const ShadowQuery& query, LevelGrid grid) : query_(query), grid_(grid) {}

    template <class Place, class IsIn, class Value>
    std::vector<double> of(double blur, const Place& place, const IsIn& is_in, const Value& value) const {
        std::vector<double> map(grid_.side * grid_.side);
        for (std::size_t i = 0; i < query_.count; ++i) {
            const double* const point = query_.points + 3 * i;
            const double up = std::max(point[1], 0.0);
            if (!(query_.weights[i] > 0) || !is_in(up / query_.radius)) continue;
            const double raised[3] = {point[0], up, point[2]};
            const auto [right, away] = place(raised);
            grid_.add(right, away, value(i), map.data());
        }
        for (double& sum : map) sum /= grid_.cell() * grid_.cell();
        blur_map(grid_.side, grid_.side, blur * query_.radius / grid_.cell(), map.data());
        return map;
    }

private:
    const ShadowQuery& query_;
    LevelGrid grid_;
};

}  // namespace

double LevelGrid::sample(const double* values, double right, double away) const {
    const double last = static_cast<double>(side) - 1;
    const auto clamped = [&](double place) {
        const double at = cell_at(place) - 0.5;
        return at > 0 ? std::min(at, last) : 0.0;  // of what is not a number as well
    };
    const double row = clamped(right), column = clamped(away);
    const std::size_t i = std::min(static_cast<std::size_t>(row), side - 2);
    const std::size_t k = std::min(static_cast<std::size_t>(column), side - 2);
    const double down = row - static_cast<double>(i), across = column - static_cast<double>(k);
    const double* const at = values + i * side + k;
    const double upper = at[0] * (1 - across) + at[1] * across;
    const double lower = at[side] * (1 - across) + at[side + 1] * across;
    return upper * (1 - down) + lower * down;
}

void LevelGrid::add(double right, double away, double value, double* sums) const {
    const double row = std::floor(cell_at(right)), column = std::floor(cell_at(away));
    const auto size = static_cast<double>(side);
    if (!(row >= 0 && row < size && column >= 0 && column < size)) return;
    sums[static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column)] += value;
}

void blur_map(std::size_t rows, std::size_t columns, double sigma, double* values) {
    std::vector<double> map(values, values + rows * columns), other(rows * columns);
    blur_rows(rows, columns, blur_weights(rows, sigma), map, other);
    transpose(rows, columns, other, map);
    blur_rows(columns, rows, blur_weights(columns, sigma), map, other);
    transpose(columns, rows, other, map);
    std::ranges::copy(map, values);
}

Standing find_standing(const double* points, std::vector<double> weights, double radius) {
    double sum = 0;
    for (const double weight : weights) sum += weight;
    if (!(sum > 0)) std::ranges::fill(weights, 1.0);
    double ends[3][2] = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        std::vector<double> values(weights.size());
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = points[3 * i + axis];
        const double tail = axis == 1 ? kLowest : kTails, at[2] = {tail, 1 - tail};
        if (!values.empty()) std::ranges::copy(weighted_quantiles(values, weights, at), ends[axis]);
    }
    const double width = 0.5 * std::max(ends[0][1] - ends[0][0], ends[2][1] - ends[2][0]), tiny = kLeast * radius;
    return {.middle = {0.5 * (ends[0][0] + ends[0][1]), ends[1][0], 0.5 * (ends[2][0] + ends[2][1])},
            .width = std::max(width, tiny),
            .height = std::max(ends[1][1] - ends[1][0], tiny)};
}

ShadowMaps cast_shadow(const ShadowQuery& query) {
    constexpr std::size_t cells = kShadowSide * kShadowSide;
    const LevelGrid grid{kShadowSide, kShadowReach * query.radius};
    const Density density(query, grid);
    const auto thrown = [&](const double* point) { return cast_point(point, query.lamp); };
    const auto level = [](const double* point) { return std::array<double, 2>{point[0], point[2]}; };
    const auto weight = [&](std::size_t i) { return query.weights[i]; };
    const auto is_near = [](double height) { return height < kNearHeight; };
    ShadowMaps maps{std::vector<double>(cells, 1.0), {}, std::vector<double>(2 * cells)};
    for (const Layer& layer : kLayers) {
        const double blur = kBlur + kBlurByHeight * (layer.low + std::min(layer.high, kHighest));
        const auto is_in = [&](double height) { return height >= layer.low && height < layer.high; };
        const auto map = density.of(blur, thrown, is_in, weight);
        for (std::size_t i = 0; i < cells; ++i) maps.shade[i] *= std::exp(-kDensity * map[i]);
    }
    for (double& light : maps.shade) light = 1 - light;
    maps.contact = density.of(kContactBlur, level, [](double height) { return height < kTouching; }, weight);
    for (double& value : maps.contact) value = 1 - std::exp(-kContactDensity * value);
    const auto near = density.of(kReflectedBlur, level, is_near, weight);
    for (std::size_t k = 0; k < 2; ++k) {
        const auto tint = [&](std::size_t i) { return query.weights[i] * query.lab[3 * i + 1 + k]; };
        const auto sums = density.of(kReflectedBlur, level, is_near, tint);
        for (std::size_t i = 0; i < cells; ++i)
            maps.reflected[k * cells + i] = sums[i] / std::max(near[i], 1e-9) * (1 - std::exp(-near[i]));
    }
    return maps;
}

Shade ShadowView::at(const double* point) const {
    const LevelGrid grid{kShadowSide, kShadowReach * radius};
    const auto [right, away] = cast_point(point, lamp);
    constexpr std::size_t cells = kShadowSide * kShadowSide;
    const auto level = [&](const double* map) { return grid.sample(map, point[0], point[2]); };
    return {grid.sample(shade, right, away), level(contact), {level(reflected), level(reflected + cells)}};
}

}  // namespace brushgs
