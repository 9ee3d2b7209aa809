// Stroke directions along a camera path, chosen over the whole path at once.
//
// Along the path a Gaussian projects to an ellipse in every view (a knot). Its major axis is a line: known up to half a
// turn, and it spins where the ellipse is nearly round. Per Gaussian, in this order:
//   measure         the axis, relative to the thing where that turns by itself, and how slender the ellipse is, at
//                   every knot
//   choose          the cheapest sequence of directions by dynamic programming (Viterbi): a direction costs what it
//                   makes the box larger than its ellipse needs, a turn of at most 2 states from knot to knot costs
//                   a little, and so does an arrow away from where single frames show it, if that is given
//   smooth          those directions toward the exact axes, the more slender the closer: weighted least squares, a
//                   tridiagonal system solved by the Thomas algorithm
//   limit_steps     no step above the limit: the mean of the upper and the lower Lipschitz envelope
//                   (only a stroke whose thing jumps may spin, at a price, see kSpinCost)
//   set_area_scales a box across a slender ellipse is large: it grows and shrinks over several knots, not at once
//   choose_arrows   of the two arrows of a line, the one that agrees with the anchored direction over the path; not
//                   where arrows were chosen
//
// A closed path starts at the knot with the most slender ellipse, and must return to its first direction. For 15 to
// 30 % of the strokes of trained scenes the line returns turned by an odd number of half turns; for those the choice is
// repeated among the 128 directions of an arrow, with steps of up to 3 states, so that the half turn is spent where it
// costs least.
//
// Compiled once per instruction set (see CMakeLists.txt): only the functions at the end may have external linkage.
// Costs are integers and sums have a fixed order, so that all instruction sets give the same result.
#include "brushgs/track_kernel.hpp"

#include "brushgs/blending.hpp"
#include "brushgs/footprint.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr std::size_t kRows = kTrackRows;
static_assert(kRows == kBlock);

constexpr float kState = static_cast<float>(kPi / kLineStates);  // radians
constexpr float kTwoPi = static_cast<float>(2 * kPi);

constexpr int kReach = 2;          // states that a direction may turn from knot to knot,
constexpr int kHalfTurnReach = 3;  // and where a half turn has to be spent
constexpr Cost kTurnCost[] = {0, 1, 4, 12};

// If the knots are frames and far apart, a stroke may turn by 14 degrees almost for free, which is no spin. If frames
// are more than 12.4 degrees apart, half a turn needs more; then it may turn by 28 degrees, at a cost. (Both ends may
// still move closer to their axes.) With turns of any size at a fixed cost, 19 to 317 strokes in an orbit of 48 frames
// took them, mostly against the axis, for the half turn needed on a closed path.
constexpr int kCoarseReach = 5, kWideReach = 10;
constexpr Cost kCoarseTurnCost[] = {0, 1, 2, 3, 4, 5, 15, 20, 25, 30, 35};
constexpr float kWide = static_cast<float>(20 * kPi / 180);  // most turn from which on the reach is wide
constexpr Cost kSpinCost = 60;
constexpr int kSpinReach = 26;
// No knot costs more than 500 + 80 + 35, and 32 knots lead from the best state to any other, so the cost of a state
// exceeds that of the best by at most 32 x 615 (or, at first, kForbidden). With the best subtracted every 16 knots all
// sums stay under 16 x 615 + 32 x 615 = 29520: in 16 bits.
constexpr std::size_t kKnotsPerRebase = 16;
constexpr Cost kForbidden = 8000;

// Per knot: below the limit of 6 degrees for 1.5 degrees of view change, because uneven paths pass more than one knot a
// frame; and below a spin (15 degrees) at 3 degrees a frame.
constexpr float kLimit = static_cast<float>(5.2 * kPi / 180);
constexpr float kHalfTurnLimit = static_cast<float>(7.2 * kPi / 180);
constexpr float kSpinLimit = static_cast<float>(88 * kPi / 180);  // of a step that spins: it does not flip

constexpr float kUnseenWeight = 0.01F;  // weight of a knot at which the stroke is well outside the picture:
constexpr double kReachSigmas = 4;      // farther than any box reaches, so that it turns freely only out of sight
constexpr float kLeastWeight = 1e-3F;   // of any knot, so that the smoothing has one solution
constexpr float kMostWeight = 1e4F;     // and this needs no more digits than a float has
constexpr float kPinned = 1e6F;         // of the ends of a closed path
constexpr float kSmoothing = 4.0F;      // against the squared turn from knot to knot
// The target of the smoothing is the axis where the choice lies this close to it, else the choice itself.
constexpr float kTrust = static_cast<float>(8 * kPi / 180);

