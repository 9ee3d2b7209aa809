// Streaks along a stroke: the factor of its color at a pixel, by the position across the stroke.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/lanes.hpp"
#include "brushgs/raster.hpp"

namespace brushgs::BRUSHGS_ISA {

constexpr double kMostReach = 1 + 2.0 * kBristleMargin / kBristles;

// Whether streaks are visible in a box: many are too small. Only such boxes use a level that reaches beyond the noise.
template <class T>
[[gnu::always_inline]] inline bool shows_streaks(const TileTask<T>& task, const Record<T>& record, std::uint32_t id) {
    const StreakView<T>& streaks = task.boxes.streaks;
    return streaks.noise != nullptr && streaks.weights[2 * id] + streaks.weights[2 * id + 1] > 0 &&
           task.params.levels[static_cast<std::size_t>(record.level)].reach_v <= kMostReach;
}

// The streaks of one box of a stroke image.
template <class T>
struct Streaks {
    using L = Lanes<T>;
    using Real = typename L::Real;

    // A factor, or its derivative by the weights, from noise.
    struct Mix {
        Real base, first, second;

        [[gnu::always_inline]] inline Mix(T constant, const T* weights) {
            constexpr double unit = 1 / 127.5;
            base = L::set(constant - weights[0] - weights[1]);
            first = L::set(static_cast<T>(unit) * weights[0]);
            second = L::set(static_cast<T>(unit) * weights[1]);
        }
    };

    // Noise at a place: between two bristles.
    struct Noise {
        Real first[2], second[2], fraction;

        [[gnu::always_inline]] inline Real mixed(const Mix& mix) const {
            const Real near = first[0] * mix.first + second[0] * mix.second;
            return mix.base + (near + fraction * step(mix, near));
        }
        // The derivative of `mixed` by the place.
        [[gnu::always_inline]] inline Real slope(const Mix& mix) const {
            return step(mix, first[0] * mix.first + second[0] * mix.second);
        }

    private:
        [[gnu::always_inline]] inline Real step(const Mix& mix, Real near) const {
            return (first[1] * mix.first + second[1] * mix.second) - near;
        }
    };

    Real scale, offset;  // bristles per texel, bristle at texel 0
    const std::uint16_t* noise;

    [[gnu::always_inline]] inline Streaks(const StreakView<T>& streaks, const Level& level, std::uint32_t id) {
        const double per_texel = kBristles * level.reach_v / (level.rows - 1);
        scale = L::set(static_cast<T>(per_texel));
        offset = L::set(static_cast<T>(kBristleMargin + 0.5 * kBristles * (1 - level.reach_v)));
        noise = streaks.noise + 2 * static_cast<std::size_t>(streaks.starts[id]);
    }

    // Defined where `mask` is set: inside the box, at v texels across.
    [[gnu::always_inline]] inline Noise at(Real v, typename L::Mask mask) const {
        const Real place = offset + scale * v, bristle = L::whole(place);
        const auto packed = L::gather(noise, L::truncate(bristle + bristle), mask);
        return {{L::template byte<0>(packed), L::template byte<1>(packed)},
                {L::template byte<2>(packed), L::template byte<3>(packed)},
                place - bristle};
    }
};

// Fine bristles of one box of a stroke image: what they add to its color's factor (value 1) or its height (value 2).
template <class T>
struct FineBristles {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Real scale{}, offset{}, weight{};      // bristles per texel, bristle at texel 0, of the noise
    const std::uint16_t* noise = nullptr;  // null: there are none

    [[gnu::always_inline]] inline FineBristles(const StreakView<T>& streaks, const Level& level, std::uint32_t id,
                                               std::size_t value) {
        if (streaks.fine == nullptr || !(level.reach_v <= kMostReach)) return;
        const T* const fine = streaks.fine + 3 * static_cast<std::size_t>(id);
        if (fine[value] == 0) return;
        const double count = static_cast<double>(fine[0]);
        scale = L::set(static_cast<T>(count * level.reach_v / (level.rows - 1)));
        // Whole periods more: places are never negative.
        offset = L::set(static_cast<T>(kMostFine + streaks.starts[id] + 0.5 * count * (1 - level.reach_v)));
        weight = L::set(fine[value]);
        noise = streaks.noise + 2 * kBristleMargin;
    }

    // Defined where `mask` is set, as of `Streaks`.
    [[gnu::always_inline]] inline Real at(Real v, typename L::Mask mask) const {
        constexpr T period = 256;
        const Real place = offset + scale * v, bristle = L::whole(place);
        const Real first = bristle - L::set(period) * L::whole(bristle * L::set(1 / period));
        const auto packed = L::gather(noise, L::truncate(first + first), mask);
        const Real near = L::template byte<0>(packed);
        const Real here = near + (place - bristle) * (L::template byte<1>(packed) - near);
        return weight * (here * L::set(static_cast<T>(1 / 127.5)) - L::set(T(1)));
    }
};

}  // namespace brushgs::BRUSHGS_ISA
