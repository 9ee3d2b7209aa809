// The ground that a scene brings: level paint at the foot of its subject, larger than the subject.
#include <algorithm>
#include <cmath>

#include "brushgs/extent.hpp"
#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

constexpr double kLow = 0.4;       // of the height of a scene, below which its ground is searched for
constexpr double kBin = 0.02;      // of heights, in radii
constexpr double kMostBins = 1e5;  // what lies lower is in the lowest one
constexpr long kAround = 4;        // bins to each side that a band of paint fills
// Of six objects without a ground and three with one: the share of level paint in one band is 0.3 to 0.8 and 0.8 to 1,
// paint below it over that in it 0.03 to 3.7 and 0 to 0.3, and the area that nothing stands on, in areas of what stands
// on it, up to 0.7 and from 2.7.
constexpr double kShare = 0.6, kBelow = 0.6, kBeyond = 1.2;
constexpr double kCovered = 0.4, kThin = 0.2;  // paint over area of a covered cell, for finding and for mapping
constexpr double kEdge[2] = {0.45, 0.8};       // range of coverage over which a ground dissolves
constexpr double kHangs = -0.4;                // height in bands below which paint at the border hangs down
constexpr double kSmooth = 2.0, kCore = 0.9;   // cells over which coverage is smoothed; coverage far from the border
constexpr double kRim = 0.75;                  // maximum coverage of the border of a ground
constexpr double kFills[][2] = {{1.0, 1.0}, {3.0, 1e-2}, {10.0, 1e-4}, {30.0, 1e-7}};  // cells over which color
                                                                                       // spreads, and its share
constexpr double kMuted = 0.75;   // chroma of the table, relative to the ground
constexpr double kExtent = 0.95;  // share of the covered cells within the extent
constexpr std::size_t kLightBins = 25;

// The middle of the heaviest run of bins, as many to each side; as numpy.convolve(..., "same").
long heaviest_bin(const Doubles& bins, long around) {
    const auto size = static_cast<long>(bins.size()), width = 2 * around + 1;
    const long start = (std::min(size, width) - 1) / 2, end = std::max(size, width);
    long best = 0;
    double most = -1;
    for (long place = 0; place < end; ++place) {
        double sum = 0;
        const long last = place + start;
        for (long bin = std::max(last - width + 1, 0L); bin <= std::min(last, size - 1); ++bin)
            sum += bins[static_cast<std::size_t>(bin)];
        if (sum > most) most = sum, best = place;
    }
    return best;
}

class Search {
public:
    explicit Search(const GroundQuery& query) : query_(query), grid_{kGroundSide, kGroundReach * query.radius} {}

    GroundMaps run() {
        GroundMaps ground;
        if (!find_level(ground.level)) return ground;
        double below = 0, within = 0;
        for (std::size_t i = 0; i < query_.count; ++i) {
            const double height = height_of(i, ground.level);
            if (is_in_band(height))
                within += query_.weights[i];
            else if (height < 0)
                below += query_.weights[i];
        }
        if (below > kBelow * within) return ground;
        const auto band = [&](std::size_t i) { return is_in_band(height_of(i, ground.level)) ? 1.0 : 0.0; };
        const Doubles paint = sums(band);
        const Doubles above = sums([&](std::size_t i) {
            const double height = height_of(i, ground.level);
            return !is_in_band(height) && height > 0 ? 1.0 : 0.0;
        });
        const double least = kCovered * grid_.cell() * grid_.cell();
        std::size_t free = 0, stood_on = 0;
        std::vector<std::uint8_t> standing(kCells);
        for (std::size_t cell = 0; cell < kCells; ++cell) {
            standing[cell] = above[cell] > least;
            stood_on += standing[cell];
            free += paint[cell] > least && standing[cell] == 0;
        }
        if (static_cast<double>(free) < kBeyond * static_cast<double>(std::max<std::size_t>(stood_on, 1)))
            return ground;
        map(paint, standing, ground);
        return ground;
    }

private:
    static constexpr std::size_t kCells = kGroundSide * kGroundSide;
    const GroundQuery& query_;
    LevelGrid grid_;

    double height_of(std::size_t row, double level) const { return query_.points[3 * row + 1] - level; }
    bool is_in_band(double height) const { return is_on_ground(height, query_.radius); }