constexpr float kBetweenKnots = 1.5F;  // a stroke near the camera may lie farther off its axis than at either knot

[[gnu::always_inline]] inline float least(float x, float y) { return x < y ? x : y; }
[[gnu::always_inline]] inline float most(float x, float y) { return x > y ? x : y; }

// To the nearest whole number; |x| < 2^22.
[[gnu::always_inline]] inline float rounded(float x) {
    constexpr float rounder = 12582912.0F;  // 1.5 * 2^23
    return (x + rounder) - rounder;
}

// The direction modulo half a turn that is nearest to `target`.
[[gnu::always_inline]] inline float nearest_line(float direction, float target) {
    constexpr float half_turn = static_cast<float>(kPi);
    return direction + half_turn * rounded((target - direction) * (1 / half_turn));
}

// One value per knot and row: [num_views][kRows].
struct Series {
    float* values;
    float* at(std::size_t knot) const { return values + knot * kRows; }
};

// The ellipses of a block of Gaussians along the path.
struct Ellipses {
    Series direction;    // of the major axis, in -pi to pi: the arrow nearer to the projected longest axis; relative
                         // to what is carried
    Series slenderness;  // (r - 1/r)^2, r the ratio of the axes; 0 at or behind the near plane
    Series weight;       // 1 in the picture, else kUnseenWeight
};

struct alignas(64) Block {
    BlockLane mean[3], quat[4], scale[3], opacity;
};

template <class T>
GaussianColumns<T> columns_at(const GaussianColumns<T>& gaussians, std::size_t row) {
    GaussianColumns<T> columns = gaussians;
    columns.means += 3 * row, columns.quats += 4 * row, columns.scales += 3 * row, columns.opacities += row;
    return columns;
}

template <class T>
void measure(const GaussianColumns<T>& gaussians, const TrackParams& params, std::size_t begin, std::size_t count,
             const Ellipses& ellipses) {
    Block block{};
    for (std::size_t i = 0; i < kBlock; ++i) block.quat[0][i] = 1;  // rows beyond the last
    load(gaussians, begin, count, block);
    const double low_pass = params.low_pass, least_opacity = params.rows_per_view > 0 ? kMinAlpha : 0;
    for (std::size_t knot = 0; knot < params.num_views; ++knot) {
        if (params.rows_per_view > 0) load(columns_at(gaussians, knot * params.rows_per_view), begin, count, block);
        const View camera = params.views[knot];
        const ViewFrame view = view_frame(camera);
        float* direction = ellipses.direction.at(knot);
        float* slenderness = ellipses.slenderness.at(knot);
        float* weight = ellipses.weight.at(knot);
        BlockLane found[3];
        for (std::size_t i = 0; i < kRows; ++i) {
            double axes[3][3];
            own_axes<T>(block.quat[0][i], block.quat[1][i], block.quat[2][i], block.quat[3][i], axes);
            const double scales[3] = {block.scale[0][i], block.scale[1][i], block.scale[2][i]};
            const Footprint f = footprint_of(view, block.mean[0][i], block.mean[1][i], block.mean[2][i], axes, scales);
            const Direction major = major_axis(f.difference, f.twice_b, f.spread, f.sum);
            const Variances variance = variances(f, major.cosine, major.sine, low_pass);
            const LongestAxis longest = longest_axis(f, axes, scales);
            const bool is_other = major.cosine * longest.x + major.sine * longest.y < 0;
            const double turned = major.angle > 0 ? major.angle - kPi : major.angle + kPi;

            const double gap = variance.along - variance.across;
            const double slender = gap * gap / (variance.along * variance.across);
            const double reach = kReachSigmas * __builtin_sqrt(variance.along);
            double seen = 1;
            seen = f.center_x + reach > 0 ? seen : static_cast<double>(kUnseenWeight);
            seen = f.center_y + reach > 0 ? seen : static_cast<double>(kUnseenWeight);
            seen = f.center_x - reach < camera.width ? seen : static_cast<double>(kUnseenWeight);
            seen = f.center_y - reach < camera.height ? seen : static_cast<double>(kUnseenWeight);
            // Only comparable (not NaN) values count as in front of the camera and finite.
            double shown = slender <= 1e30 ? slender : (slender > 1e30 ? 1e30 : 0.0);
            shown = f.depth > camera.near ? shown : 0.0;
            const double angle = is_other ? turned : major.angle;
            found[0][i] = absolute(angle) <= 4 ? angle : 0.0;
            found[1][i] = shown;
            seen = block.opacity[i] >= least_opacity ? seen : static_cast<double>(kUnseenWeight);
            found[2][i] = f.depth > camera.near ? seen : static_cast<double>(kUnseenWeight);
        }
        for (std::size_t i = 0; i < kRows; ++i) direction[i] = static_cast<float>(found[0][i]);
        for (std::size_t i = 0; i < kRows; ++i) slenderness[i] = static_cast<float>(found[1][i]);
        for (std::size_t i = 0; i < kRows; ++i) weight[i] = static_cast<float>(found[2][i]);
        if (params.carried == nullptr) continue;
        const float* carried = params.carried + knot * gaussians.count + begin;
        for (std::size_t i = 0; i < count; ++i) {
            const float relative = direction[i] - carried[i];
            direction[i] = relative - kTwoPi * rounded(relative * (1 / kTwoPi));
        }
    }
}

