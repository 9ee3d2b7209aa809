// Blending in depth order: the weights of one record at the pixels of a vector.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include "brushgs/blending.hpp"
#include "brushgs/lanes.hpp"

namespace brushgs::BRUSHGS_ISA {

template <class T>
struct Blended {
    using L = Lanes<T>;
    typename L::Real before, weight;  // the light that reaches the record; the share of it that the record takes
    typename L::Mask painted, kept;   // where its alpha can be seen; where it is blended

    // Bits of the pixels in which it would leave too little light: these are finished, without it.
    [[gnu::always_inline]] inline unsigned finished() const { return L::bits(painted) & ~L::bits(kept); }
};

// `light` is the light that reaches the record, updated to the light behind it; it never falls below `darkest`.
template <class T>
[[gnu::always_inline]] inline Blended<T> blend_lanes(typename Lanes<T>::Real alpha, typename Lanes<T>::Real darkest,
                                                     T* light) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    const auto painted = L::at_least(L::from_bits(~0u), alpha, L::set(static_cast<T>(kMinAlpha)));
    const Real before = L::load(light);
    const Real full = before * alpha;
    const Real after = before - full;
    const auto kept = L::at_least(painted, after, darkest);
    L::store(light, L::select(kept, after, before));
    return {before, L::where(kept, full), painted, kept};
}

}  // namespace brushgs::BRUSHGS_ISA