    template <class Factor>
    Doubles sums(const Factor& factor) const {
        Doubles map(kCells);
        for (std::size_t i = 0; i < query_.count; ++i) {
            const double* const point = query_.points + 3 * i;
            grid_.add(point[0], point[2], query_.weights[i] * factor(i), map.data());
        }
        return map;
    }

    // The height over the foot with most level paint; false if it is spread over many heights.
    bool find_level(double& level) const {
        Doubles heights, paint;
        double sum = 0;
        for (std::size_t i = 0; i < query_.count; ++i) {
            const double height = query_.points[3 * i + 1], weight = query_.is_level[i] != 0 ? query_.weights[i] : 0;
            if (!(height < kLow * query_.height && weight > 0)) continue;
            heights.push_back(height / query_.radius);
            paint.push_back(weight);
            sum += weight;
        }
        if (!(sum > 0)) return false;
        const double highest = *std::ranges::max_element(heights);
        const double lowest = std::max(*std::ranges::min_element(heights), highest - kMostBins * kBin);
        std::vector<long> bins;
        for (const double height : heights)
            bins.push_back(static_cast<long>(std::floor(std::max(height - lowest, 0.0) / kBin)));
        Doubles weights(static_cast<std::size_t>(*std::ranges::max_element(bins)) + 1);
        for (std::size_t i = 0; i < bins.size(); ++i) weights[static_cast<std::size_t>(bins[i])] += paint[i];
        const long peak = heaviest_bin(weights, kAround);
        double near = 0, mean = 0;
        for (std::size_t i = 0; i < bins.size(); ++i) {
            if (std::abs(bins[i] - peak) > kAround) continue;
            near += paint[i];
            mean += paint[i] * heights[i];
        }
        if (near < kShare * sum) return false;
        level = mean / near * query_.radius;
        return true;
    }

    // The maps of a ground, from paint around what stands on it; not found if it is scattered.
    void map(const Doubles& paint, const std::vector<std::uint8_t>& standing, GroundMaps& ground) const {
        Doubles dense = paint;
        blur_map(kGroundSide, kGroundSide, 1.0, dense.data());
        const double least = kThin * grid_.cell() * grid_.cell();
        ground.coverage.resize(kCells);
        for (std::size_t i = 0; i < kCells; ++i) ground.coverage[i] = dense[i] > least || standing[i] != 0 ? 1 : 0;
        blur_map(kGroundSide, kGroundSide, kSmooth, ground.coverage.data());
        Doubles distances;
        for (std::size_t i = 0; i < kCells; ++i) {
            if (!(ground.coverage[i] > 0.5)) continue;
            const double middle = 0.5 * (kGroundSide - 1);
            distances.push_back(std::hypot(static_cast<double>(i / kGroundSide) - middle,
                                           static_cast<double>(i % kGroundSide) - middle));
        }
        if (distances.empty()) return;
        ground.is_found = true;
        ground.extent = percentile(distances, kExtent) * grid_.cell();
        ground.tone = tone_of(ground);
        spread(paint, standing, ground);
    }