// Whether each row jumps into each knot: 1 or 0.
void mark_jumps(const TrackParams& params, std::size_t begin, std::size_t count, std::size_t num_rows,
                const Series& jumps) {
    for (std::size_t knot = 0; knot < params.num_views; ++knot)
        for (std::size_t i = 0; i < kRows; ++i) {
            const bool jumps_there =
                params.jumps != nullptr && i < count && params.jumps[knot * num_rows + begin + i] != 0;
            jumps.at(knot)[i] = jumps_there ? 1.0F : 0.0F;
        }
}

// Column `row` of a series, begun at knot `start` of a closed path; the last knot is the first again.
void rotate(const Series& series, std::size_t row, std::size_t start, std::size_t num_views, float* column) {
    const std::size_t period = num_views - 1;
    for (std::size_t knot = 0; knot < period; ++knot) {
        const std::size_t from = start + knot < period ? start + knot : start + knot - period;
        column[knot] = series.at(from)[row];
    }
    column[period] = column[0];
    for (std::size_t knot = 0; knot < num_views; ++knot) series.at(knot)[row] = column[knot];
}

// The knot at which the ellipse of a row is most slender, while it is in the picture.
std::size_t most_slender_knot(const Ellipses& ellipses, std::size_t row, std::size_t period) {
    std::size_t most_slender = 0;
    float best = -1;
    for (std::size_t knot = 0; knot < period; ++knot) {
        const float weighted = ellipses.slenderness.at(knot)[row] * ellipses.weight.at(knot)[row];
        if (weighted > best) best = weighted, most_slender = knot;
    }
    return most_slender;
}

// Row of the table for a slenderness: half octaves of it, from the bits of the float.
inline std::size_t shape_of(float slenderness) {
    constexpr float smallest = 0.015625F, largest = 600.0F;  // 2^-6; what the table ends with
    if (slenderness < smallest) return 0;
    const float x = least(slenderness, largest);
    std::uint32_t bits, first;
    __builtin_memcpy(&bits, &x, sizeof bits);
    __builtin_memcpy(&first, &smallest, sizeof first);
    return (bits >> 22) - (first >> 22) + 1;
}

// The costs of the states 0, 1, ... at one knot.
inline const Cost* costs_at(const CostTable& table, const Ellipses& ellipses, std::size_t knot, std::size_t row) {
    constexpr float unseen_slenderness = 0.0625F;
    const float slenderness = ellipses.slenderness.at(knot)[row];
    const bool is_seen = ellipses.weight.at(knot)[row] == 1;
    const std::size_t shape = shape_of(is_seen ? slenderness : least(slenderness, unseen_slenderness));
    // State j lies j - x states off the axis. With x = whole - phase / kNumPhases that is j - whole + phase / ...;
    // the table holds off = i - phase / kNumPhases, so phases count down.
    const float x = ellipses.direction.at(knot)[row] * (1 / kState) * kNumPhases;
    const int steps = static_cast<int>(rounded(x)) + static_cast<int>(kCircleStates * kNumPhases);
    const std::size_t phase = static_cast<std::size_t>(steps) % kNumPhases;
    const std::size_t whole = (static_cast<std::size_t>(steps) / kNumPhases) % kLineStates;
    return table.rows[shape][phase] + (kLineStates - whole) % kLineStates;
}

// Takes where a row should point, and how strongly, at every knot from `start` on.
void take_pulls(const TrackParams& params, std::size_t num_rows, std::size_t row, std::size_t start,
                TrackScratch& scratch) {
    constexpr float per_turn = 65536 / kTwoPi;
    constexpr int per_state = 65536 / static_cast<int>(kCircleStates);
    const std::size_t period = params.num_views - 1;
    for (std::size_t knot = 0; knot < params.num_views; ++knot) {
        std::size_t from = knot;
        if (params.is_closed) {
            from = knot == period ? start : start + knot;
            from = from < period ? from : from - period;
        }
        const std::size_t at = from * num_rows + row;
        int turn = params.targets[at];
        if (params.carried != nullptr) turn -= static_cast<int>(rounded(params.carried[at] * per_turn));
        const auto state = static_cast<unsigned>(turn + 2 * 65536 + per_state / 2) / per_state % kCircleStates;
        scratch.targets[knot] = static_cast<std::uint8_t>(state);
        scratch.pulls[knot] = params.pulls[at];
    }
}

