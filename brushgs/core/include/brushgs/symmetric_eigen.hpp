// Eigenvalues and eigenvectors of small symmetric matrices, by cyclic Jacobi rotations.
// Source: Golub and Van Loan 2013, Matrix Computations, algorithm 8.5.3.
#pragma once

#include <cmath>
#include <cstddef>

namespace brushgs {

// The eigenvalues are on the diagonal of `matrix` afterwards, the eigenvectors in the columns of `vectors`, both
// [size, size] by rows; neither is sorted.
[[gnu::always_inline]] inline void symmetric_eigen(double* matrix, double* vectors, std::size_t size) {
    constexpr int kMostSweeps = 30;  // convergence is quadratic: six do for 16 x 16
    for (std::size_t i = 0; i < size * size; ++i) vectors[i] = i % (size + 1) == 0;
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        bool is_diagonal = true;
        for (std::size_t p = 0; p < size; ++p)
            for (std::size_t q = p + 1; q < size; ++q) {
                const double between = matrix[p * size + q];
                const double low = matrix[p * size + p], high = matrix[q * size + q];
                // Too small to change either, or the next sweep.
                if (!(std::abs(between) > 1e-16 * std::sqrt(std::abs(low) * std::abs(high)) &&
                      std::abs(between) > 1e-300))
                    continue;
                is_diagonal = false;
                const double ratio = (high - low) / (2 * between);
                const double tangent = (ratio < 0 ? -1 : 1) / (std::abs(ratio) + std::sqrt(ratio * ratio + 1));
                const double cosine = 1 / std::sqrt(tangent * tangent + 1), sine = tangent * cosine;
                const auto rotate = [=](double& first, double& second) {
                    const double before = first;
                    first = cosine * before - sine * second, second = sine * before + cosine * second;
                };
                for (std::size_t k = 0; k < size; ++k) rotate(matrix[k * size + p], matrix[k * size + q]);
                for (std::size_t k = 0; k < size; ++k) rotate(matrix[p * size + k], matrix[q * size + k]);
                matrix[p * size + q] = matrix[q * size + p] = 0;
                for (std::size_t k = 0; k < size; ++k) rotate(vectors[k * size + p], vectors[k * size + q]);
            }
        if (is_diagonal) return;
    }
}

}  // namespace brushgs
