// The arithmetic of `project_backward`: geometry in double for either scalar, color in the scalar of the arrays.
//
// A loop over the lanes of a block repeats `place` of project_kernel.cpp forward, with the same functions, and
// differentiates it backward step by step. `v_name` is the gradient of the loss by `name`. Compiled once per
// instruction set (see CMakeLists.txt): the loop holds no branch and no library call, so that the compiler turns it
// into vector code.
#include "brushgs/project_backward.hpp"

#include "brushgs/footprint.hpp"
#include "brushgs/placing.hpp"
#include "brushgs/sh.hpp"
#include "brushgs/trig.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

struct alignas(64) Block {
    BlockLane mean[3], quat[4], scale[3], opacity, given_direction, area_scale;          // read
    BlockLane v_center[2], v_half_extents[2], v_angle, v_depth, v_visible, v_toward[3];  // read
    BlockLane num_sigmas;                                                                // read
    BlockLane toward[3];                                                                 // made first
    BlockLane v_mean[3], v_quat[4], v_scale[3], v_opacity;                               // made
};

// The data of a block: Gaussians with a box, and those boxes.
struct Places {
    std::size_t count = 0;
    std::size_t rows[kBlock], boxes[kBlock];
};

// Fills lanes with some rows of a column, `width` values each; with zeros if there is no column.
template <class T>
inline void load_rows(const T* values, std::size_t width, const std::size_t* rows, std::size_t count,
                      BlockLane* lanes) {
    if (values == nullptr) {
        __builtin_memset(lanes, 0, width * sizeof *lanes);
        return;
    }
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < width; ++k) lanes[k][i] = static_cast<double>(values[width * rows[i] + k]);
}

template <class T>
inline void store_rows(const BlockLane* lanes, std::size_t width, const std::size_t* rows, std::size_t count,
                       T* values) {
    if (values == nullptr) return;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < width; ++k) values[width * rows[i] + k] = static_cast<T>(lanes[k][i]);
}

template <class T>
inline void clear_row(T* values, std::size_t width, std::size_t row) {
    if (values != nullptr) __builtin_memset(values + width * row, 0, width * sizeof *values);
}

template <class T>
inline void load(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                 const Places& places, Block& block) {
    const std::size_t count = places.count;
    const std::size_t* const rows = places.rows;
    load_rows(gaussians.means, 3, rows, count, block.mean);
    load_rows(gaussians.quats, 4, rows, count, block.quat);
    load_rows(gaussians.scales, 3, rows, count, block.scale);
    load_rows(gaussians.opacities, 1, rows, count, &block.opacity);
    if (params.sigmas_of_row != nullptr) load_rows(params.sigmas_of_row, 1, rows, count, &block.num_sigmas);
    if (params.lock == Lock::given) {
        for (std::size_t i = 0; i < count; ++i) {
            block.given_direction[i] = within_reach(static_cast<double>(params.directions[rows[i]]));
            block.area_scale[i] =
                params.area_scales == nullptr ? 1.0 : static_cast<double>(params.area_scales[rows[i]]);
        }
    }
    load_rows(boxes.v_centers, 2, places.boxes, count, block.v_center);
    load_rows(boxes.v_half_extents, 2, places.boxes, count, block.v_half_extents);
    load_rows(boxes.v_angles, 1, places.boxes, count, &block.v_angle);
    load_rows(boxes.v_depths, 1, places.boxes, count, &block.v_depth);
    load_rows(boxes.v_opacities, 1, places.boxes, count, &block.v_visible);
}

// Unit vectors from the camera to the Gaussians.
inline void find_directions(const ViewFrame& view, Block& block) {
    for (std::size_t i = 0; i < kBlock; ++i) {
        const double dx = block.mean[0][i] - view.eye[0], dy = block.mean[1][i] - view.eye[1],
                     dz = block.mean[2][i] - view.eye[2];
        const double inverse = 1 / __builtin_sqrt(dx * dx + dy * dy + dz * dz);
        block.toward[0][i] = dx * inverse, block.toward[1][i] = dy * inverse, block.toward[2][i] = dz * inverse;
    }
}

