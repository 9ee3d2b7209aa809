// The arithmetic of `project`: geometry in double for either scalar, colour in the scalar of the arrays.
//
// Source: Zwicker et al. 2002, EWA Splatting, for the local affine projection; Kerbl et al. 2023 for the
// low-pass, the clamp of the Jacobian and the spherical harmonics.
//
// Compiled once per instruction set (see CMakeLists.txt): nothing here may have external linkage but the
// functions at the end. Loops over `kBlock` lanes hold no branch and no library call, so that the compiler
// turns them into vector code.
#include "brushgs/project_kernel.hpp"

#include "brushgs/blending.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr std::size_t kBlock = 64;      // Gaussians at a time: their columns stay in the first-level cache
constexpr std::size_t kRowsAhead = 32;  // of coefficients, asked for early: they are most of what is read

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kQuarterPi = 0.78539816339744830962;
constexpr double kTanEighthPi = 0.41421356237309504880;

// A direction is known to some units in the last place of the largest product it came from. What lies under
// this is noise: such ellipses are round, such angles horizontal or vertical.
constexpr double kDirectionNoise = 1e-14;

// The Jacobian is taken at most this factor outside the field of view: beyond it the affine approximation
// makes strokes at the rim of the view explode. The value is the one the scenes were trained with.
constexpr double kClamp = 1.3;


// Largest value that a column of the boxes can hold.
template <class T>
constexpr double kLargest = sizeof(T) == 4 ? 3.4028234663852886e38 : 1.7976931348623157e308;

// What becomes of a Gaussian; as doubles, so that they are selected in the lanes beside the geometry.
constexpr double kKept = 0, kBehindNear = 1, kNotFinite = 2, kFaint = 3, kOutside = 4;
constexpr std::size_t kNumFates = 5;

// One value per Gaussian of a block, structure of arrays.
using Lanes = double[kBlock];

struct alignas(64) Block {
    Lanes mean[3], quat[4], scale[3], opacity;                           // read
    Lanes center[2], half_extents[2], angle, depth, direction[3], fate;  // made; directions from the camera
};

inline std::size_t index(double fate) { return static_cast<std::size_t>(fate); }
inline double absolute(double x) { return x < 0 ? -x : x; }
inline double clamped(double x, double limit) { return x < -limit ? -limit : (x > limit ? limit : x); }
inline double larger(double x, double y) { return x > y ? x : y; }

// atan on [0, 1] to 2e-16: a half-angle step into [-tan(pi/8), tan(pi/8)], there the Chebyshev interpolant
// of atan(sqrt(z)) / sqrt(z) in z (error 7e-17).
inline double arctangent(double t) {
    const bool is_large = t > kTanEighthPi;
    const double x = is_large ? (t - 1) / (t + 1) : t;
    const double z = x * x;
    double sum = 0.021135373157693222;
    sum = sum * z - 0.0434805221571646;
    sum = sum * z + 0.05688349226809009;
    sum = sum * z - 0.06640233930429408;
    sum = sum * z + 0.07689953496306857;
    sum = sum * z - 0.09090773074808414;
    sum = sum * z + 0.11111106180455946;
    sum = sum * z - 0.14285714180976467;
    sum = sum * z + 0.1999999999885511;
    sum = sum * z - 0.3333333333332844;
    sum = sum * z + 1.0;
    return (is_large ? kQuarterPi : 0.0) + x * sum;
}

template <class T>
void load(const GaussianColumns<T>& gaussians, std::size_t first, std::size_t count, Block& block) {
    const T* mean = gaussians.means + 3 * first;
    const T* quat = gaussians.quats + 4 * first;
    const T* scale = gaussians.scales + 3 * first;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 3; ++k) block.mean[k][i] = mean[3 * i + k];
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 4; ++k) block.quat[k][i] = quat[4 * i + k];
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 3; ++k) block.scale[k][i] = scale[3 * i + k];
    for (std::size_t i = 0; i < count; ++i) block.opacity[i] = gaussians.opacities[first + i];
}