// The costs of the states of an arrow at one knot: those of its line, and of pointing away from its target.
void add_pull(const CostTable& table, const TrackScratch& scratch, std::size_t knot, const Cost* line, Cost* costs) {
    const Cost* away = table.away + (kCircleStates - scratch.targets[knot]) % kCircleStates;
    const int pull = scratch.pulls[knot];
    for (std::size_t j = 0; j < kCircleStates; ++j)
        costs[j] = static_cast<Cost>(line[j % kLineStates] + ((pull * away[j]) >> 8));
}

constexpr Cost turn_cost(int turn, bool is_coarse) { return is_coarse ? kCoarseTurnCost[turn] : kTurnCost[turn]; }

// The cost of the cheapest state within kSpinReach, for every state; `sum` does not wrap.
template <std::size_t states>
void cheapest_to_spin_from(const Cost* sum, Cost* cheapest) {
    constexpr std::size_t reach = kSpinReach, window = 32, length = states + 2 * reach;
    static_assert(2 * window > 2 * reach && window <= 2 * reach, "two windows cover the reach");
    Cost lowest[length];  // of ever more states from j - reach on
    for (std::size_t j = 0; j < length; ++j) lowest[j] = sum[(j + states - reach) % states];
    for (std::size_t size = 1; size < window; size *= 2)
        for (std::size_t j = 0; j + size < length; ++j)
            lowest[j] = lowest[j + size] < lowest[j] ? lowest[j + size] : lowest[j];
    for (std::size_t j = 0; j < states; ++j) {
        const Cost* other = lowest + j + (2 * reach + 1 - window);
        cheapest[j] = *other < lowest[j] ? *other : lowest[j];
    }
}

// Sums the cheapest way to every state of every knot. `start` is the only state allowed at the first knot, or -1. If
// the row jumps it may spin. If `is_pulled`, states are those of an arrow, and their costs those of `add_pull`.
template <std::size_t states, int reach, bool is_coarse, bool is_pulled>
void sum_costs(const CostTable& table, const Ellipses& ellipses, const Series& jumps, std::size_t row,
               std::size_t num_views, int start, TrackScratch& scratch) {
    static_assert(!is_pulled || states == kCircleStates);
    Cost* sums = scratch.costs.get();
    alignas(64) Cost pulled[kCircleStates];
    for (std::size_t knot = 0; knot < num_views; ++knot) {
        const Cost* cost = costs_at(table, ellipses, knot, row);
        if constexpr (is_pulled) add_pull(table, scratch, knot, cost, pulled), cost = pulled;
        constexpr std::size_t period = is_pulled ? kCircleStates : kLineStates;
        Cost* sum = sums + knot * kCostRow + reach;
        const auto cost_of = [cost](std::size_t j) { return cost[j % period]; };
        if (knot == 0) {
            for (std::size_t j = 0; j < states; ++j) sum[j] = start < 0 ? cost_of(j) : kForbidden;
            if (start >= 0) sum[start] = 0;
        } else {
            const Cost* before = sum - kCostRow;
            for (std::size_t half = 0; half < states; half += kLineStates)
                for (std::size_t i = 0; i < kLineStates; ++i) {
                    const Cost* from = before + half + i;
                    Cost best = from[0];
                    for (int turn = 1; turn <= reach; ++turn) {
                        const Cost nearer = from[-turn] < from[turn] ? from[-turn] : from[turn];
                        const Cost turned = static_cast<Cost>(nearer + turn_cost(turn, is_coarse));
                        best = turned < best ? turned : best;
                    }
                    sum[half + i] = static_cast<Cost>(best + cost[is_pulled ? half + i : i]);
                }
            if (jumps.at(knot)[row] > 0) {
                Cost spun[states];
                cheapest_to_spin_from<states>(before, spun);
                for (std::size_t j = 0; j < states; ++j) {
                    const Cost turned = static_cast<Cost>(spun[j] + kSpinCost + cost_of(j));
                    sum[j] = turned < sum[j] ? turned : sum[j];
                }
            }
        }
        if (knot % kKnotsPerRebase == kKnotsPerRebase - 1) {
            Cost smallest = sum[0];
            for (std::size_t j = 1; j < states; ++j) smallest = sum[j] < smallest ? sum[j] : smallest;
            for (std::size_t j = 0; j < states; ++j) sum[j] = static_cast<Cost>(sum[j] - smallest);
        }
        for (int k = 0; k < reach; ++k) {
            sum[k - reach] = sum[static_cast<int>(states) + k - reach];
            sum[static_cast<int>(states) + k] = sum[k];
        }
    }
}

