// The tones of a stage, by the outline of its subject.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "brushgs/colors.hpp"
#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr double kOutlineBlur = 1.5, kNearly = 0.8;  // pixels, of an outline; share of the subject around its pixels
constexpr std::size_t kBorder = 3;                   // pixels of the picture without outlines
constexpr double kDarkestTone = 0.30, kStep = 0.04;  // candidates for table and wall
constexpr std::size_t kCandidates = 13;
constexpr double kSlopes[] = {-0.14, -0.07, 0.0, 0.07, 0.14};
// Costs, in shares of an outline that stands out: of a wall away from middle tones, of a slope, of an unusual
// difference between table and wall.
constexpr double kAway = 0.4, kSloped = 0.4, kTooNear = 1.0, kTooFar = 0.8;
constexpr double kApart[2] = {0.06, 0.16}, kOpened = 0.12;  // and more if the values of the picture are opened
constexpr double kComplement = 0.6, kLeastChroma = 0.018, kMostChroma = 0.045;  // of the subject's color in the wall
constexpr std::array<double, 2> kWarm{0.010, 0.030}, kCool{-0.005, -0.022};     // a and b of the table instead
constexpr double kOfSubject = 0.2;                                              // of the subject's color in the table
constexpr double kOnTable = 1.15;      // radii of the table as far as which it is seen
constexpr double kFringe = 1.5;        // radius of a ground with its torn border, relative to its covered area
constexpr double kBorderShare = 0.08;  // of the smaller side of a picture, on each side

// Adds pixels by what of the stage is behind them.
class Behind {
public:
    Behind(const OutlineView& view, const Place& place, const ProfileView& profile, double ground_extent)
        : view_(view),
          table_(kOnTable * profile.table),
          wall_(profile.wall),
          own_(kFringe * ground_extent),
          farthest_(1e6 * place.radius),
          eye_(place.eye_of(view.viewmat)) {
        for (std::size_t i = 0; i < 27; ++i) {
            const std::size_t row = i / 9, k = i / 3 % 3, axis = i % 3;
            rays_[3 * row + axis] += view.viewmat[4 * row + k] * place.axes[3 * axis + k];
        }
    }

    void add(std::size_t row, std::size_t column, double lightness, Outline& outline) const {
        const double x = (static_cast<double>(column) + 0.5 - view_.cx) / view_.fx;
        const double y = (static_cast<double>(row) + 0.5 - view_.cy) / view_.fy;
        std::array<double, 3> ray;
        for (std::size_t k = 0; k < 3; ++k) ray[k] = x * rays_[k] + y * rays_[3 + k] + rays_[6 + k];
        const double down = -ray[1];
        const double reach = down > 1e-9 ? eye_[1] / down : std::numeric_limits<double>::infinity();
        const double far = std::min(reach, farthest_);
        const double hits = std::hypot(eye_[0] + far * ray[0], eye_[2] + far * ray[2]);
        const bool is_table = std::isfinite(reach) && reach > 0 && hits < table_;
        if (is_table && !(hits > own_)) return;
        const double level = ray[0] / std::max(std::hypot(ray[0], ray[2]), 1e-12);
        outline.lightness.push_back(lightness);
        outline.is_table.push_back(is_table);
        outline.lateral.push_back((eye_[0] + level * wall_) / wall_);
    }

private:
    const OutlineView& view_;
    double table_, wall_, own_, farthest_;
    std::array<double, 3> eye_;     // local
    std::array<double, 9> rays_{};  // local directions of right, down and forward, in rows
};

// Pixels of an outline before the table, or before the wall, that stand out.
std::size_t num_reading(const Outline& outline, bool is_table, double lightness, double slope) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < outline.lightness.size(); ++i) {
        if ((outline.is_table[i] != 0) != is_table) continue;
        const double behind = lightness + (is_table ? 0 : slope * outline.lateral[i]);
        count += std::abs(outline.lightness[i] - behind) >= kOutlineReads;
    }
    return count;
}

double share_of(const Outline& outline, std::size_t count) {
    return static_cast<double>(count) / std::max(static_cast<double>(outline.lightness.size()), 1.0);
}

double cost_of(double table, double wall, double slope, const ToneChoice& choice) {
    const double apart = std::abs(table - wall);
    double cost = kAway * (std::abs(wall - 0.52) + std::abs(table - 0.5)) + kSloped * std::abs(slope);
    if (choice.ground == nullptr) {
        const double least = kApart[0] + choice.values * kOpened, most = kApart[1] + choice.values * kOpened;
        cost += kTooNear * std::max(least - apart, 0.0) + kTooFar * std::max(apart - most, 0.0);
    }
    return cost;
}