    void spread(const Doubles& paint, const std::vector<std::uint8_t>& standing, GroundMaps& ground) const {
        Doubles known = paint;
        for (std::size_t i = 0; i < kCells; ++i)
            if (!(ground.coverage[i] > kCore) || standing[i] != 0) known[i] = 0;
        if (std::ranges::none_of(known, [](double value) { return value != 0; })) known = paint;
        std::array<Doubles, 4> planes;  // paint, and color times paint
        planes[0] = known;
        for (std::size_t k = 0; k < 3; ++k) {
            planes[1 + k] = sums(
                [&](std::size_t i) { return is_in_band(height_of(i, ground.level)) ? query_.lab[3 * i + k] : 0.0; });
            for (std::size_t i = 0; i < kCells; ++i)
                if (!(known[i] > 0)) planes[1 + k][i] = 0;
        }
        for (Doubles& plane : planes) {
            Doubles filled(kCells);
            for (const auto& [cells, share] : kFills) {
                Doubles blurred = plane;
                blur_map(kGroundSide, kGroundSide, cells, blurred.data());
                for (std::size_t i = 0; i < kCells; ++i) filled[i] += share * blurred[i];
            }
            plane = std::move(filled);
        }
        const double bare = 1e-9 * *std::ranges::max_element(planes[0]);  // farther than color spreads
        ground.lab.resize(3 * kCells);
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < kCells; ++i)
                ground.lab[k * kCells + i] =
                    (planes[1 + k][i] + bare * ground.tone[k]) / (std::max(planes[0][i], 0.0) + bare);
    }

    // The most frequent color along the border: the mean around its most frequent lightness.
    std::array<double, 3> tone_of(const GroundMaps& ground) const {
        Doubles rim(kCells), weights(query_.count);
        for (std::size_t i = 0; i < kCells; ++i) rim[i] = ground.coverage[i] > 0.5 && ground.coverage[i] < kRim ? 1 : 0;
        bool has_rim = false;
        for (std::size_t i = 0; i < query_.count; ++i) {
            const double* const point = query_.points + 3 * i;
            if (!is_in_band(height_of(i, ground.level))) continue;
            weights[i] = query_.weights[i] * grid_.sample(rim.data(), point[0], point[2]);
            has_rim = has_rim || weights[i] != 0;
        }
        Doubles bins(kLightBins);
        std::vector<long> bin_of(query_.count);
        for (std::size_t i = 0; i < query_.count; ++i) {
            if (!has_rim && is_in_band(height_of(i, ground.level))) weights[i] = query_.weights[i];
            const double last = kLightBins - 1, bin = std::clamp(std::trunc(query_.lab[3 * i] * kLightBins), 0.0, last);
            bin_of[i] = static_cast<long>(bin);
            bins[static_cast<std::size_t>(bin)] += weights[i];
        }
        const long peak = heaviest_bin(bins, 1);
        std::array<double, 3> tone{};
        double sum = 0;
        for (std::size_t i = 0; i < query_.count; ++i) {
            if (std::abs(bin_of[i] - peak) > 1) continue;
            sum += weights[i];
            for (std::size_t k = 0; k < 3; ++k) tone[k] += weights[i] * query_.lab[3 * i + k];
        }
        for (std::size_t k = 0; k < 3; ++k) tone[k] *= (k == 0 ? 1 : kMuted) / sum;
        return tone;
    }
};

// Of a stroke on a stage: the share of its color that is that of the table, and whether it lies below.
struct Dissolving {
    double share;
    bool is_under;
};
Dissolving dissolving_at(const GroundView& ground, const double* point, double radius) {
    const double covered = ground.covered_at(point);
    const double out = std::clamp(1 - (covered - kEdge[0]) / (kEdge[1] - kEdge[0]), 0.0, 1.0);
    const double height = point[1] / (kGroundBand * radius);
    return {is_on_ground(point[1], radius) ? out * out * (3 - 2 * out) : 0.0,
            height < -1 || (height < kHangs && covered < kCore)};
}

}  // namespace

GroundMaps find_ground(const GroundQuery& query) { return Search(query).run(); }

template <class T>
void dissolve(const Place& place, const GroundView& ground, const double* table, const Oklab& oklab,
              const OnGround<T>& strokes) {
    std::array<double, 3> rgb{};
    if (table != nullptr) rgb = oklab.rgb_of({table[0], table[1], table[2]});
    for (std::size_t i = 0; i < strokes.count; ++i) {
        const Dissolving found = dissolving_at(ground, place.local(strokes.means + 3 * i).data(), place.radius);
        const double kept = found.is_under ? 0 : static_cast<double>(strokes.opacities[i]);
        strokes.opacities[i] = static_cast<T>(table != nullptr ? kept : kept * (1 - found.share));
        T* const sh = strokes.sh + 3 * strokes.sh_terms * i;
        for (std::size_t k = 0; k < 3 * strokes.sh_terms && table != nullptr; ++k) {
            double value = static_cast<double>(sh[k]) * (1 - found.share);
            if (k < 3) value += found.share * (std::clamp(rgb[k], 0.0, 1.0) - 0.5) / kBand0;
            sh[k] = static_cast<T>(value);
        }
    }
}

template void dissolve<float>(const Place&, const GroundView&, const double*, const Oklab&, const OnGround<float>&);
template void dissolve<double>(const Place&, const GroundView&, const double*, const Oklab&, const OnGround<double>&);

}  // namespace brushgs
