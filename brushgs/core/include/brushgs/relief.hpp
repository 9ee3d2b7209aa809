// Relief: the height of the paint of a record at the pixels of a tile.
//
// A stroke adds its weight, that of its color, times thickness + gain (h - 1/2), h the height of its brush. Built-in
// kernels and underpaint have no height of their own. Compiled once per instruction set, see CMakeLists.txt.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/sampling.hpp"
#include "brushgs/streaks.hpp"

namespace brushgs::BRUSHGS_ISA {

// Pixels: a stroke of a built-in kernel, or with `share` the underpaint of a stroke.
template <class T>
[[gnu::always_inline]] inline T thickness_of(const TileTask<T>& task, std::uint32_t id, T share) {
    return task.boxes.reliefs[2 * static_cast<std::size_t>(id)] * share;
}

// Called by `sample_record` to fill `heights` with those of the paint of box `id`, a stroke image; 0 outside the box.
// `other` is called for further data of its pixels.
template <class T, class Heights, class Other>
struct HeightShader {
    using L = Lanes<T>;
    using Real = typename L::Real;
    static constexpr bool needs_height = true;
    Real base, per_step;
    FineBristles<T> fine;
    Heights& heights;
    Other other;

    [[gnu::always_inline]] inline HeightShader(const TileTask<T>& task, const Record<T>& record, std::uint32_t id,
                                               Heights& all, const Other& others)
        : fine(task.boxes.streaks, task.params.levels[static_cast<std::size_t>(record.level)], id, 2),
          heights(all),
          other(others) {
        const T* const relief = task.boxes.reliefs + 2 * static_cast<std::size_t>(id);
        base = L::set(relief[0] - T(0.5) * relief[1]);
        per_step = L::set(relief[1] * static_cast<T>(1.0 / 255));
    }
    [[gnu::always_inline]] inline void operator()(int b, int lane, Real v, typename L::Mask inside) const {
        other(b, lane, v, inside);
        if (fine.noise != nullptr)
            L::store(heights[b] + lane, L::load(heights[b] + lane) + L::where(inside, fine.at(v, inside)));
    }
    template <class... Places>
        requires requires(const Other& asked, const Places&... places) { asked.tint(places...); }
    [[gnu::always_inline]] inline void tint(const Places&... places) const {
        other.tint(places...);
    }
    [[gnu::always_inline]] inline void raise(int b, int lane, Real height, typename L::Mask inside) const {
        L::store(heights[b] + lane, L::where(inside, base + per_step * height));
    }
};

}  // namespace brushgs::BRUSHGS_ISA
