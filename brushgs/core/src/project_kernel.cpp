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
#include "brushgs/footprint.hpp"
#include "brushgs/trig.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr std::size_t kRowsAhead = 32;  // of coefficients, asked for early: they are most of what is read

// Largest value that a column of the boxes can hold.
template <class T>
constexpr double kLargest = sizeof(T) == 4 ? 3.4028234663852886e38 : 1.7976931348623157e308;

// What becomes of a Gaussian; as doubles, so that they are selected in the lanes beside the geometry.
constexpr double kKept = 0, kBehindNear = 1, kNotFinite = 2, kFaint = 3, kOutside = 4;
constexpr std::size_t kNumFates = 5;

struct alignas(64) Block {
    BlockLane mean[3], quat[4], scale[3], opacity;                                     // read
    BlockLane direction_asked, swell;                                                  // read, for Lock::given
    BlockLane center[2], half_extents[2], angle, depth, direction[3], visible, fate;  // made
};

inline std::size_t index(double fate) { return static_cast<std::size_t>(fate); }

// How much the major axis of the ellipse pulls on an anchored direction: 1 + this x (the squared sine between
// the longest axis and the view) x (the squared anisotropy). At 8, orbits of trained scenes in steps of 1.5
// degrees turn no stroke by more than 15 degrees a step, away from the singular views; at 20 some do.
constexpr double kAnchorPull = 8;

// The anchored direction. In the frame of the ellipse (x along its major axis) the projection p of the
// Gaussian's longest axis is stretched along x: that bends it toward the branch of the major axis nearer to
// it, not at all where the ellipse is round or the longest axis is seen end-on. Continuous wherever p is
// not zero, that is for every view but the two along the longest axis.
[[gnu::always_inline]] inline Direction anchor_direction(const Direction& major, const Variances& variance,
                                                         const LongestAxis& longest, const double view[3]) {
    const double cosine = longest.axis[0] * view[0] + longest.axis[1] * view[1] + longest.axis[2] * view[2];
    const double side = larger(1 - cosine * cosine, 0);
    const double anisotropy = (variance.along - variance.across) / (variance.along + variance.across);
    const double pull = 1 + kAnchorPull * side * anisotropy * anisotropy;
    const double along = pull * (major.cosine * longest.x + major.sine * longest.y);
    const double across = major.cosine * longest.y - major.sine * longest.x;
    const double length = __builtin_sqrt(along * along + across * across);
    const bool is_seen = length > kDirectionNoise * longest.length;  // not end-on to the last digit
    const double inverse = 1 / length;
    const double x = is_seen ? along * inverse : 1.0, y = is_seen ? across * inverse : 0.0;
    const double bent_cosine = major.cosine * x - major.sine * y, bent_sine = major.sine * x + major.cosine * y;
    return {bent_cosine, bent_sine, angle_of(bent_cosine, bent_sine)};
}

[[gnu::always_inline]] inline double smooth_step(double t) {
    const double x = t < 0 ? 0 : (t > 1 ? 1 : t);
    return x * x * (3 - 2 * x);
}

// A stroke fades in between the near plane and this many times its distance. The near plane of a framed camera lies
// at 1 % of the way to the subject, and a step of 1.5 degrees around it moves the camera by 2.6 %.
constexpr double kFadedNear = 8;
// In the inverse length of the box, the root of the area of the picture over its own: where a box grows evenly toward
// the camera, it fades evenly.
constexpr double kWhole = 0.5;     // up to 4 pictures in area a stroke is whole,
constexpr double kVanished = 0.1;  // and from 100 on it is gone

// The share of its opacity that a stroke keeps: nothing at the near plane, nothing where its box is 100 times
// the picture, and as much as the low-pass does not add to its length where it is shorter than a pixel; smooth in
// between, so that no stroke appears or vanishes from one frame to the next. `variance` is along the major axis.
[[gnu::always_inline]] inline double fade_of(double depth, double near, double box_area, double picture_area,
                                             double variance, double low_pass) {
    const double nearness = (depth - near) / ((kFadedNear - 1) * near);
    const double smallness = (__builtin_sqrt(picture_area / box_area) - kVanished) / (kWhole - kVanished);
    const double length = __builtin_sqrt(larger(variance - low_pass, 0) / variance);
    return smooth_step(nearness) * smooth_step(smallness) * length;
}