// The own axes of a Gaussian, columns of its rotation; the quaternion, stored as T, has any length above zero.
template <class T>
inline void own_axes(double qw, double qx, double qy, double qz, double axes[3][3]) {
    if constexpr (sizeof(T) == sizeof(double)) {  // squares of float quaternions cannot leave the range
        const double longest =
            larger(larger(absolute(qw), absolute(qx)), larger(absolute(qy), absolute(qz)));
        qw /= longest, qx /= longest, qy /= longest, qz /= longest;
    }
    const double s = 2 / (qw * qw + qx * qx + qy * qy + qz * qz);
    axes[0][0] = 1 - s * (qy * qy + qz * qz);
    axes[0][1] = s * (qx * qy + qw * qz);
    axes[0][2] = s * (qx * qz - qw * qy);
    axes[1][0] = s * (qx * qy - qw * qz);
    axes[1][1] = 1 - s * (qx * qx + qz * qz);
    axes[1][2] = s * (qy * qz + qw * qx);
    axes[2][0] = s * (qx * qz + qw * qy);
    axes[2][1] = s * (qy * qz - qw * qx);
    axes[2][2] = 1 - s * (qx * qx + qy * qy);
}

struct Direction {
    double cosine, sine, angle;
};

// The major axis of the covariance (a, b; b, c), theta = 1/2 atan2(2 b, a - c), in (-pi/2, pi/2]: atan(t)
// where a >= c, else a quarter turn less that, with the sign of b. `spread` is hypot(a - c, 2 b), `sum` a + c.
inline Direction major_axis(double difference, double twice_b, double spread, double sum) {
    const double least_spread = kDirectionNoise * sum;
    const double lean = spread > least_spread ? difference : 0.0;
    const double tangent = absolute(twice_b) / (spread + absolute(difference));
    double t = spread > least_spread ? tangent : 0.0;
    t = t > kDirectionNoise ? t : 0.0;
    const double large = 1 / __builtin_sqrt(1 + t * t), small = t * large, turn = arctangent(t);
    const bool is_steep = lean < 0;
    const double signed_one = twice_b < 0 ? -1.0 : 1.0;
    const double sign = t > 0 ? signed_one : 1.0;
    const double sine = is_steep ? large : small, angle = is_steep ? kHalfPi - turn : turn;
    return {is_steep ? small : large, sign * sine, sign * angle};
}

// Fills the second half of `block` from the first, for Gaussians whose boxes are stored as T.
template <class T>
void place(const ProjectParams& params, Block& block) {
    const ProjectParams p = params;  // a local copy cannot overlap the lanes: that frees the vectoriser
    const double* w = p.viewmat;
    double eye[3];  // camera centre in the world, -R^T t
    for (int k = 0; k < 3; ++k) eye[k] = -(w[k] * w[3] + w[4 + k] * w[7] + w[8 + k] * w[11]);
    const double limit_x = kClamp * 0.5 * p.width / p.fx, limit_y = kClamp * 0.5 * p.height / p.fy;
    for (std::size_t i = 0; i < kBlock; ++i) {
        const double x = block.mean[0][i], y = block.mean[1][i], z = block.mean[2][i];
        const double depth = w[8] * x + w[9] * y + w[10] * z + w[11];
        const double inverse_depth = 1 / depth;
        const double ratio_x = (w[0] * x + w[1] * y + w[2] * z + w[3]) * inverse_depth;
        const double ratio_y = (w[4] * x + w[5] * y + w[6] * z + w[7]) * inverse_depth;
        const double center_x = p.fx * ratio_x + p.cx, center_y = p.fy * ratio_y + p.cy;

        // J W, the rows of the projection at the clamped point, before the division by depth.
        const double at_x = clamped(ratio_x, limit_x), at_y = clamped(ratio_y, limit_y);
        const double jx[3] = {w[0] - at_x * w[8], w[1] - at_x * w[9], w[2] - at_x * w[10]};
        const double jy[3] = {w[4] - at_y * w[8], w[5] - at_y * w[9], w[6] - at_y * w[10]};

        // M = J W R S, pixels per standard deviation. M M^T enters only as a - c and 2 b.
        double axes[3][3], mx[3], my[3], sum = 0, difference = 0, twice_b = 0;
        own_axes<T>(block.quat[0][i], block.quat[1][i], block.quat[2][i], block.quat[3][i], axes);
        for (int k = 0; k < 3; ++k) {
            const double* axis = axes[k];
            const double scale = block.scale[k][i] * inverse_depth;
            mx[k] = p.fx * scale * (jx[0] * axis[0] + jx[1] * axis[1] + jx[2] * axis[2]);
            my[k] = p.fy * scale * (jy[0] * axis[0] + jy[1] * axis[1] + jy[2] * axis[2]);
            sum += mx[k] * mx[k] + my[k] * my[k];
            difference += (mx[k] - my[k]) * (mx[k] + my[k]);
            twice_b += 2 * mx[k] * my[k];
        }
        const double spread = __builtin_sqrt(difference * difference + twice_b * twice_b);
        const Direction u = major_axis(difference, twice_b, spread, sum);

        // |w^T M| along each axis keeps its digits for needles, where the small root of the covariance's
        // characteristic equation is a difference of large numbers.
        double major = p.low_pass, minor = p.low_pass;
        for (int k = 0; k < 3; ++k) {
            const double along = u.cosine * mx[k] + u.sine * my[k];
            const double across = u.cosine * my[k] - u.sine * mx[k];
            major += along * along;
            minor += across * across;
        }
        const double half_u = p.num_sigmas * __builtin_sqrt(major);
        const double half_v = p.num_sigmas * __builtin_sqrt(minor);

        // Outside: the upright rectangle around the box and the image have no area in common.
        const double reach_x = u.cosine * half_u + absolute(u.sine) * half_v;
        const double reach_y = absolute(u.sine) * half_u + u.cosine * half_v;
        double fate = kKept;
        fate = center_x + reach_x > 0 ? fate : kOutside;
        fate = center_y + reach_y > 0 ? fate : kOutside;
        fate = center_x - reach_x < p.width ? fate : kOutside;
        fate = center_y - reach_y < p.height ? fate : kOutside;
        fate = half_u > 0 ? fate : kOutside;
        fate = half_v > 0 ? fate : kOutside;
        fate = block.opacity[i] < kMinAlpha ? kFaint : fate;
        const double largest = absolute(center_x) + absolute(center_y) + half_u + half_v + depth;
        fate = largest <= kLargest<T> ? fate : kNotFinite;
        fate = spread <= kLargest<double> ? fate : kNotFinite;
        fate = depth <= p.near ? kBehindNear : fate;

        const double dx = x - eye[0], dy = y - eye[1], dz = z - eye[2];
        const double inverse_distance = 1 / __builtin_sqrt(dx * dx + dy * dy + dz * dz);
        block.direction[0][i] = dx * inverse_distance;
        block.direction[1][i] = dy * inverse_distance;
        block.direction[2][i] = dz * inverse_distance;
        block.center[0][i] = center_x;
        block.center[1][i] = center_y;
        block.half_extents[0][i] = half_u;
        block.half_extents[1][i] = half_v;
        block.angle[i] = u.angle;
        block.depth[i] = depth;
        block.fate[i] = fate;
    }
}

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

