// Links between rows -> the connected component of each row, by union-find.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

struct Links {
    const std::int64_t* a;  // [count] rows, 0 to num_rows - 1
    const std::int64_t* b;  // [count] the rows that these are linked to
    std::size_t count;
};

// Writes the component of each row, [num_rows]. Components are numbered from 0, in the order of their first rows.
void find_components(const Links& links, std::int32_t* components, std::size_t num_rows);

}  // namespace brushgs