// Gradients by the columns of M = J W R S.
struct FactorGradient {
    double mx[3], my[3];
};

// Back through `variances`, at a fixed direction.
[[gnu::always_inline]] inline void add_variances(const Footprint& f, double cosine, double sine, double v_along,
                                                 double v_across, FactorGradient& v) {
    for (int k = 0; k < 3; ++k) {
        const double along = 2 * v_along * (cosine * f.mx[k] + sine * f.my[k]);
        const double across = 2 * v_across * (cosine * f.my[k] - sine * f.mx[k]);
        v.mx[k] += cosine * along - sine * across;
        v.my[k] += sine * along + cosine * across;
    }
}

// The covariance between a direction and its perpendicular: half the derivative of the variance by the angle.
[[gnu::always_inline]] inline double covariance(const Footprint& f, double cosine, double sine) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += (cosine * f.mx[k] + sine * f.my[k]) * (cosine * f.my[k] - sine * f.mx[k]);
    return sum;
}

// Back through the angle of `major_axis`; a round ellipse has no gradient.
[[gnu::always_inline]] inline void add_major_axis(const Footprint& f, double v_angle, FactorGradient& v) {
    const double weight = f.spread > kDirectionNoise * f.sum ? 0.5 * v_angle : 0.0;
    const double unit_difference = f.difference / f.spread, unit_twice_b = f.twice_b / f.spread;
    const double scale = f.spread > 0 ? weight / f.spread : 0.0;
    const double v_twice_b = scale > 0 || scale < 0 ? scale * unit_difference : 0.0;
    const double v_difference = scale > 0 || scale < 0 ? -scale * unit_twice_b : 0.0;
    for (int k = 0; k < 3; ++k) {
        v.mx[k] += 2 * (f.mx[k] * v_difference + f.my[k] * v_twice_b);
        v.my[k] += 2 * (f.mx[k] * v_twice_b - f.my[k] * v_difference);
    }
}

// Back through `own_axes`: from V, v_axes[column][row], to the quaternion of any length.
[[gnu::always_inline]] inline void quat_gradient(const double quat[4], const double v_axes[3][3], double v_quat[4]) {
    const double longest =
        larger(larger(absolute(quat[0]), absolute(quat[1])), larger(absolute(quat[2]), absolute(quat[3])));
    double w = quat[0] / longest, x = quat[1] / longest, y = quat[2] / longest, z = quat[3] / longest;
    const double length = __builtin_sqrt(w * w + x * x + y * y + z * z), inverse = 1 / length;
    w *= inverse, x *= inverse, y *= inverse, z *= inverse;
    const auto v = [&](int row, int column) { return v_axes[column][row]; };
    const double by_w = 2 * (x * (v(2, 1) - v(1, 2)) + y * (v(0, 2) - v(2, 0)) + z * (v(1, 0) - v(0, 1)));
    const double by_x =
        2 * (w * (v(2, 1) - v(1, 2)) + y * (v(0, 1) + v(1, 0)) + z * (v(0, 2) + v(2, 0)) - 2 * x * (v(1, 1) + v(2, 2)));
    const double by_y =
        2 * (w * (v(0, 2) - v(2, 0)) + x * (v(0, 1) + v(1, 0)) + z * (v(1, 2) + v(2, 1)) - 2 * y * (v(0, 0) + v(2, 2)));
    const double by_z =
        2 * (w * (v(1, 0) - v(0, 1)) + x * (v(0, 2) + v(2, 0)) + y * (v(1, 2) + v(2, 1)) - 2 * z * (v(0, 0) + v(1, 1)));
    const double along = w * by_w + x * by_x + y * by_y + z * by_z;  // its length does not turn it
    const double scale = inverse / longest;
    v_quat[0] = (by_w - along * w) * scale;
    v_quat[1] = (by_x - along * x) * scale;
    v_quat[2] = (by_y - along * y) * scale;
    v_quat[3] = (by_z - along * z) * scale;
}

