// A stroke image filtered along one axis: a matrix, mostly of zeros, times the texels.
#pragma once

#include <cstddef>

namespace brushgs {

// result [rows, columns] = weights [rows, inner] x texels [inner, columns]. Each number is summed in the order of
// `inner`, whatever the processor: BLAS and SciPy's LAPACK may round a texel otherwise on another machine.
inline void filter_rows(const double* weights, const double* texels, std::size_t rows, std::size_t inner,
                        std::size_t columns, double* result) {
    for (std::size_t i = 0; i < rows; ++i) {
        double* row = result + i * columns;
        for (std::size_t j = 0; j < columns; ++j) row[j] = 0;
        for (std::size_t k = 0; k < inner; ++k) {
            const double weight = weights[i * inner + k];
            if (weight == 0) continue;
            const double* from = texels + k * columns;
            for (std::size_t j = 0; j < columns; ++j) row[j] += weight * from[j];
        }
    }
}

}  // namespace brushgs
