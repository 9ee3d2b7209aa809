// Gaussians -> floaters: those that, alone or in small groups, float in the air detached from everything solid.
//
// Distance alone does not identify them: a large Gaussian far from its neighbors may be a wall, a small one at the same
// distance a speck of dust. So two Gaussians touch if their visible extents meet along the line between them. Gaussians
// with many touching neighbors form groups (DBSCAN); groups that are large or solid are bodies, together with Gaussians
// attached by a short chain (grass, wires, whiskers). All others are detached, and are floaters if the nearest body is
// far for the scene.
//
// Dense Gaussians count as a body without a search, so that only the others take time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

constexpr double kFaintScene = 0.1;  // scenes are haze if the 99th percentile of opacity is below this

template <class T>
struct FloaterQuery {
    const T* means;      // [count, 3] world units
    const T* quats;      // [count, 4] w, x, y, z; any length above zero
    const T* scales;     // [count, 3] standard deviations, world units
    const T* opacities;  // [count] 0 to 1
    std::size_t count;   // below 2^31
    int num_threads;
};

// Floaters farther than a gap from everything solid.
struct FloaterLevel {
    std::vector<std::uint8_t> rows;  // [count] whether it is one
    double share;                    // of the painted area of the scene, 0 to 1
    double nearest;                  // least gap among them, infinite without any
    bool is_seen;                    // whether they cover enough to be noticed
};

struct Floaters {
    FloaterLevel sure, strong;  // clearly detached; these and closer ones
    bool has_bodies;            // without, there are none
    bool is_haze;               // whether the whole scene is faint
};

// Gaussians of one of `groups` [count], whose first rows are `first`, lie at one place and are judged together.
template <class T>
Floaters find_floaters(const FloaterQuery<T>& query, const std::vector<std::int64_t>& first,
                       const std::vector<std::int64_t>& groups);

}  // namespace brushgs