// Back through the factor of the low-pass on the opacity.
[[gnu::always_inline]] inline void add_compensation(const Footprint& f, const Compensation& c, double low_pass,
                                                    double v_share, FactorGradient& v) {
    const double slope = low_pass > 0 ? v_share * low_pass / (c.grown * __builtin_sqrt(c.grown)) : 0.0;
    const double v_area = slope * (f.sum + low_pass), v_sum = -0.5 * slope * c.area;
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3, last = (k + 2) % 3;
        v.mx[k] += 2 * v_sum * f.mx[k] + v_area * (f.my[next] * c.normal[last] - f.my[last] * c.normal[next]);
        v.my[k] += 2 * v_sum * f.my[k] + v_area * (c.normal[next] * f.mx[last] - c.normal[last] * f.mx[next]);
    }
}

template <class T, Lock lock, bool antialiased>
void turn_back(const ProjectParams& params, Block& block) {
    const ProjectParams p = params;  // local copies cannot overlap the lanes: that frees the vectoriser
    const View camera = params.view;
    const ViewFrame view = view_frame(camera);
    const double* w = view.w;
    const double fades = p.fades ? 1 : 0;  // as a double it is compared in the lanes
    for (std::size_t i = 0; i < kBlock; ++i) {
        // Forward, as `place` does.
        const double x = block.mean[0][i], y = block.mean[1][i], z = block.mean[2][i];
        const double quat[4] = {block.quat[0][i], block.quat[1][i], block.quat[2][i], block.quat[3][i]};
        double axes[3][3];
        own_axes<T>(quat[0], quat[1], quat[2], quat[3], axes);
        const double scales[3] = {block.scale[0][i], block.scale[1][i], block.scale[2][i]};
        const Footprint f = footprint_of(view, x, y, z, axes, scales);
        const double toward[3] = {block.toward[0][i], block.toward[1][i], block.toward[2][i]};
        const Direction major = major_axis(f.difference, f.twice_b, f.spread, f.sum);
        const Variances smallest = variances(f, major.cosine, major.sine, p.low_pass);
        Direction u = major;
        Variances bare = smallest;  // in the direction of the box
        double ratio = 1, area_factor = 1;
        LongestAxis longest{};
        Anchored anchor{};
        if constexpr (lock == Lock::anchor) {
            longest = longest_axis(f, axes, scales);
            anchor = anchored(major, smallest, longest, toward);
            u = anchor.direction;
            bare = variances(f, u.cosine, u.sine, p.low_pass);
        }
        if constexpr (lock == Lock::given) {
            const SinCos given = sincos_of(block.given_direction[i]);
            u = {given.cos, given.sin, block.given_direction[i]};
            bare = variances(f, u.cosine, u.sine, p.low_pass);
            ratio = __builtin_sqrt(smallest.along * smallest.across / (bare.along * bare.across));
            const double growth = block.area_scale[i] * ratio;
            area_factor = growth > 1 ? growth : 1;
        }
        const double thinness = ratio / area_factor;
        const double half_u = block.num_sigmas[i] * __builtin_sqrt(bare.along * area_factor);
        const double half_v = block.num_sigmas[i] * __builtin_sqrt(bare.across * area_factor);
        const double fade_low_pass = antialiased ? 0 : p.low_pass;
        const Fade fade = fade_of(camera, f.depth, 4 * half_u * half_v, smallest.along, fade_low_pass);
        Compensation compensation{};
        compensation.share = 1;
        if constexpr (antialiased) compensation = compensation_of(f, p.low_pass);

        // Back through the opacity and the fade.
        const double v_visible = block.v_visible[i], opacity = block.opacity[i] * compensation.share;
        const double share = fades > 0 ? fade.share() : 1.0;
        const double v_thinness = v_visible * opacity * share;
        block.v_opacity[i] = v_visible * thinness * share * compensation.share;
        const double v_share = fades > 0 ? v_visible * opacity * thinness : 0.0;
        const double near_step = smooth_step(fade.nearness), small_step = smooth_step(fade.smallness);
        const double v_root = v_share * near_step * smooth_slope(fade.smallness) * fade.length / (kWhole - kVanished);
        double v_depth = block.v_depth[i] + v_share * smooth_slope(fade.nearness) * small_step * fade.length /
                                                ((kFadedNear - 1) * camera.near);
        const double v_half_u = block.v_half_extents[0][i] - 0.5 * v_root * fade.root / half_u;
        const double v_half_v = block.v_half_extents[1][i] - 0.5 * v_root * fade.root / half_v;
        const double length_slope = 0.5 * fade_low_pass / (smallest.along * smallest.along * fade.length);
        Variances v_smallest{v_share > 0 || v_share < 0 ? v_share * near_step * small_step * length_slope : 0.0, 0.0};

        // Back through the half extents.
        const double squared_sigmas = block.num_sigmas[i] * block.num_sigmas[i];
        Variances v_bare{0.5 * v_half_u * squared_sigmas / half_u, 0.5 * v_half_v * squared_sigmas / half_v};
        if constexpr (lock == Lock::given) {
            const double v_area_factor =
                bare.along * v_bare.along + bare.across * v_bare.across - v_thinness * thinness / area_factor;
            const double v_growth = area_factor > 1 ? v_area_factor : 0.0;
            const double v_log_ratio = 0.5 * ratio * (v_thinness / area_factor + block.area_scale[i] * v_growth);
            v_bare.along = area_factor * v_bare.along - v_log_ratio / bare.along;
            v_bare.across = area_factor * v_bare.across - v_log_ratio / bare.across;
            v_smallest.along += v_log_ratio / smallest.along;
            v_smallest.across += v_log_ratio / smallest.across;
        }

        // Back through the direction. Turning the major axis changes neither variance along it nor across.
        FactorGradient v{};
        double v_axes[3][3] = {};
        double v_toward[3] = {block.v_toward[0][i], block.v_toward[1][i], block.v_toward[2][i]};
        add_variances(f, u.cosine, u.sine, v_bare.along, v_bare.across, v);
        if constexpr (lock == Lock::off) add_major_axis(f, block.v_angle[i], v);
        if constexpr (lock == Lock::anchor) {
            const double v_turn =
                block.v_angle[i] + 2 * covariance(f, u.cosine, u.sine) * (v_bare.along - v_bare.across);
            // The direction is the major axis plus atan2(q, along), along = pull x p.
            const double squared_length = anchor.along * anchor.along + anchor.q * anchor.q;
            const double bend = anchor.seen > 0 ? v_turn / squared_length : 0.0;
            const double v_q = bend * anchor.along, v_along = -bend * anchor.q;
            const double v_p = v_along * anchor.pull, v_pull = v_along * anchor.p;
            const double v_major = v_turn + v_p * anchor.q - v_q * anchor.p;
            const double v_side = anchor.side > 0 ? v_pull * kAnchorPull * anchor.anisotropy * anchor.anisotropy : 0.0;
            const double v_anisotropy = 2 * v_pull * kAnchorPull * anchor.side * anchor.anisotropy;
            const double sum = smallest.along + smallest.across;
            v_smallest.along += 2 * v_anisotropy * smallest.across / (sum * sum);
            v_smallest.across -= 2 * v_anisotropy * smallest.along / (sum * sum);
            add_major_axis(f, v_major, v);
            const double v_x = major.cosine * v_p - major.sine * v_q, v_y = major.sine * v_p + major.cosine * v_q;
            const double v_cosine = -2 * anchor.cosine * v_side;
            for (int k = 0; k < 3; ++k) {
                const double is_longest = longest.which == k ? 1.0 : 0.0;
                v.mx[k] += is_longest * v_x;
                v.my[k] += is_longest * v_y;
                for (int c = 0; c < 3; ++c) v_axes[k][c] += is_longest * v_cosine * toward[c];
                v_toward[k] += v_cosine * longest.axis[k];
            }
        }
        add_variances(f, major.cosine, major.sine, v_smallest.along, v_smallest.across, v);
        if constexpr (antialiased)
            add_compensation(f, compensation, p.low_pass, v_visible * block.opacity[i] * thinness * share, v);

        // Back through M: mx = fx scale / depth x (jx . axis), jx = w0 - clamped(ratio) w2.
        const double inverse_depth = 1 / f.depth;
        const double at_x = clamped(f.ratio_x, view.limit_x), at_y = clamped(f.ratio_y, view.limit_y);
        const double jx[3] = {w[0] - at_x * w[8], w[1] - at_x * w[9], w[2] - at_x * w[10]};
        const double jy[3] = {w[4] - at_y * w[8], w[5] - at_y * w[9], w[6] - at_y * w[10]};
        double v_at_x = 0, v_at_y = 0, v_log_depth = 0;
        for (int k = 0; k < 3; ++k) {
            const double* axis = axes[k];
            const double v_mx = view.fx * inverse_depth * v.mx[k], v_my = view.fy * inverse_depth * v.my[k];
            block.v_scale[k][i] = v_mx * (jx[0] * axis[0] + jx[1] * axis[1] + jx[2] * axis[2]) +
                                  v_my * (jy[0] * axis[0] + jy[1] * axis[1] + jy[2] * axis[2]);
            v_log_depth -= v.mx[k] * f.mx[k] + v.my[k] * f.my[k];
            const double forward = scales[k] * (w[8] * axis[0] + w[9] * axis[1] + w[10] * axis[2]);
            v_at_x -= v_mx * forward;
            v_at_y -= v_my * forward;
            for (int c = 0; c < 3; ++c) v_axes[k][c] += scales[k] * (v_mx * jx[c] + v_my * jy[c]);
        }
        const double v_ratio_x = view.fx * block.v_center[0][i] + (at_x == f.ratio_x ? v_at_x : 0.0);
        const double v_ratio_y = view.fy * block.v_center[1][i] + (at_y == f.ratio_y ? v_at_y : 0.0);
        const double v_camera_x = v_ratio_x * inverse_depth, v_camera_y = v_ratio_y * inverse_depth;
        v_depth += (v_log_depth - v_ratio_x * f.ratio_x - v_ratio_y * f.ratio_y) * inverse_depth;

        // To the mean: from camera axes, and along the sphere of directions.
        const double dx = x - view.eye[0], dy = y - view.eye[1], dz = z - view.eye[2];
        const double inverse_distance = 1 / __builtin_sqrt(dx * dx + dy * dy + dz * dz);
        const double outward = v_toward[0] * toward[0] + v_toward[1] * toward[1] + v_toward[2] * toward[2];
        for (int c = 0; c < 3; ++c)
            block.v_mean[c][i] = w[c] * v_camera_x + w[4 + c] * v_camera_y + w[8 + c] * v_depth +
                                 (v_toward[c] - outward * toward[c]) * inverse_distance;
        double v_quat[4];
        quat_gradient(quat, v_axes, v_quat);
        for (int k = 0; k < 4; ++k) block.v_quat[k][i] = v_quat[k];
    }
}