// Sum over terms of basis x coefficient. Four terms of three channels are twelve numbers in a row: three
// vectors of four, whose sums are sorted by channel at the end.
template <int degree, class T>
inline void add_terms(const T* sh, const T* basis, T* color) {
    constexpr int num_terms = (degree + 1) * (degree + 1);
    typedef T Quad __attribute__((vector_size(4 * sizeof(T))));
    typedef decltype(Quad{} < Quad{}) Order;
    Quad first{}, second{}, third{};
    for (int k = 0; k + 4 <= num_terms; k += 4) {
        Quad weights, terms;
        __builtin_memcpy(&weights, basis + k, sizeof weights);
        __builtin_memcpy(&terms, sh + 3 * k, sizeof terms);
        first += terms * __builtin_shuffle(weights, Order{0, 0, 0, 1});
        __builtin_memcpy(&terms, sh + 3 * k + 4, sizeof terms);
        second += terms * __builtin_shuffle(weights, Order{1, 1, 2, 2});
        __builtin_memcpy(&terms, sh + 3 * k + 8, sizeof terms);
        third += terms * __builtin_shuffle(weights, Order{2, 3, 3, 3});
    }
    color[0] = (first[0] + first[3]) + (second[2] + third[1]);
    color[1] = (first[1] + second[0]) + (second[3] + third[2]);
    color[2] = (first[2] + second[1]) + (third[0] + third[3]);
    if constexpr (num_terms % 4 == 1)
        for (int c = 0; c < 3; ++c) color[c] += basis[num_terms - 1] * sh[3 * (num_terms - 1) + c];
}

// Lists the lanes under `count` that are kept, counts what becomes of all, and returns how many are kept.
inline std::size_t choose(const Block& block, std::size_t count, std::size_t* lanes, std::size_t* fates) {
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        lanes[num_kept] = i;
        num_kept += block.fate[i] == kKept;
        ++fates[index(block.fate[i])];
    }
    return num_kept;
}

