// `track_directions` around its kernel: picks the kernel, spreads rows over threads, makes the table of costs.
#include "brushgs/track.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "brushgs/cpu.hpp"
#include "brushgs/track_kernel.hpp"

namespace brushgs {

namespace {

constexpr double kCostUnits = 200;  // of the logarithm of a factor of area
constexpr double kMostCost = 500;   // of one view, so that sums over 24 views fit, see track_kernel.cpp
// The cost of lying along the minor axis of a needle. If one axis is four times the other, lying at 45 degrees costs
// 0.75 for the larger box.
constexpr double kMinorAxis = 0.3;
// Twice this is the cost of pointing the other way round, where all of a stroke is seen.
constexpr double kPull = 0.2;

template <class T>
bool track_rows(const GaussianColumns<T>& gaussians, const TrackParams& params, std::size_t begin, std::size_t end,
                TrackScratch& scratch, const Tracks& tracks) {
    const CostTable& table = cost_table();
    Turn* turns = tracks.turns.get();
    AreaScale* area_scales = tracks.area_scales.get();
    return BRUSHGS_KERNEL(track_rows, T)(gaussians, params, table, begin, end, scratch, turns, area_scales);
}

CostTable make_cost_table() {
    CostTable table{};
    for (std::size_t shape = 1; shape < kNumShapes; ++shape) {  // shape 0 has no direction: it costs nothing
        // (r - 1/r)^2, r the ratio of the axes: half octaves from 2^-6 on, at the middle of each.
        const double slenderness = std::exp2(-6 + 0.5 * (static_cast<double>(shape) - 0.5));
        const double squared_anisotropy = slenderness / (slenderness + 4);
        for (std::size_t phase = 0; phase < kNumPhases; ++phase)
            for (std::size_t i = 0; i < 3 * kLineStates; ++i) {
                const double lean = static_cast<double>(i) - static_cast<double>(phase) / kNumPhases;
                const double off = lean * std::numbers::pi / kLineStates;
                // The excess of the box over the area that the ellipse needs, as a logarithm.
                const double area_factor = 0.5 * std::log1p(0.25 * slenderness * std::pow(std::sin(2 * off), 2));
                const double across = kMinorAxis * squared_anisotropy * std::pow(std::sin(off), 2);
                table.rows[shape][phase][i] =
                    static_cast<Cost>(std::lround(std::min(kCostUnits * (area_factor + across), kMostCost)));
            }
    }
    for (std::size_t i = 0; i < 2 * kCircleStates; ++i) {
        const double off = static_cast<double>(i) * 2 * std::numbers::pi / kCircleStates;
        table.away[i] = static_cast<Cost>(std::lround(kCostUnits * kPull * (1 - std::cos(off)) * 256 / 255));
    }
    return table;
}

}  // namespace

const CostTable& cost_table() {
    static const CostTable table = make_cost_table();
    return table;
}

template <class T>
Tracks track_directions(const GaussianColumns<T>& gaussians, const TrackParams& params) {
    Tracks tracks;
    tracks.turns = make_buffer<Turn>(params.num_views * gaussians.count);
    tracks.area_scales = make_buffer<AreaScale>(params.num_views * gaussians.count);
    const std::size_t num_blocks = (gaussians.count + kTrackRows - 1) / kTrackRows;
    const auto num_parts = std::min(num_blocks, static_cast<std::size_t>(std::max(params.num_threads, 1)));
    std::atomic<std::size_t> next{0};
    std::atomic<bool> has_area_scales{false};
    parallel_for(num_parts, params.num_threads, [&](std::size_t) {
        TrackScratch scratch(params.num_views);
        for (std::size_t block = next++; block < num_blocks; block = next++) {
            const std::size_t begin = block * kTrackRows;
            const std::size_t end = std::min(begin + kTrackRows, gaussians.count);
            if (track_rows(gaussians, params, begin, end, scratch, tracks)) has_area_scales = true;
        }
    });
    tracks.has_area_scales = has_area_scales;
    return tracks;
}

template Tracks track_directions(const GaussianColumns<float>&, const TrackParams&);
template Tracks track_directions(const GaussianColumns<double>&, const TrackParams&);

}  // namespace brushgs