// Gradients by the coefficients and directions, from that by the colors.
template <int degree, class T>
void shade_back(const GaussianColumns<T>& gaussians, const ProjectedBoxes<T>& boxes,
                const GaussianGradients<T>& gradients, const Places& places, Block& block) {
    constexpr std::size_t num_terms = (degree + 1) * (degree + 1);
    constexpr std::size_t ahead = 8;  // rows lie one after the other, their boxes anywhere
    const std::size_t stride = 3 * gaussians.sh_terms;
    for (std::size_t i = 0; i < places.count; ++i) {
        const std::size_t next = places.boxes[i + ahead < places.count ? i + ahead : i];
        __builtin_prefetch(boxes.colors + 3 * next);
        __builtin_prefetch(boxes.v_colors + 3 * next);
        const std::size_t box = places.boxes[i], row = places.rows[i];
        T v_color[3];
        for (std::size_t c = 0; c < 3; ++c)
            v_color[c] = boxes.colors[3 * box + c] > 0 ? boxes.v_colors[3 * box + c] : T(0);
        const T x = static_cast<T>(block.toward[0][i]), y = static_cast<T>(block.toward[1][i]),
                z = static_cast<T>(block.toward[2][i]);
        if (gradients.sh != nullptr) {
            T basis[num_terms];
            sh_basis<degree>(x, y, z, basis);
            spread_terms<degree>(basis, v_color, gradients.sh + stride * row);
        }
        if (degree == 0 || gradients.means == nullptr) continue;
        T slopes[3][num_terms];
        sh_slopes<degree>(x, y, z, slopes[0], slopes[1], slopes[2]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            T slope[3];
            add_terms<degree>(gaussians.sh + stride * row, slopes[axis], slope);
            const T sum = (slope[0] * v_color[0] + slope[1] * v_color[1]) + slope[2] * v_color[2];
            block.v_toward[axis][i] = static_cast<double>(sum);
        }
    }
}

