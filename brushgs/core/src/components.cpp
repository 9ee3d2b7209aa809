// Each row points to another of its component, the first row to itself: the smaller root becomes that of both.
#include "brushgs/components.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace brushgs {

namespace {

// The first row of a component so far; rows on the way then point to their grandparents (path halving).
std::int32_t root_of(std::int32_t* parents, std::int32_t row) {
    while (parents[row] != row) row = parents[row] = parents[parents[row]];
    return row;
}

}  // namespace

void find_components(const Links& links, std::int32_t* components, std::size_t num_rows) {
    std::vector<std::int32_t> parents(num_rows);
    std::iota(parents.begin(), parents.end(), 0);
    for (std::size_t i = 0; i < links.count; ++i) {
        const std::int32_t a = root_of(parents.data(), static_cast<std::int32_t>(links.a[i]));
        const std::int32_t b = root_of(parents.data(), static_cast<std::int32_t>(links.b[i]));
        parents[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
    std::int32_t count = 0;
    for (std::size_t row = 0; row < num_rows; ++row) {  // a parent is never a later row, so its number is known
        const auto parent = static_cast<std::size_t>(parents[row]);
        components[row] = parent == row ? count++ : components[parent];
    }
}

}  // namespace brushgs
