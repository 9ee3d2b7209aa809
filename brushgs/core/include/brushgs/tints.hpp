// Colored brushes: what a stroke's color is at a pixel, by the place in its image.
//
// A texel holds what is added to the color of the stroke. Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

// Whether the brush of a record has colors of its own.
template <class T>
[[gnu::always_inline]] inline bool has_tints(const TileTask<T>& task, const Record<T>& record) {
    return task.params.levels[static_cast<std::size_t>(record.level)].tints != nullptr;
}

// How a channel of a record's color comes to be: the sum of both, not below 0.
template <class T>
struct Tints {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Real base[3], step;

    [[gnu::always_inline]] inline Tints(const TileTask<T>& task, const Record<T>& record) {
        const T unit = static_cast<T>(task.params.levels[static_cast<std::size_t>(record.level)].tint_step);
        step = L::set(unit);
        for (int c = 0; c < 3; ++c) base[c] = L::set(record.color[c] - T(kTintZero) * unit);
    }
};

// What `sample_record` calls to fill `colors` with those of a record; 0 outside its box.
template <class T, class Planes>
struct TintShader {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Tints<T> tints;
    Planes& colors;

    [[gnu::always_inline]] inline void operator()(int, int, Real, typename L::Mask) const {}
    template <class Sampler>
    [[gnu::always_inline]] inline void tint(int b, int lane, const Sampler& sampler, const typename L::Word* texel,
                                            const T* fu, const T* fv, typename L::Mask inside) const {
        const auto samples = sampler.tints_at(texel, fu, fv);
        const Real zero = L::set(0);
        for (int c = 0; c < 3; ++c) {
            const Real color = tints.base[c] + tints.step * samples[c].coverage;
            L::store(colors[c][b] + lane, L::where(L::less(inside, zero, color), color));
        }
    }
};

}  // namespace brushgs::BRUSHGS_ISA