// Fills the second half of `block` from the first, for Gaussians whose boxes are stored as T.
template <class T, Lock lock>
void place(const ProjectParams& params, Block& block) {
    const ProjectParams p = params;  // local copies cannot overlap the lanes: that frees the vectoriser
    const View camera = params.view;
    const ViewFrame view = view_frame(camera);
    const double fades = p.fades ? 1 : 0;  // as a double it is compared in the lanes
    for (std::size_t i = 0; i < kBlock; ++i) {
        const double x = block.mean[0][i], y = block.mean[1][i], z = block.mean[2][i];
        double axes[3][3];
        own_axes<T>(block.quat[0][i], block.quat[1][i], block.quat[2][i], block.quat[3][i], axes);
        const double scales[3] = {block.scale[0][i], block.scale[1][i], block.scale[2][i]};
        const Footprint f = footprint_of(view, x, y, z, axes, scales);

        const double dx = x - view.eye[0], dy = y - view.eye[1], dz = z - view.eye[2];
        const double inverse_distance = 1 / __builtin_sqrt(dx * dx + dy * dy + dz * dz);
        const double toward[3] = {dx * inverse_distance, dy * inverse_distance, dz * inverse_distance};

        Direction u = major_axis(f.difference, f.twice_b, f.spread, f.sum);
        Variances variance = variances(f, u.cosine, u.sine, p.low_pass);
        const double major = variance.along;
        double thinness = 1;  // the paint of a stroke stays the same where its box is larger than it need be
        if constexpr (lock == Lock::anchor) {
            u = anchor_direction(u, variance, longest_axis(f, axes, scales), toward);
            variance = variances(f, u.cosine, u.sine, p.low_pass);
        }
        if constexpr (lock == Lock::given) {
            const SinCos asked = sincos_of(block.direction_asked[i]);
            u = {asked.cos, asked.sin, block.direction_asked[i]};
            const double smallest = variance.along * variance.across;
            variance = variances(f, u.cosine, u.sine, p.low_pass);
            const double growth = block.swell[i] * __builtin_sqrt(smallest / (variance.along * variance.across));
            const double swelling = growth > 1 ? growth : 1;
            variance.along *= swelling, variance.across *= swelling;
            thinness = __builtin_sqrt(smallest / (variance.along * variance.across));
        }
        const double half_u = p.num_sigmas * __builtin_sqrt(variance.along);
        const double half_v = p.num_sigmas * __builtin_sqrt(variance.across);

        const double fade = fade_of(f.depth, camera.near, 4 * half_u * half_v, camera.width * camera.height,
                                    major, p.low_pass);
        const double paint = block.opacity[i] * thinness;
        const double visible = fades > 0 ? paint * fade : paint;

        // Outside: the upright rectangle around the box and the image have no area in common.
        const double reach_x = absolute(u.cosine) * half_u + absolute(u.sine) * half_v;
        const double reach_y = absolute(u.sine) * half_u + absolute(u.cosine) * half_v;
        double fate = kKept;
        fate = f.center_x + reach_x > 0 ? fate : kOutside;
        fate = f.center_y + reach_y > 0 ? fate : kOutside;
        fate = f.center_x - reach_x < camera.width ? fate : kOutside;
        fate = f.center_y - reach_y < camera.height ? fate : kOutside;
        fate = half_u > 0 ? fate : kOutside;
        fate = half_v > 0 ? fate : kOutside;
        fate = visible < kMinAlpha ? kFaint : fate;
        const double largest = absolute(f.center_x) + absolute(f.center_y) + half_u + half_v + f.depth;
        fate = largest <= kLargest<T> ? fate : kNotFinite;
        fate = f.spread <= kLargest<double> ? fate : kNotFinite;
        fate = f.depth <= camera.near ? kBehindNear : fate;

        for (int k = 0; k < 3; ++k) block.direction[k][i] = toward[k];
        block.center[0][i] = f.center_x;
        block.center[1][i] = f.center_y;
        block.half_extents[0][i] = half_u;
        block.half_extents[1][i] = half_v;
        block.angle[i] = u.angle;
        block.depth[i] = f.depth;
        block.visible[i] = visible;
        block.fate[i] = fate;
    }
}

template <class T>
void place(const ProjectParams& params, std::size_t first, std::size_t count, Block& block) {
    switch (params.lock) {
        case Lock::off: place<T, Lock::off>(params, block); break;
        case Lock::anchor: place<T, Lock::anchor>(params, block); break;
        case Lock::given:
            for (std::size_t i = 0; i < count; ++i) {
                block.direction_asked[i] = within_reach(static_cast<double>(params.directions[first + i]));
                block.swell[i] = params.swells == nullptr ? 1 : params.swells[first + i];
            }
            place<T, Lock::given>(params, block);
            break;
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
inline void fill(const Block& block, std::size_t i, std::size_t row, Lock lock, BoxRecord<T>& box) {
    for (int k = 0; k < 2; ++k) box.center[k] = static_cast<T>(block.center[k][i]);
    for (int k = 0; k < 2; ++k) box.half_extents[k] = static_cast<T>(block.half_extents[k][i]);
    // Rounding may reach -pi/2, which is the same line as +pi/2, the one in the range.
    const T angle = static_cast<T>(block.angle[i]);
    box.angle = lock == Lock::off && angle <= -static_cast<T>(kHalfPi) ? static_cast<T>(kHalfPi) : angle;
    box.depth = static_cast<T>(block.depth[i]);
    box.opacity = static_cast<T>(block.visible[i]);
    box.id = static_cast<std::int32_t>(row);
}

// Writes the boxes of the block that are kept to `boxes`; returns how many.
template <int degree, class T>
std::size_t store(const GaussianColumns<T>& gaussians, std::size_t first, std::size_t count, Lock lock,
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
        fill(block, i, first + i, lock, box);
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
        place<T>(params, first, count, block);
        num_boxes += store<degree>(gaussians, first, count, params.lock, block, boxes + num_boxes, fates);
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