// Traces the cheapest way back from state `last`, or from the cheapest one if that is -1. Positions are
// states that do not wrap.
template <std::size_t states, int reach, bool is_coarse>
void trace_back(const Series& jumps, std::size_t row, std::size_t num_views, int last, const Cost* sums,
                std::int32_t* positions) {
    const Cost* sum = sums + (num_views - 1) * kCostRow + reach;
    int state = last;
    if (last < 0) {
        state = 0;
        for (int j = 1; j < static_cast<int>(states); ++j)
            if (sum[j] < sum[state]) state = j;
    }
    std::int32_t position = state;
    positions[num_views - 1] = position;
    for (std::size_t knot = num_views - 1; knot > 0; --knot) {
        sum -= kCostRow;
        int turn = 0, best = sum[state];
        for (int size = 1; size <= reach; ++size)
            for (const int k : {size, -size}) {
                const int cost = sum[state - k] + turn_cost(size, is_coarse);
                if (cost < best) best = cost, turn = k;
            }
        if (jumps.at(knot)[row] > 0)
            for (int size = reach + 1; size <= kSpinReach; ++size)
                for (const int k : {size, -size}) {
                    const int cost = sum[(state - k + static_cast<int>(states)) % static_cast<int>(states)] + kSpinCost;
                    if (cost < best) best = cost, turn = k;
                }
        position -= turn;
        state = (state - turn + static_cast<int>(states)) % static_cast<int>(states);
        positions[knot - 1] = position;
    }
}

// Whether a closed path has returned to its direction: whole turns, not half turns.
bool has_closed(const std::int32_t* positions, std::size_t num_views) {
    return (positions[num_views - 1] - positions[0]) % static_cast<std::int32_t>(kCircleStates) == 0;
}

// The state nearest to a direction, 0 to kLineStates - 1.
inline int state_of(float direction) {
    const int steps = static_cast<int>(rounded(direction * (1 / kState))) + static_cast<int>(2 * kCircleStates);
    return steps % static_cast<int>(kLineStates);
}

// Whether the other arrow of a line is nearer to a target.
inline bool is_other_arrow(int state, int target) {
    constexpr int states = static_cast<int>(kCircleStates);
    const int off = (target - state + states) % states;
    return off > states / 4 && off < 3 * states / 4;
}

// Chooses the states of one row into `scratch.positions`; returns whether a closed path had to spend a half turn.
template <int reach, int half_turn_reach, bool is_coarse>
bool choose(const TrackParams& params, const CostTable& table, const Ellipses& ellipses, const Series& jumps,
            std::size_t row, TrackScratch& scratch) {
    const Cost* sums = scratch.costs.get();
    std::int32_t* positions = scratch.positions.get();
    const std::size_t num_views = params.num_views;
    const bool is_pulled = params.targets != nullptr;
    int start = params.is_closed ? state_of(ellipses.direction.at(0)[row]) : -1;
    sum_costs<kLineStates, reach, is_coarse, false>(table, ellipses, jumps, row, num_views, start, scratch);
    trace_back<kLineStates, reach, is_coarse>(jumps, row, num_views, start, sums, positions);
    const bool closes = !params.is_closed || has_closed(positions, num_views);
    if (closes && !is_pulled) return false;
    if (is_pulled && start >= 0 && is_other_arrow(start, scratch.targets[0])) start += kLineStates;
    if (closes) {
        sum_costs<kCircleStates, reach, is_coarse, true>(table, ellipses, jumps, row, num_views, start, scratch);
        trace_back<kCircleStates, reach, is_coarse>(jumps, row, num_views, start, sums, positions);
        if (!params.is_closed || has_closed(positions, num_views)) return false;
    } else {
        if (is_pulled)
            sum_costs<kCircleStates, half_turn_reach, is_coarse, true>(table, ellipses, jumps, row, num_views, start,
                                                                       scratch);
        else
            sum_costs<kCircleStates, half_turn_reach, is_coarse, false>(table, ellipses, jumps, row, num_views, start,
                                                                        scratch);
        trace_back<kCircleStates, half_turn_reach, is_coarse>(jumps, row, num_views, start, sums, positions);
    }
    if (!has_closed(positions, num_views))  // a loop of too few knots for a half turn: do not turn
        for (std::size_t knot = 0; knot < num_views; ++knot) positions[knot] = start;
    return !closes;
}

