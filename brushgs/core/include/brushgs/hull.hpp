// Convex hulls: the only points that framing depends on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

// Ascending rows of the vertices of the convex hull of points [count, 3], which grows from a simplex, the rows of four
// points that span space, by the point that is farthest outside, until there are `most` vertices. A point less than
// `thickness` above a facet is not outside.
// Source: Barber, Dobkin and Huhdanpaa 1996, The Quickhull Algorithm for Convex Hulls.
std::vector<std::int64_t> hull_rows(const double* points, const std::array<std::uint32_t, 4>& simplex,
                                    std::size_t count, std::size_t most, double thickness);

}  // namespace brushgs
