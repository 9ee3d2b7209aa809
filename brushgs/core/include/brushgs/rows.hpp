// Rows of a scene by their marks, and columns of such rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

// The rows with this mark, ascending.
inline std::vector<std::uint32_t> marked(const std::vector<std::uint8_t>& marks, std::uint8_t mark = 1) {
    std::vector<std::uint32_t> rows;
    for (std::size_t i = 0; i < marks.size(); ++i)
        if (marks[i] == mark) rows.push_back(static_cast<std::uint32_t>(i));
    return rows;
}

// These rows of a column [., width].
template <class T, class Row>
std::vector<T> taken_from(const T* column, std::size_t width, const std::vector<Row>& rows) {
    std::vector<T> taken;
    taken.reserve(width * rows.size());
    for (const Row row : rows) {
        const T* const first = column + width * static_cast<std::size_t>(row);
        taken.insert(taken.end(), first, first + width);
    }
    return taken;
}

}  // namespace brushgs
