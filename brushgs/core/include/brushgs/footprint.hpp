// The ellipse of a Gaussian on the image plane, in double for either scalar: arithmetic common to projection and
// tracking.
//
// Source: Zwicker et al. 2002, EWA Splatting, for the local affine projection; Kerbl et al. 2023 for the
// low-pass and the clamp of the Jacobian.
//
// Everything here is inlined into loops over the lanes of a block, without branches and library calls, so that the
// compiler can vectorise them.
#pragma once

#include <cstddef>

#include "brushgs/project.hpp"

namespace brushgs::BRUSHGS_ISA {

constexpr std::size_t kBlock = 64;  // Gaussians at a time: their columns stay in the first-level cache

constexpr double kPi = 3.14159265358979323846;
constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kQuarterPi = 0.78539816339744830962;
constexpr double kTanEighthPi = 0.41421356237309504880;

// The precision of a direction is some units in the last place of the largest product in it. Smaller values are noise:
// such ellipses are round, such angles horizontal or vertical.
constexpr double kDirectionNoise = 1e-14;

// The Jacobian is taken at most this factor outside the field of view: beyond it the affine approximation
// makes strokes at the rim of the view explode. The value is the one the scenes were trained with.
constexpr double kClamp = 1.3;

// One value per Gaussian of a block, structure of arrays.
using BlockLane = double[kBlock];

// Fills the lanes `mean` [3], `quat` [4], `scale` [3] and `opacity` of a block.
template <class T, class Block>
inline void load(const GaussianColumns<T>& gaussians, std::size_t first, std::size_t count, Block& block) {
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

[[gnu::always_inline]] static inline double absolute(double x) { return x < 0 ? -x : x; }
[[gnu::always_inline]] static inline double larger(double x, double y) { return x > y ? x : y; }
[[gnu::always_inline]] static inline double clamped(double x, double limit) {
    return x < -limit ? -limit : (x > limit ? limit : x);
}

// atan on [0, 1] to 2e-16: a half-angle step into [-tan(pi/8), tan(pi/8)], there the Chebyshev interpolant
// of atan(sqrt(z)) / sqrt(z) in z (error 7e-17).
[[gnu::always_inline]] static inline double arctangent(double t) {
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

// The angle of a unit vector, in (-pi, pi].
[[gnu::always_inline]] static inline double angle_of(double cosine, double sine) {
    const double across = absolute(cosine), along = absolute(sine);
    const bool is_steep = along > across;
    const double turn = arctangent(is_steep ? across / along : along / across);
    const double sharp = is_steep ? kHalfPi - turn : turn;
    const double angle = cosine < 0 ? kPi - sharp : sharp;
    return sine < 0 ? -angle : angle;
}

// The own axes of a Gaussian, columns of its rotation; the quaternion, stored as T, has any length above zero.
template <class T>
[[gnu::always_inline]] static inline void own_axes(double qw, double qx, double qy, double qz, double axes[3][3]) {
    if constexpr (sizeof(T) == sizeof(double)) {  // squares of float quaternions cannot leave the range
        const double longest = larger(larger(absolute(qw), absolute(qx)), larger(absolute(qy), absolute(qz)));
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
[[gnu::always_inline]] static inline Direction major_axis(double difference, double twice_b, double spread,
                                                          double sum) {
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

// Data common to all Gaussians of a view.
struct ViewFrame {
    double w[12];             // camera from world, the first three rows
    double fx, fy, cx, cy;    // pixels
    double limit_x, limit_y;  // of x / z and y / z, where the Jacobian is taken
    double eye[3];            // camera center in the world
};

[[gnu::always_inline]] static inline ViewFrame view_frame(const View& view) {
    ViewFrame frame{};
    for (int k = 0; k < 12; ++k) frame.w[k] = view.viewmat[k];
    frame.fx = view.fx, frame.fy = view.fy, frame.cx = view.cx, frame.cy = view.cy;
    frame.limit_x = kClamp * 0.5 * view.width / view.fx;
    frame.limit_y = kClamp * 0.5 * view.height / view.fy;
    const double* w = frame.w;  // the center is -R^T t
    for (int k = 0; k < 3; ++k) frame.eye[k] = -(w[k] * w[3] + w[4 + k] * w[7] + w[8 + k] * w[11]);
    return frame;
}

// A Gaussian on the image plane. M = J W R S [2, 3], pixels per standard deviation; the covariance M M^T
// enters only as a + c, a - c and 2 b. Not yet with the low-pass.
struct Footprint {
    double depth, center_x, center_y;
    double unit;              // of the world at that depth, pixels along the longer side of one
    double ratio_x, ratio_y;  // x / z and y / z in the camera
    double mx[3], my[3];
    double sum, difference, twice_b, spread;
};

[[gnu::always_inline]] static inline Footprint footprint_of(const ViewFrame& view, double x, double y, double z,
                                                            const double axes[3][3], const double scales[3]) {
    const double* w = view.w;
    Footprint f;
    f.depth = w[8] * x + w[9] * y + w[10] * z + w[11];
    const double inverse_depth = 1 / f.depth;
    f.ratio_x = (w[0] * x + w[1] * y + w[2] * z + w[3]) * inverse_depth;
    f.ratio_y = (w[4] * x + w[5] * y + w[6] * z + w[7]) * inverse_depth;
    f.unit = larger(view.fx, view.fy) * inverse_depth;
    f.center_x = view.fx * f.ratio_x + view.cx, f.center_y = view.fy * f.ratio_y + view.cy;

    // J W, the rows of the projection at the clamped point, before the division by depth.
    const double at_x = clamped(f.ratio_x, view.limit_x), at_y = clamped(f.ratio_y, view.limit_y);
    const double jx[3] = {w[0] - at_x * w[8], w[1] - at_x * w[9], w[2] - at_x * w[10]};
    const double jy[3] = {w[4] - at_y * w[8], w[5] - at_y * w[9], w[6] - at_y * w[10]};

    f.sum = 0, f.difference = 0, f.twice_b = 0;
    for (int k = 0; k < 3; ++k) {
        const double* axis = axes[k];
        const double scale = scales[k] * inverse_depth;
        f.mx[k] = view.fx * scale * (jx[0] * axis[0] + jx[1] * axis[1] + jx[2] * axis[2]);
        f.my[k] = view.fy * scale * (jy[0] * axis[0] + jy[1] * axis[1] + jy[2] * axis[2]);
        f.sum += f.mx[k] * f.mx[k] + f.my[k] * f.my[k];
        f.difference += (f.mx[k] - f.my[k]) * (f.mx[k] + f.my[k]);
        f.twice_b += 2 * f.mx[k] * f.my[k];
    }
    f.spread = __builtin_sqrt(f.difference * f.difference + f.twice_b * f.twice_b);
    return f;
}

struct Variances {
    double along, across;
};

// Variances along a direction (cosine, sine) and across it. |w^T M| keeps its digits for needles, where the
// small root of the covariance's characteristic equation is a difference of large numbers.
[[gnu::always_inline]] static inline Variances variances(const Footprint& f, double cosine, double sine,
                                                         double low_pass) {
    Variances result{low_pass, low_pass};
    for (int k = 0; k < 3; ++k) {
        const double along = cosine * f.mx[k] + sine * f.my[k];
        const double across = cosine * f.my[k] - sine * f.mx[k];
        result.along += along * along;
        result.across += across * across;
    }
    return result;
}

// The projection of the longest axis, pixels; of equally long axes the first. Signed, and fixed in the scene.
struct LongestAxis {
    double x, y;     // its column of M
    double length;   // of that column if the axis lay across the view, pixels: rounding in x and y is relative to it
    double axis[3];  // unit vector in the world
    double which;    // 0, 1 or 2
};

[[gnu::always_inline]] static inline LongestAxis longest_axis(const Footprint& f, const double axes[3][3],
                                                              const double scales[3]) {
    LongestAxis longest{f.mx[0], f.my[0], 0, {axes[0][0], axes[0][1], axes[0][2]}, 0};
    double scale = scales[0];
    for (int k = 1; k < 3; ++k) {
        const bool is_longer = scales[k] > scale;
        scale = is_longer ? scales[k] : scale;
        longest.which = is_longer ? k : longest.which;
        longest.x = is_longer ? f.mx[k] : longest.x;
        longest.y = is_longer ? f.my[k] : longest.y;
        for (int c = 0; c < 3; ++c) longest.axis[c] = is_longer ? axes[k][c] : longest.axis[c];
    }
    longest.length = scale * f.unit;
    return longest;
}

}  // namespace brushgs::BRUSHGS_ISA
