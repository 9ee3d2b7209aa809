// The spherical harmonics of 3D Gaussian Splatting (Kerbl et al. 2023) and their derivatives.
//
// Compiled once per instruction set, see CMakeLists.txt.
#pragma once

namespace brushgs::BRUSHGS_ISA {

// The real spherical harmonics of 3D Gaussian Splatting up to `degree` at a unit direction.
template <int degree, class T>
inline void sh_basis(T x, T y, T z, T* basis) {
    basis[0] = T(0.28209479177387814);
    if constexpr (degree >= 1) {
        basis[1] = T(-0.4886025119029199) * y;
        basis[2] = T(0.4886025119029199) * z;
        basis[3] = T(-0.4886025119029199) * x;
    }
    if constexpr (degree >= 2) {
        const T xx = x * x, yy = y * y, zz = z * z;
        basis[4] = T(1.0925484305920792) * (x * y);
        basis[5] = T(-1.0925484305920792) * (y * z);
        basis[6] = T(0.31539156525252005) * (2 * zz - xx - yy);
        basis[7] = T(-1.0925484305920792) * (x * z);
        basis[8] = T(0.5462742152960396) * (xx - yy);
        if constexpr (degree >= 3) {
            basis[9] = T(-0.5900435899266435) * y * (3 * xx - yy);
            basis[10] = T(2.890611442640554) * z * (x * y);
            basis[11] = T(-0.4570457994644658) * y * (4 * zz - xx - yy);
            basis[12] = T(0.3731763325901154) * z * (2 * zz - 3 * xx - 3 * yy);
            basis[13] = T(-0.4570457994644658) * x * (4 * zz - xx - yy);
            basis[14] = T(1.445305721320277) * z * (xx - yy);
            basis[15] = T(-0.5900435899266435) * x * (xx - 3 * yy);
        }
    }
}

// Sum over terms of basis x coefficient. Four terms of three channels are twelve numbers in a row: three vectors of
// four, whose sums are sorted by channel at the end. The basis is read number by number: a vector load right after
// scalar stores would wait for memory, and take twice as long.
template <int degree, class T>
inline void add_terms(const T* sh, const T* basis, T* color) {
    constexpr int num_terms = (degree + 1) * (degree + 1);
    typedef T Quad __attribute__((vector_size(4 * sizeof(T))));
    Quad first{}, second{}, third{};
    for (int k = 0; k + 4 <= num_terms; k += 4) {
        const Quad weights{basis[k], basis[k + 1], basis[k + 2], basis[k + 3]};
        Quad terms;
        __builtin_memcpy(&terms, sh + 3 * k, sizeof terms);
        first += terms * __builtin_shufflevector(weights, weights, 0, 0, 0, 1);
        __builtin_memcpy(&terms, sh + 3 * k + 4, sizeof terms);
        second += terms * __builtin_shufflevector(weights, weights, 1, 1, 2, 2);
        __builtin_memcpy(&terms, sh + 3 * k + 8, sizeof terms);
        third += terms * __builtin_shufflevector(weights, weights, 2, 3, 3, 3);
    }
    color[0] = (first[0] + first[3]) + (second[2] + third[1]);
    color[1] = (first[1] + second[0]) + (second[3] + third[2]);
    color[2] = (first[2] + second[1]) + (third[0] + third[3]);
    if constexpr (num_terms % 4 == 1)
        for (int c = 0; c < 3; ++c) color[c] += basis[num_terms - 1] * sh[3 * (num_terms - 1) + c];
}

// The derivatives of the basis by x, y and z, as polynomials of all three: the direction need not stay a unit one.
template <int degree, class T>
inline void sh_slopes(T x, T y, T z, T* by_x, T* by_y, T* by_z) {
    by_x[0] = by_y[0] = by_z[0] = 0;
    if constexpr (degree >= 1) {
        constexpr T c = T(0.4886025119029199);
        by_x[1] = 0, by_y[1] = -c, by_z[1] = 0;
        by_x[2] = 0, by_y[2] = 0, by_z[2] = c;
        by_x[3] = -c, by_y[3] = 0, by_z[3] = 0;
    }
    if constexpr (degree >= 2) {
        constexpr T c = T(1.0925484305920792), d = T(0.31539156525252005), e = T(0.5462742152960396);
        by_x[4] = c * y, by_y[4] = c * x, by_z[4] = 0;
        by_x[5] = 0, by_y[5] = -c * z, by_z[5] = -c * y;
        by_x[6] = -2 * d * x, by_y[6] = -2 * d * y, by_z[6] = 4 * d * z;
        by_x[7] = -c * z, by_y[7] = 0, by_z[7] = -c * x;
        by_x[8] = 2 * e * x, by_y[8] = -2 * e * y, by_z[8] = 0;
        if constexpr (degree >= 3) {
            const T xx = x * x, yy = y * y, zz = z * z;
            constexpr T f = T(0.5900435899266435), g = T(2.890611442640554), h = T(0.4570457994644658);
            constexpr T i = T(0.3731763325901154), j = T(1.445305721320277);
            by_x[9] = -6 * f * x * y, by_y[9] = -3 * f * (xx - yy), by_z[9] = 0;
            by_x[10] = g * y * z, by_y[10] = g * x * z, by_z[10] = g * x * y;
            by_x[11] = 2 * h * x * y, by_y[11] = -h * (4 * zz - xx - 3 * yy), by_z[11] = -8 * h * y * z;
            by_x[12] = -6 * i * x * z, by_y[12] = -6 * i * y * z, by_z[12] = 3 * i * (2 * zz - xx - yy);
            by_x[13] = -h * (4 * zz - 3 * xx - yy), by_y[13] = 2 * h * x * y, by_z[13] = -8 * h * x * z;
            by_x[14] = 2 * j * x * z, by_y[14] = -2 * j * y * z, by_z[14] = j * (xx - yy);
            by_x[15] = -3 * f * (xx - yy), by_y[15] = 6 * f * x * y, by_z[15] = 0;
        }
    }
}

// The gradient by the coefficients from that by the color: basis x gradient, term by term. The counterpart of
// `add_terms`, in the same vectors of four.
template <int degree, class T>
inline void spread_terms(const T* basis, const T* v_color, T* v_sh) {
    constexpr int num_terms = (degree + 1) * (degree + 1);
    typedef T Quad __attribute__((vector_size(4 * sizeof(T))));
    const T r = v_color[0], g = v_color[1], b = v_color[2];
    const Quad first{r, g, b, r}, second{g, b, r, g}, third{b, r, g, b};
    for (int k = 0; k + 4 <= num_terms; k += 4) {
        const Quad weights{basis[k], basis[k + 1], basis[k + 2], basis[k + 3]};
        // One by one: an array of three would be copied in other pieces than it was written in, and wait.
        Quad part = first * __builtin_shufflevector(weights, weights, 0, 0, 0, 1);
        __builtin_memcpy(v_sh + 3 * k, &part, sizeof part);
        part = second * __builtin_shufflevector(weights, weights, 1, 1, 2, 2);
        __builtin_memcpy(v_sh + 3 * k + 4, &part, sizeof part);
        part = third * __builtin_shufflevector(weights, weights, 2, 3, 3, 3);
        __builtin_memcpy(v_sh + 3 * k + 8, &part, sizeof part);
    }
    if constexpr (num_terms % 4 == 1)
        for (int c = 0; c < 3; ++c) v_sh[3 * (num_terms - 1) + c] = basis[num_terms - 1] * v_color[c];
}

}  // namespace brushgs::BRUSHGS_ISA