// Chooses the states of one row, and how far it may turn into every knot from the one before: `limit` holds which
// knots it jumps into, and gets this.
void choose_row(const TrackParams& params, const CostTable& table, const Ellipses& ellipses, std::size_t row,
                TrackScratch& scratch, const Series& limit) {
    int reach = kCoarseReach;
    float step = static_cast<float>(params.most_turn);
    if (params.is_coarse && step > kWide) {
        reach = kWideReach;
        choose<kWideReach, kWideReach, true>(params, table, ellipses, limit, row, scratch);
    } else if (params.is_coarse) {
        choose<kCoarseReach, kCoarseReach, true>(params, table, ellipses, limit, row, scratch);
    } else {
        const bool spends = choose<kReach, kHalfTurnReach, false>(params, table, ellipses, limit, row, scratch);
        reach = spends ? kHalfTurnReach : kReach;
        step = least((spends ? kHalfTurnLimit : kLimit) * static_cast<float>(params.step), step);
    }
    const std::int32_t* positions = scratch.positions.get();
    limit.at(0)[row] = step;
    for (std::size_t knot = 1; knot < params.num_views; ++knot) {
        const std::int32_t turn = positions[knot] - positions[knot - 1];
        limit.at(knot)[row] = turn < -reach || turn > reach ? kSpinLimit : step;
    }
}

// Weighted least squares between the targets and the turn from knot to knot, in place: for each row a tridiagonal
// system, solved by the Thomas algorithm. `upper` holds its upper diagonal. A spin parts what lies before it from
// what lies behind it.
void smooth(const TrackParams& params, const Ellipses& ellipses, const Series& limit, const Series& target,
            const Series& upper) {
    const std::size_t num_views = params.num_views, last = num_views - 1;
    const bool is_closed = params.is_closed;
    // For a given rate of turning, the weight of the squared turn does not depend on the distance of knots.
    const float smoothing =
        params.is_coarse ? static_cast<float>(kSmoothing / (params.step * params.step)) : kSmoothing;
    for (std::size_t knot = 0; knot < num_views; ++knot) {
        const bool is_pinned = is_closed && (knot == 0 || knot == last);
        const float* slenderness = ellipses.slenderness.at(knot);
        const float* seen = ellipses.weight.at(knot);
        float* x = target.at(knot);
        float* c = upper.at(knot);
        const float* x_before = target.at(knot > 0 ? knot - 1 : 0);
        const float* c_before = upper.at(knot > 0 ? knot - 1 : 0);
        const float to_before = knot > 0 ? smoothing : 0.0F, to_after = knot < last ? smoothing : 0.0F;
        const float* limit_before = limit.at(knot);
        const float* limit_after = limit.at(knot < last ? knot + 1 : last);
        const float pinned = is_pinned ? kPinned : 0.0F;
        for (std::size_t i = 0; i < kRows; ++i) {
            const float pull = least(slenderness[i], kMostWeight) * seen[i] + kLeastWeight;
            const float weight = pinned > 0 ? pinned : pull;
            const float coupling = limit_before[i] < kSpinLimit ? to_before : 0.0F;
            const float coupling_after = limit_after[i] < kSpinLimit ? to_after : 0.0F;
            const float neighbours = coupling + coupling_after;
            const float inverse = 1 / (weight + neighbours + coupling * (knot > 0 ? c_before[i] : 0.0F));
            x[i] = (weight * x[i] + coupling * (knot > 0 ? x_before[i] : 0.0F)) * inverse;
            c[i] = -coupling_after * inverse;
        }
    }
    for (std::size_t knot = last; knot > 0; --knot) {
        const float* after = target.at(knot);
        const float* c = upper.at(knot - 1);
        float* x = target.at(knot - 1);
        for (std::size_t i = 0; i < kRows; ++i) x[i] -= c[i] * after[i];
    }
}

// How far each row may turn into every knot, and the whole turns of a closed path, [kRows].
struct Limits {
    Series step;
    alignas(64) float turn[kRows];
};

