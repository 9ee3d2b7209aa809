// Raw values of a scene file -> the columns of its drawable rows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "brushgs/colors.hpp"
#include "brushgs/scene_rows.hpp"

namespace brushgs {

constexpr auto kC0 = static_cast<float>(kBand0);
constexpr float kMostLog = 88.72283935546875F;  // exp of a larger log-scale overflows float32

// One drawable row at a time, from raw values: log-scales and logits.
struct RowSink {
    SceneColumns& out;
    std::array<float, 3> mean{}, scale{};
    std::array<float, 4> quat{};
    float logit = 0;
    std::array<float, 48> sh{};

    void add() {
        const auto is_finite = [](float value) { return std::isfinite(value); };
        const bool is_drawable = std::ranges::all_of(mean, is_finite) && std::ranges::all_of(quat, is_finite) &&
                                 std::ranges::all_of(scale, [](float value) { return value < kMostLog; }) &&
                                 !std::isnan(logit) && std::all_of(sh.begin(), sh.begin() + 3, is_finite) &&
                                 std::ranges::any_of(quat, [](float value) { return value != 0; });
        if (!is_drawable) {
            ++out.num_dropped;
            return;
        }
        out.means.insert(out.means.end(), mean.begin(), mean.end());
        out.quats.insert(out.quats.end(), quat.begin(), quat.end());
        for (const float value : scale) out.scales.push_back(std::exp(value));
        out.opacities.push_back(1 / (1 + std::exp(-logit)));
        for (std::size_t i = 0; i < 3 * out.sh_terms; ++i) out.sh.push_back(std::isfinite(sh[i]) ? sh[i] : 0);
        ++out.count;
    }
};

inline void reserve(SceneColumns& out, std::size_t count) {
    out.means.reserve(3 * count);
    out.quats.reserve(4 * count);
    out.scales.reserve(3 * count);
    out.opacities.reserve(count);
    out.sh.reserve(3 * out.sh_terms * count);
}

// The logit of an opacity that is stored as a byte.
inline float logit_of(std::uint8_t byte) {
    const float opacity = static_cast<float>(byte) / 255;
    return std::log(opacity) - std::log1p(-opacity);
}

}  // namespace brushgs
