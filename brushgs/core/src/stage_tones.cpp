// The tones of a stage, by the outline of its subject.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "brushgs/colors.hpp"
#include "brushgs/stage.hpp"

namespace brushgs {

namespace {

constexpr double kBlur = 1.5, kNearly = 0.8;     // pixels, of an outline; share of the subject around its pixels
constexpr std::size_t kBorder = 3;               // pixels of the picture without outlines
constexpr double kDarkest = 0.30, kStep = 0.04;  // candidates for table and wall
constexpr std::size_t kCandidates = 13;
constexpr double kSlopes[] = {-0.14, -0.07, 0.0, 0.07, 0.14};
// Costs, in shares of an outline that stands out: of a wall away from middle tones, of a slope, of an unusual
// difference between table and wall.
constexpr double kAway = 0.4, kSloped = 0.4, kTooNear = 1.0, kTooFar = 0.8;
constexpr double kApart[2] = {0.06, 0.16}, kOpened = 0.12;  // and more if the values of the picture are opened
constexpr double kComplement = 0.6, kLeastChroma = 0.018, kMostChroma = 0.045;  // of the subject's color in the wall
constexpr std::array<double, 2> kWarm{0.010, 0.030}, kCool{-0.005, -0.022};     // a and b of the table instead
constexpr double kOfSubject = 0.2;                                              // of the subject's color in the table
constexpr double kOnTable = 1.15;  // radii of the table as far as which it is seen

void add_pixel(const OutlineView& view, std::size_t row, std::size_t column, double lightness, Outline& outline) {
    const double x = (static_cast<double>(column) + 0.5 - view.cx) / view.fx;
    const double y = (static_cast<double>(row) + 0.5 - view.cy) / view.fy;
    std::array<double, 3> ray;
    for (std::size_t k = 0; k < 3; ++k) ray[k] = x * view.rays[k] + y * view.rays[3 + k] + view.rays[6 + k];
    const double down = -ray[1];
    const double reach = down > 1e-9 ? view.eye[1] / down : std::numeric_limits<double>::infinity();
    const double far = std::min(reach, 1e6 * view.radius);
    const double hits = std::hypot(view.eye[0] + far * ray[0], view.eye[2] + far * ray[2]);
    const bool is_table = std::isfinite(reach) && reach > 0 && hits < kOnTable * view.table;
    if (is_table && !(hits > view.own)) return;
    const double level = ray[0] / std::max(std::hypot(ray[0], ray[2]), 1e-12);
    outline.lightness.push_back(lightness);
    outline.is_table.push_back(is_table);
    outline.lateral.push_back((view.eye[0] + level * view.wall) / view.wall);
}

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

Outline outline_in(const OutlineView& view) {
    const std::size_t height = view.height, width = view.width, pixels = height * width;
    const Oklab oklab(view.cones_from_rgb, view.lab_from_roots);
    std::vector<double> mask(pixels), planes[5];  // of alpha, red, green, blue, and the mask itself, where it is
    for (auto& plane : planes) plane.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        mask[i] = view.alpha[i] > 0.5 ? 1 : 0;
        planes[0][i] = mask[i] * view.alpha[i];
        for (std::size_t k = 0; k < 3; ++k) planes[1 + k][i] = mask[i] * view.rgb[3 * i + k];
        planes[4][i] = mask[i];
    }
    for (auto& plane : planes) blur_map(height, width, kBlur, plane.data());
    Outline outline;
    for (std::size_t row = kBorder; row + kBorder < height; ++row) {
        for (std::size_t column = kBorder; column + kBorder < width; ++column) {
            const std::size_t i = row * width + column;
            if (!(mask[i] > 0) || !(planes[4][i] < kNearly)) continue;
            std::array<double, 3> rgb;
            for (std::size_t k = 0; k < 3; ++k) rgb[k] = std::clamp(planes[1 + k][i] / planes[0][i], 0.0, 1.0);
            add_pixel(view, row, column, oklab.lab_of(rgb)[0], outline);
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
        const double lightness = kDarkest + kStep * static_cast<double>(i);
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

}  // namespace brushgs
