// The kernel of `track_directions`, once per instruction set.
#pragma once

#include "brushgs/track.hpp"

namespace brushgs {

constexpr std::size_t kTrackRows = 64;  // Gaussians tracked at a time

// Costs of directions, whole numbers: the sum over a path stays in 16 bits, see track_kernel.cpp.
using Cost = std::int16_t;
constexpr std::size_t kLineStates = 64;                   // directions of a line that are distinguished: 2.8 degrees
constexpr std::size_t kCircleStates = 128;                // and of an arrow
constexpr std::size_t kCostRow = kCircleStates + 2 * 10;  // the states of one view, repeated a little at both ends
constexpr std::size_t kNumShapes = 32, kNumPhases = 2;

// The cost of every state for every shape of ellipse, half a turn repeated three times: another start rotates the
// ellipse.
struct CostTable {
    alignas(64) Cost rows[kNumShapes][kNumPhases][3 * kLineStates];
    // Of an arrow so many states off the one that the strongest pull is toward, in 256ths of 255; the circle twice.
    alignas(64) Cost away[2 * kCircleStates];
};
const CostTable& cost_table();

// Memory of one thread, for paths of `num_views`.
struct TrackScratch {
    explicit TrackScratch(std::size_t num_views)
        : lanes(make_buffer<float>(kNumSeries * num_views * kTrackRows)),
          column(make_buffer<float>(num_views)),
          positions(make_buffer<std::int32_t>(num_views)),
          costs(make_buffer<Cost>(num_views * kCostRow)),
          targets(make_buffer<std::uint8_t>(num_views)),
          pulls(make_buffer<std::uint8_t>(num_views)) {}
    static constexpr std::size_t kNumSeries = 6;
    Buffer<float> lanes;             // [kNumSeries, num_views, kTrackRows]
    Buffer<float> column;            // [num_views]
    Buffer<std::int32_t> positions;  // [num_views]
    Buffer<Cost> costs;              // [num_views, kCostRow]
    Buffer<std::uint8_t> targets;    // [num_views], states of an arrow
    Buffer<std::uint8_t> pulls;      // [num_views]
};

// Tracks the Gaussians [begin, end), at most kTrackRows, and writes their columns of the outputs, which have
// `gaussians.count` of them; returns whether any area scale is above 1.
#define BRUSHGS_DECLARE_TRACK(isa)                                                                                   \
    namespace isa {                                                                                                  \
    template <class T>                                                                                               \
    bool track_rows(const GaussianColumns<T>& gaussians, const TrackParams& params, const CostTable& table,          \
                    std::size_t begin, std::size_t end, TrackScratch& scratch, Turn* turns, AreaScale* area_scales); \
    }

BRUSHGS_DECLARE_TRACK(in_double)
BRUSHGS_DECLARE_TRACK(baseline)
BRUSHGS_DECLARE_TRACK(avx2)
BRUSHGS_DECLARE_TRACK(avx512)

#undef BRUSHGS_DECLARE_TRACK

}  // namespace brushgs
