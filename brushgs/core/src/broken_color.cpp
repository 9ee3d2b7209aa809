#include "brushgs/broken_color.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "brushgs/colors.hpp"
#include "brushgs/equal_rows.hpp"
#include "brushgs/exponentials.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/row_loop.hpp"

namespace brushgs {

namespace {

using Color = std::array<double, 3>;

constexpr std::size_t kShiftedPerItem = 256;
constexpr std::size_t kAveraged = 8;  // neighbors whose mean shift, with its own, is subtracted
// With `follows`: OKLab chroma of full size (fur and stone have 0.01 to 0.03, skin 0.05 to 0.09, a red shirt 0.2), and
// factors along and across the direction of a and b, with constant sum of squares.
constexpr double kColorful = 0.08, kAlong = 1.3, kAcross = 0.55;
constexpr int kBisections = 8;
constexpr double kRoundOff = 1e-9;  // of colors

// Three normal random numbers of a position. Source: Box and Muller 1958, A note on the generation of random normal
// deviates.
Color normals_of(std::uint64_t hash, std::uint64_t seed) {
    double uniform[4];
    for (std::uint64_t draw = 0; draw < 4; ++draw) uniform[draw] = chance(hash, seed, draw);
    const auto radius = [&](std::size_t i) { return std::sqrt(-2 * log_of(1 - uniform[i])); };
    const auto turn = [&](std::size_t i) { return 2 * std::numbers::pi * uniform[i]; };
    return {radius(0) * std::cos(turn(2)), radius(0) * std::sin(turn(2)), radius(1) * std::cos(turn(3))};
}

// Largest factor of a shift, 0 to 1, that keeps both directions within the display range.
double room_of(const Oklab& oklab, const Color& rgb, const Color& lab, const Color& shift) {
    const auto fits = [&](double share) {
        for (const double sign : {1.0, -1.0}) {
            const Color moved = oklab.rgb_of(
                {lab[0] + sign * share * shift[0], lab[1] + sign * share * shift[1], lab[2] + sign * share * shift[2]});
            for (std::size_t k = 0; k < 3; ++k) {
                if (!(moved[k] >= std::min(rgb[k], 0.0) - kRoundOff)) return false;
                if (!(moved[k] <= std::max(rgb[k], 1.0) + kRoundOff)) return false;
            }
        }
        return true;
    };
    if (fits(1)) return 1;
    double share = 0, step = 1;
    for (int i = 0; i < kBisections; ++i) {
        step /= 2;
        if (fits(share + step)) share += step;
    }
    return share;
}

// Paint of strokes, relative: the product of opacity and the two largest scales over the largest of all.
template <class T>
std::vector<double> paint_of(const BrokenColor<T>& query) {
    std::vector<std::array<double, 2>> sizes(query.count);
    double largest = std::numeric_limits<double>::min();
    for (std::size_t i = 0; i < query.count; ++i) {
        Color scales;
        for (std::size_t k = 0; k < 3; ++k) scales[k] = static_cast<double>(query.scales[3 * i + k]);
        std::ranges::sort(scales);
        sizes[i] = {scales[1], scales[2]};
        largest = std::max(largest, scales[2]);
    }
    std::vector<double> paint(query.count);
    for (std::size_t i = 0; i < query.count; ++i)
        paint[i] = static_cast<double>(query.opacities[i]) * (sizes[i][0] / largest) * (sizes[i][1] / largest);
    return paint;
}

// Mean shift of each stroke and its neighbors, by their paint.
template <class T>
std::vector<Color> means_around(const BrokenColor<T>& query, const std::vector<Color>& shifts) {
    const std::size_t num = std::min(kAveraged, query.count - 1);
    const std::vector<double> points(query.means, query.means + 3 * query.count), paint = paint_of(query);
    std::vector<std::int32_t> neighbors(num * query.count);
    if (num > 0) find_neighbors({points.data(), query.count, num, 3, query.num_threads}, neighbors.data());
    std::vector<Color> means(query.count);
    for (std::size_t i = 0; i < query.count; ++i) {
        std::array<std::size_t, kAveraged + 1> rows{i};
        for (std::size_t k = 0; k < num; ++k) rows[k + 1] = static_cast<std::size_t>(neighbors[num * i + k]);
        double total = 0;
        for (std::size_t k = 0; k <= num; ++k) total += paint[rows[k]];
        Color& mean = means[i];
        mean = {};
        for (std::size_t k = 0; k <= num; ++k) {
            const double weight = total > 0 ? paint[rows[k]] / total : 1 / static_cast<double>(num + 1);
            for (std::size_t c = 0; c < 3; ++c) mean[c] += weight * shifts[rows[k]][c];
        }
    }
    return means;
}

// A shift whose a and b follow the color [L, a, b], as far as `share`.
void follow(const Color& lab, double share, Color& shift) {
    const double chroma = std::hypot(lab[1], lab[2]), length = std::max(chroma, std::numeric_limits<double>::min());
    const double x = lab[1] / length, y = lab[2] / length, full = std::min(chroma / kColorful, 1.0);
    const double along = kAlong * (shift[1] * x + shift[2] * y), across = kAcross * (shift[2] * x - shift[1] * y);
    const double size = full * full * (3 - 2 * full);
    shift[1] += share * (size * (along * x - across * y) - shift[1]);
    shift[2] += share * (size * (along * y + across * x) - shift[2]);
}

}  // namespace

template <class T>
void break_colors(const BrokenColor<T>& query, T* sh) {
    if (query.count == 0) return;
    const Oklab oklab(query.cones_from_rgb, query.lab_from_roots);
    const std::vector<float> places(query.means, query.means + 3 * query.count);
    std::vector<std::uint64_t> hashes(query.count);
    hash_rows(places.data(), query.count, 3, 1, hashes.data());
    std::vector<Color> colors(query.count), labs(query.count), shifts(query.count);
    const auto limit = [&](std::size_t i) {
        const double room = room_of(oklab, colors[i], labs[i], shifts[i]);
        for (double& value : shifts[i]) value *= room;
    };
    const auto base = [&](std::size_t i) { return sh + 3 * query.sh_terms * i; };
    for_each_row(query.count, kShiftedPerItem, query.num_threads, [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k) colors[i][k] = 0.5 + kBand0 * static_cast<double>(base(i)[k]);
        labs[i] = oklab.lab_of(colors[i]);
        const Color normals = normals_of(hashes[i], query.seed);
        shifts[i] = {normals[0] * query.lightness, normals[1] * query.chroma, normals[2] * query.chroma};
        limit(i);
    });
    const std::vector<Color> means = means_around(query, shifts);
    for_each_row(query.count, kShiftedPerItem, query.num_threads, [&](std::size_t i) {
        Color &shift = shifts[i], &lab = labs[i];
        for (std::size_t k = 0; k < 3; ++k) shift[k] -= means[i][k];
        if (query.follows > 0)
            follow(lab, query.follows, shift);  // after means, or a gray would take its neighbors' color
        limit(i);
        const Color moved = oklab.rgb_of({lab[0] + shift[0], lab[1] + shift[1], lab[2] + shift[2]});
        for (std::size_t k = 0; k < 3; ++k) {
            const double after = std::clamp(moved[k], std::min(colors[i][k], 0.0), std::max(colors[i][k], 1.0));
            base(i)[k] = static_cast<T>((after - 0.5) / kBand0);
        }
    });
}

template void break_colors<float>(const BrokenColor<float>&, float*);
template void break_colors<double>(const BrokenColor<double>&, double*);

}  // namespace brushgs