// The lower Lipschitz envelope of `x`: lowers it until no step rises or falls by more than the limit. `sign` -1: the
// upper one.
template <int sign>
void make_envelope(const TrackParams& params, const Limits& limits, const Series& x) {
    constexpr float s = sign;
    const std::size_t last = params.num_views - 1;
    const int num_rounds = params.is_closed ? 2 : 1;
    const auto wrap = [&limits](float* to, const float* from, float direction) {
        for (std::size_t i = 0; i < kRows; ++i)
            to[i] = s * least(s * to[i], s * (from[i] + direction * limits.turn[i]));
    };
    const auto clamp = [](float* to, const float* from, const float* step) {
        for (std::size_t i = 0; i < kRows; ++i) to[i] = s * least(s * to[i], s * from[i] + step[i]);
    };
    for (int round = 0; round < num_rounds; ++round) {
        if (round > 0) wrap(x.at(0), x.at(last), -1);
        for (std::size_t knot = 1; knot <= last; ++knot) clamp(x.at(knot), x.at(knot - 1), limits.step.at(knot));
    }
    for (int round = 0; round < num_rounds; ++round) {
        if (round > 0) wrap(x.at(last), x.at(0), 1);
        for (std::size_t knot = last; knot > 0; --knot) clamp(x.at(knot - 1), x.at(knot), limits.step.at(knot));
    }
}

// The mean of the two envelopes keeps the limit, equals `x` where `x` keeps it, and is centerd in clipped parts.
void limit_steps(const TrackParams& params, const Limits& limits, const Series& x, const Series& upper) {
    const std::size_t num_views = params.num_views;
    for (std::size_t k = 0; k < num_views * kRows; ++k) upper.values[k] = x.values[k];
    make_envelope<1>(params, limits, upper);
    make_envelope<-1>(params, limits, x);
    for (std::size_t k = 0; k < num_views * kRows; ++k) x.values[k] = 0.5F * (x.values[k] + upper.values[k]);
}

// sin(pi y)^2 for any y, to 0.003: from Bhaskara's rational approximation.
[[gnu::always_inline]] inline float squared_sine(float y) {
    const float z = y - rounded(y);
    const float t = z < 0 ? -z : z;
    const float product = t * (1 - t);
    const float sine = 16 * product / (5 - 4 * product);
    return sine * sine;
}

// The squared area of the box of each row, in areas of the smallest box around its ellipse: given by its direction, and
// raised so that it grows and shrinks by no more than `growth` squared from knot to knot.
void set_area_scales(const TrackParams& params, const Ellipses& ellipses, const Series& x, const Series& area) {
    const std::size_t last = params.num_views - 1;
    const float margin = (params.is_coarse ? 1.0F : kBetweenKnots) * 0.25F;
    for (std::size_t knot = 0; knot <= last; ++knot)
        for (std::size_t i = 0; i < kRows; ++i) {
            const float off = (x.at(knot)[i] - ellipses.direction.at(knot)[i]) * (4 / kTwoPi);
            const float slenderness = least(ellipses.slenderness.at(knot)[i], 1e6F);
            const float seen = ellipses.weight.at(knot)[i] == 1 ? 1.0F : 0.0F;
            area.at(knot)[i] = 1 + margin * slenderness * squared_sine(off) * seen;
        }
    const float shrink = static_cast<float>(1 / (params.growth * params.growth));
    const int num_rounds = params.is_closed ? 2 : 1;
    const auto raise = [](float* to, const float* from, float factor) {
        for (std::size_t i = 0; i < kRows; ++i) to[i] = most(to[i], from[i] * factor);
    };
    for (int round = 0; round < num_rounds; ++round) {
        if (round > 0) raise(area.at(0), area.at(last), 1);
        for (std::size_t knot = 1; knot <= last; ++knot) raise(area.at(knot), area.at(knot - 1), shrink);
    }
    for (int round = 0; round < num_rounds; ++round) {
        if (round > 0) raise(area.at(last), area.at(0), 1);
        for (std::size_t knot = last; knot > 0; --knot) raise(area.at(knot - 1), area.at(knot), shrink);
    }
}

// Half a turn for the rows that would disagree with the anchored direction over the path, else 0.
void choose_arrows(std::size_t num_views, const Ellipses& ellipses, const Series& x, float* half_turns) {
    alignas(64) float agreement[kRows] = {};
    for (std::size_t knot = 0; knot < num_views; ++knot)
        for (std::size_t i = 0; i < kRows; ++i) {
            const float off = (x.at(knot)[i] - ellipses.direction.at(knot)[i]) * (1 / kTwoPi);
            const float turn = off - rounded(off);
            const float slenderness = ellipses.slenderness.at(knot)[i];
            const float weight = ellipses.weight.at(knot)[i] * slenderness / (slenderness + 4);
            agreement[i] += weight * (1 - 4 * (turn < 0 ? -turn : turn));
        }
    for (std::size_t i = 0; i < kRows; ++i) half_turns[i] = agreement[i] < 0 ? static_cast<float>(kPi) : 0.0F;
}

inline Turn turn_of(float direction) {
    const float turns = direction * (1 / kTwoPi);
    const float part = (turns - rounded(turns)) * 65536.0F;
    return static_cast<Turn>(static_cast<std::int32_t>(rounded(part)));
}