// Writes a and b of table and wall: one warm, one cool.
void set_hues(const std::array<double, 3>& mean, StageTones& tones) {
    const double chroma = std::hypot(mean[1], mean[2]), cool = std::hypot(kCool[0], kCool[1]);
    const double share = std::min(std::max(kComplement * chroma, kLeastChroma), kMostChroma);
    double warmth = 0;
    for (std::size_t k = 0; k < 2; ++k) {
        const double opposite = chroma > 1e-3 ? -mean[1 + k] / chroma : kCool[k] / cool;
        tones.wall[1 + k] = opposite * share;
        warmth += tones.wall[1 + k] * (kWarm[k] - kCool[k]);
    }
    for (std::size_t k = 0; k < 2; ++k)
        tones.table[1 + k] = kOfSubject * mean[1 + k] + (warmth > 0 ? kCool[k] : kWarm[k]);
}

}  // namespace

Outline outline_in(const OutlineView& view, const Place& place, const ProfileView& profile, double ground_extent,
                   const Oklab& oklab) {
    const std::size_t height = view.height, width = view.width, pixels = height * width;
    const Behind behind(view, place, profile, ground_extent);
    std::vector<double> mask(pixels), planes[5];  // of alpha, red, green, blue, and the mask itself, where it is
    for (auto& plane : planes) plane.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        mask[i] = view.alpha[i] > 0.5 ? 1 : 0;
        planes[0][i] = mask[i] * view.alpha[i];
        for (std::size_t k = 0; k < 3; ++k) planes[1 + k][i] = mask[i] * view.rgb[3 * i + k];
        planes[4][i] = mask[i];
    }
    for (auto& plane : planes) blur_map(height, width, kOutlineBlur, plane.data());
    Outline outline;
    for (std::size_t row = kBorder; row + kBorder < height; ++row) {
        for (std::size_t column = kBorder; column + kBorder < width; ++column) {
            const std::size_t i = row * width + column;
            if (!(mask[i] > 0) || !(planes[4][i] < kNearly)) continue;
            std::array<double, 3> rgb;
            for (std::size_t k = 0; k < 3; ++k) rgb[k] = std::clamp(planes[1 + k][i] / planes[0][i], 0.0, 1.0);
            behind.add(row, column, oklab.lab_of(rgb)[0], outline);
        }
    }
    return outline;
}

double tones_read(const Outline& outline, double table, double wall, double slope) {
    return share_of(outline, num_reading(outline, true, table, 0) + num_reading(outline, false, wall, slope));
}

StageTones choose_tones(const Outline& outline, const ToneChoice& choice) {
    StageTones best{};
    double most = -std::numeric_limits<double>::infinity();
    std::vector<double> tables, walls;
    for (std::size_t i = 0; i < kCandidates; ++i) {
        const double lightness = kDarkestTone + kStep * static_cast<double>(i);
        if (choice.ground == nullptr) tables.push_back(lightness);
        if (lightness >= choice.low && lightness <= choice.high) walls.push_back(lightness);
    }
    if (choice.ground != nullptr) tables.push_back(choice.ground[0]);
    std::vector<std::size_t> above;
    for (const double wall : walls)
        for (const double slope : kSlopes) above.push_back(num_reading(outline, false, wall, slope));
    for (const double table : tables) {
        const std::size_t below = num_reading(outline, true, table, 0);
        std::size_t place = 0;
        for (const double wall : walls) {
            for (const double slope : kSlopes) {
                const double reads = share_of(outline, below + above[place++]);
                const double score = reads - cost_of(table, wall, slope, choice);
                if (!(score > most)) continue;
                most = score;
                best.table[0] = table, best.wall[0] = wall, best.slope = slope, best.reads = reads;
            }
        }
    }
    set_hues(choice.mean, best);
    for (std::size_t k = 1; k < 3 && choice.ground != nullptr; ++k) best.table[k] = choice.ground[k];
    return best;
}

template <class T>
double border_alpha(const T* alpha, std::size_t height, std::size_t width) {
    const double wide = std::nearbyint(kBorderShare * static_cast<double>(std::min(width, height)));
    const auto side = static_cast<std::size_t>(std::max(wide, 1.0));
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < height * width; ++i) {
        const std::size_t row = i / width, column = i % width;
        if (row >= side && row + side < height && column >= side && column + side < width) continue;
        sum += static_cast<double>(alpha[i]);
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

template <class T>
std::array<double, 3> mean_lab(const T* sh, std::size_t sh_terms, const double* weights, std::size_t count,
                               const Oklab& oklab) {
    std::array<double, 3> mean{};
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i, sh += 3 * sh_terms) {
        const auto lab = oklab.lab_of(base_rgb(sh));
        sum += weights[i];
        for (std::size_t k = 0; k < 3; ++k) mean[k] += weights[i] * lab[k];
    }
    if (!(sum > 0)) return oklab.lab_of({0.5, 0.5, 0.5});
    for (double& value : mean) value /= sum;
    return mean;
}

#define BRUSHGS_INSTANTIATE(T)                                           \
    template double border_alpha<T>(const T*, std::size_t, std::size_t); \
    template std::array<double, 3> mean_lab<T>(const T*, std::size_t, const double*, std::size_t, const Oklab&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