template <class T>
void shade_back(const GaussianColumns<T>& gaussians, const ProjectParams& params, const ProjectedBoxes<T>& boxes,
                const GaussianGradients<T>& gradients, const Places& places, Block& block) {
    switch (params.sh_degree) {
        case 0:
            shade_back<0>(gaussians, boxes, gradients, places, block);
            break;
        case 1:
            shade_back<1>(gaussians, boxes, gradients, places, block);
            break;
        case 2:
            shade_back<2>(gaussians, boxes, gradients, places, block);
            break;
        default:
            shade_back<3>(gaussians, boxes, gradients, places, block);
            break;
    }
}

template <class T, Lock lock>
void turn_back(const ProjectParams& params, Block& block) {
    params.antialiased ? turn_back<T, lock, true>(params, block) : turn_back<T, lock, false>(params, block);
}

}  // namespace

template <class T>
void project_backward_rows(const GaussianColumns<T>& gaussians, const ProjectParams& params,
                           const ProjectedBoxes<T>& boxes, const std::uint32_t* box_of_row,
                           const GaussianGradients<T>& gradients, std::size_t begin, std::size_t end) {
    const bool has_shape = gradients.means != nullptr || gradients.quats != nullptr || gradients.scales != nullptr ||
                           gradients.opacities != nullptr;
    const std::size_t sh_width = 3 * gaussians.sh_terms;
    const ViewFrame view = view_frame(params.view);
    Block block{};
    for (std::size_t i = 0; i < kBlock; ++i) block.num_sigmas[i] = params.num_sigmas;
    for (std::size_t row = begin; row < end;) {
        Places places;
        for (; row < end && places.count < kBlock; ++row) {
            const std::uint32_t box = box_of_row[row];
            if (box == kNoBox || boxes.v_colors == nullptr) clear_row(gradients.sh, sh_width, row);
            if (box == kNoBox) {
                clear_row(gradients.means, 3, row);
                clear_row(gradients.quats, 4, row);
                clear_row(gradients.scales, 3, row);
                clear_row(gradients.opacities, 1, row);
                continue;
            }
            places.rows[places.count] = row;
            places.boxes[places.count++] = box;
        }
        if (places.count == 0) break;
        load(gaussians, params, boxes, places, block);
        find_directions(view, block);
        if (boxes.v_colors != nullptr && (gradients.sh != nullptr || gradients.means != nullptr))
            shade_back(gaussians, params, boxes, gradients, places, block);
        if (!has_shape) continue;
        switch (params.lock) {
            case Lock::off:
                turn_back<T, Lock::off>(params, block);
                break;
            case Lock::anchor:
                turn_back<T, Lock::anchor>(params, block);
                break;
            case Lock::given:
                turn_back<T, Lock::given>(params, block);
                break;
        }
        store_rows(block.v_mean, 3, places.rows, places.count, gradients.means);
        store_rows(block.v_quat, 4, places.rows, places.count, gradients.quats);
        store_rows(block.v_scale, 3, places.rows, places.count, gradients.scales);
        store_rows(&block.v_opacity, 1, places.rows, places.count, gradients.opacities);
    }
}

#ifdef BRUSHGS_IN_DOUBLE
template void project_backward_rows<double>(const GaussianColumns<double>&, const ProjectParams&,
                                            const ProjectedBoxes<double>&, const std::uint32_t*,
                                            const GaussianGradients<double>&, std::size_t, std::size_t);
#else
template void project_backward_rows<float>(const GaussianColumns<float>&, const ProjectParams&,
                                           const ProjectedBoxes<float>&, const std::uint32_t*,
                                           const GaussianGradients<float>&, std::size_t, std::size_t);
#endif

}  // namespace brushgs::BRUSHGS_ISA