// The fields of lane `i` but the colour, rounded to T.
template <class T>
inline void fill(const Block& block, std::size_t i, std::size_t row, BoxRecord<T>& box) {
    for (int k = 0; k < 2; ++k) box.center[k] = static_cast<T>(block.center[k][i]);
    for (int k = 0; k < 2; ++k) box.half_extents[k] = static_cast<T>(block.half_extents[k][i]);
    // Rounding may reach -pi/2, which is the same line as +pi/2, the one in the range.
    const T angle = static_cast<T>(block.angle[i]);
    box.angle = angle <= -static_cast<T>(kHalfPi) ? static_cast<T>(kHalfPi) : angle;
    box.depth = static_cast<T>(block.depth[i]);
    box.opacity = static_cast<T>(block.opacity[i]);
    box.id = static_cast<std::int32_t>(row);
}

// Writes the boxes of the block that are kept to `boxes`; returns how many.
template <int degree, class T>
std::size_t store(const GaussianColumns<T>& gaussians, std::size_t first, std::size_t count,
                  const Block& block, BoxRecord<T>* boxes, std::size_t* fates) {
    constexpr std::size_t row_values = 3 * (degree + 1) * (degree + 1), line = 64 / sizeof(T);
    const T* sh = gaussians.sh + 3 * gaussians.sh_terms * first;
    const std::size_t sh_stride = 3 * gaussians.sh_terms;
    std::size_t lanes[kBlock];
    const std::size_t num_kept = choose(block, count, lanes, fates);

    constexpr std::size_t stride = degree == 0 ? 1 : (degree == 1 ? 4 : 16);
    alignas(64) T basis[kBlock * stride];
    for (std::size_t i = 0; i < kBlock; ++i)
        sh_basis<degree>(static_cast<T>(block.direction[0][i]), static_cast<T>(block.direction[1][i]),
                         static_cast<T>(block.direction[2][i]), basis + stride * i);

    std::size_t num_boxes = 0;
    for (std::size_t j = 0; j < num_kept; ++j) {
        const std::size_t i = lanes[j];
        // A guess: where this row is kept, those a little further mostly are.
        const T* ahead = sh + sh_stride * (i + kRowsAhead);
        for (std::size_t k = 0; k < row_values; k += line) __builtin_prefetch(ahead + k);
        T color[3];
        add_terms<degree>(sh + sh_stride * i, basis + stride * i, color);
        for (int c = 0; c < 3; ++c) color[c] += T(0.5);
        if (!(absolute(color[0]) + absolute(color[1]) + absolute(color[2]) <= kLargest<T>)) {
            --fates[index(kKept)], ++fates[index(kNotFinite)];
            continue;
        }
        BoxRecord<T>& box = boxes[num_boxes++];
        for (int c = 0; c < 3; ++c) box.color[c] = color[c] > 0 ? color[c] : 0;
        fill(block, i, first + i, box);
    }
    return num_boxes;
}

template <int degree, class T>
std::size_t run(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin,
                std::size_t end, BoxRecord<T>* boxes, ProjectCounts& culled) {
    std::size_t num_boxes = 0, fates[kNumFates] = {};
    Block block{};
    for (std::size_t first = begin; first < end; first += kBlock) {
        const std::size_t count = end - first < kBlock ? end - first : kBlock;
        load(gaussians, first, count, block);
        place<T>(params, block);
        num_boxes += store<degree>(gaussians, first, count, block, boxes + num_boxes, fates);
    }
    culled.behind_near += fates[index(kBehindNear)];
    culled.not_finite += fates[index(kNotFinite)];
    culled.faint += fates[index(kFaint)];
    culled.outside += fates[index(kOutside)];
    return num_boxes;
}

template <class T>
std::size_t run(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin,
                std::size_t end, BoxRecord<T>* boxes, ProjectCounts& culled) {
    switch (params.sh_degree) {
        case 0: return run<0>(gaussians, params, begin, end, boxes, culled);
        case 1: return run<1>(gaussians, params, begin, end, boxes, culled);
        case 2: return run<2>(gaussians, params, begin, end, boxes, culled);
        default: return run<3>(gaussians, params, begin, end, boxes, culled);
    }
}

}  // namespace

std::size_t project_rows(const GaussianColumns<float>& gaussians, const ProjectParams& params,
                         std::size_t begin, std::size_t end, BoxRecord<float>* boxes, ProjectCounts& culled) {
    return run(gaussians, params, begin, end, boxes, culled);
}

std::size_t project_rows(const GaussianColumns<double>& gaussians, const ProjectParams& params,
                         std::size_t begin, std::size_t end, BoxRecord<double>* boxes, ProjectCounts& culled) {
    return run(gaussians, params, begin, end, boxes, culled);
}

}  // namespace brushgs::BRUSHGS_ISA