inline AreaScale area_scale_of(float squared_area) {
    constexpr float unscaled = 1.01F;  // as good as 1: most boxes, and they are many
    if (squared_area < unscaled) return 0;
    const float octaves = 0.5F * __builtin_log2f(squared_area);
    return static_cast<AreaScale>(least(rounded(octaves * kAreaScaleSteps), 65535.0F));
}

template <class T>
bool run(const GaussianColumns<T>& gaussians, const TrackParams& params, const CostTable& table, std::size_t begin,
         std::size_t end, TrackScratch& scratch, Turn* turns, AreaScale* area_scales) {
    const std::size_t num_views = params.num_views, count = end - begin;
    Series series[TrackScratch::kNumSeries];
    for (std::size_t k = 0; k < TrackScratch::kNumSeries; ++k)
        series[k].values = scratch.lanes.get() + k * num_views * kRows;
    const Ellipses ellipses{series[0], series[1], series[2]};
    const Series x = series[3], upper = series[4];
    Limits limits{series[5], {}};

    measure(gaussians, params, begin, count, ellipses);
    mark_jumps(params, begin, count, gaussians.count, limits.step);

    std::size_t starts[kRows] = {};
    for (std::size_t i = 0; i < kRows; ++i) {
        if (i < count && params.is_closed) {
            starts[i] = most_slender_knot(ellipses, i, num_views - 1);
            for (const Series& column : {ellipses.direction, ellipses.slenderness, ellipses.weight, limits.step})
                rotate(column, i, starts[i], num_views, scratch.column.get());
        }
        if (i < count) {
            if (params.targets != nullptr) take_pulls(params, gaussians.count, begin + i, starts[i], scratch);
            choose_row(params, table, ellipses, i, scratch, limits.step);
        } else {
            for (std::size_t knot = 0; knot < num_views; ++knot) scratch.positions[knot] = 0;
            for (std::size_t knot = 0; knot < num_views; ++knot) limits.step.at(knot)[i] = 0;
        }
        for (std::size_t knot = 0; knot < num_views; ++knot) {
            const float chosen = static_cast<float>(scratch.positions[knot]) * kState;
            const float axis = nearest_line(ellipses.direction.at(knot)[i], chosen);
            const float off = axis - chosen;
            x.at(knot)[i] = (off < 0 ? -off : off) < kTrust ? axis : chosen;
        }
        if (params.is_closed) {  // whole turns, exactly
            const auto states = scratch.positions[num_views - 1] - scratch.positions[0];
            limits.turn[i] = static_cast<float>(states / static_cast<std::int32_t>(kCircleStates)) * kTwoPi;
            x.at(num_views - 1)[i] = x.at(0)[i] + limits.turn[i];
        }
    }
    smooth(params, ellipses, limits.step, x, upper);
    limit_steps(params, limits, x, upper);
    set_area_scales(params, ellipses, x, upper);
    alignas(64) float half_turns[kRows] = {};
    if (params.targets == nullptr) choose_arrows(num_views, ellipses, x, half_turns);

    bool has_area_scales = false;
    const std::size_t period = num_views - 1;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t knot = 0; knot < num_views; ++knot) {
            std::size_t to = knot + starts[i], from = knot;
            if (params.is_closed) {
                to = to < period ? to : to - period;
                if (knot == period) to = period, from = starts[i] == 0 ? 0 : period - starts[i];
            }
            const Turn turn = turn_of(x.at(from)[i] + half_turns[i]);
            const AreaScale area_factor = area_scale_of(upper.at(from)[i]);
            turns[to * gaussians.count + begin + i] = turn;
            area_scales[to * gaussians.count + begin + i] = area_factor;
            has_area_scales |= area_factor != 0;
        }
    }
    return has_area_scales;
}

}  // namespace

template <class T>
bool track_rows(const GaussianColumns<T>& gaussians, const TrackParams& params, const CostTable& table,
                std::size_t begin, std::size_t end, TrackScratch& scratch, Turn* turns, AreaScale* area_scales) {
    return run(gaussians, params, table, begin, end, scratch, turns, area_scales);
}

#ifdef BRUSHGS_IN_DOUBLE
template bool track_rows<double>(const GaussianColumns<double>&, const TrackParams&, const CostTable&, std::size_t,
                                 std::size_t, TrackScratch&, Turn*, AreaScale*);
#else
template bool track_rows<float>(const GaussianColumns<float>&, const TrackParams&, const CostTable&, std::size_t,
                                std::size_t, TrackScratch&, Turn*, AreaScale*);
#endif

}  // namespace brushgs::BRUSHGS_ISA
