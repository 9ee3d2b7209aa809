// The arithmetic of `project`: geometry in double for either scalar, color in the scalar of the arrays.
//
// Source: Zwicker et al. 2002, EWA Splatting, for the local affine projection; Kerbl et al. 2023 for the
// low-pass, the clamp of the Jacobian and the spherical harmonics.
//
// Compiled once per instruction set (see CMakeLists.txt): only the functions at the end may have external linkage.
// Loops over `kBlock` lanes have no branch and no library call, so that the compiler can vectorise them.
#include "brushgs/project_kernel.hpp"

#include "brushgs/blending.hpp"
#include "brushgs/footprint.hpp"
#include "brushgs/placing.hpp"
#include "brushgs/sh.hpp"
#include "brushgs/trig.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr std::size_t kRowsAhead = 32;  // of coefficients, prefetched: they are most of what is read

// Largest value that a column of the boxes can hold.
template <class T>
constexpr double kLargest = sizeof(T) == 4 ? 3.4028234663852886e38 : 1.7976931348623157e308;

// Why a Gaussian is culled, or not; as doubles, to be selected in the same lanes as the geometry.
constexpr double kKept = 0, kBehindNear = 1, kNotFinite = 2, kFaint = 3, kOutside = 4;
constexpr std::size_t kNumReasons = 5;

struct alignas(64) Block {
    BlockLane mean[3], quat[4], scale[3], opacity;                                           // read
    BlockLane num_sigmas;                                                                    // read
    BlockLane given_direction, area_scale;                                                   // read, for Lock::given
    BlockLane center[2], half_extents[2], angle, depth, direction[3], visible, cull_reason;  // made
};

inline std::size_t index(double cull_reason) { return static_cast<std::size_t>(cull_reason); }

// Fills the second half of `block` from the first, for Gaussians whose boxes are stored as T.
template <class T, Lock lock, bool antialiased>
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
            u = anchored(u, variance, longest_axis(f, axes, scales), toward).direction;
            variance = variances(f, u.cosine, u.sine, p.low_pass);
        }
        if constexpr (lock == Lock::given) {
            const SinCos given = sincos_of(block.given_direction[i]);
            u = {given.cos, given.sin, block.given_direction[i]};
            const double smallest = variance.along * variance.across;
            variance = variances(f, u.cosine, u.sine, p.low_pass);
            const double growth = block.area_scale[i] * __builtin_sqrt(smallest / (variance.along * variance.across));
            const double area_factor = growth > 1 ? growth : 1;
            variance.along *= area_factor, variance.across *= area_factor;
            thinness = __builtin_sqrt(smallest / (variance.along * variance.across));
        }
        const double half_u = block.num_sigmas[i] * __builtin_sqrt(variance.along);
        const double half_v = block.num_sigmas[i] * __builtin_sqrt(variance.across);

        // An antialiased stroke shorter than a pixel is already made fainter by its compensation.
        const Fade fade = fade_of(camera, f.depth, 4 * half_u * half_v, major, antialiased ? 0 : p.low_pass);
        double paint = block.opacity[i] * thinness;
        if constexpr (antialiased) paint *= compensation_of(f, p.low_pass).share;
        const double visible = fades > 0 ? paint * fade.share() : paint;

        // Outside: the upright rectangle around the box and the image have no area in common.
        const double reach_x = absolute(u.cosine) * half_u + absolute(u.sine) * half_v;
        const double reach_y = absolute(u.sine) * half_u + absolute(u.cosine) * half_v;
        double cull_reason = kKept;
        cull_reason = f.center_x + reach_x > 0 ? cull_reason : kOutside;
        cull_reason = f.center_y + reach_y > 0 ? cull_reason : kOutside;
        cull_reason = f.center_x - reach_x < camera.width ? cull_reason : kOutside;
        cull_reason = f.center_y - reach_y < camera.height ? cull_reason : kOutside;
        cull_reason = half_u > 0 ? cull_reason : kOutside;
        cull_reason = half_v > 0 ? cull_reason : kOutside;
        cull_reason = visible < kMinAlpha ? kFaint : cull_reason;
        const double largest = absolute(f.center_x) + absolute(f.center_y) + half_u + half_v + f.depth;
        cull_reason = largest <= kLargest<T> ? cull_reason : kNotFinite;
        cull_reason = f.spread <= kLargest<double> ? cull_reason : kNotFinite;
        cull_reason = f.depth <= camera.near ? kBehindNear : cull_reason;

        for (int k = 0; k < 3; ++k) block.direction[k][i] = toward[k];
        block.center[0][i] = f.center_x;
        block.center[1][i] = f.center_y;
        block.half_extents[0][i] = half_u;
        block.half_extents[1][i] = half_v;
        block.angle[i] = u.angle;
        block.depth[i] = f.depth;
        block.visible[i] = visible;
        block.cull_reason[i] = cull_reason;
    }
}

template <class T, Lock lock>
void place(const ProjectParams& params, Block& block) {
    params.antialiased ? place<T, lock, true>(params, block) : place<T, lock, false>(params, block);
}

template <class T>
void place(const ProjectParams& params, std::size_t first, std::size_t count, Block& block) {
    if (params.sigmas_of_row != nullptr)
        for (std::size_t i = 0; i < count; ++i) block.num_sigmas[i] = params.sigmas_of_row[first + i];
    switch (params.lock) {
        case Lock::off:
            place<T, Lock::off>(params, block);
            break;
        case Lock::anchor:
            place<T, Lock::anchor>(params, block);
            break;
        case Lock::given:
            for (std::size_t i = 0; i < count; ++i) {
                block.given_direction[i] = within_reach(static_cast<double>(params.directions[first + i]));
                block.area_scale[i] = params.area_scales == nullptr ? 1 : params.area_scales[first + i];
            }
            place<T, Lock::given>(params, block);
            break;
    }
}

// Lists the lanes under `count` that are kept, counts the reasons of all, and returns how many are kept.
inline std::size_t choose(const Block& block, std::size_t count, std::size_t* lanes, std::size_t* reasons) {
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        lanes[num_kept] = i;
        num_kept += block.cull_reason[i] == kKept;
        ++reasons[index(block.cull_reason[i])];
    }
    return num_kept;
}

// The fields of lane `i` except the color, rounded to T.
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
                  const Block& block, BoxRecord<T>* boxes, std::size_t* reasons) {
    constexpr std::size_t row_values = 3 * (degree + 1) * (degree + 1), line = 64 / sizeof(T);
    const T* sh = gaussians.sh + 3 * gaussians.sh_terms * first;
    const std::size_t sh_stride = 3 * gaussians.sh_terms;
    std::size_t lanes[kBlock];
    const std::size_t num_kept = choose(block, count, lanes, reasons);

    constexpr std::size_t stride = degree == 0 ? 1 : (degree == 1 ? 4 : 16);
    alignas(64) T basis[kBlock * stride];
    for (std::size_t i = 0; i < kBlock; ++i)
        sh_basis<degree>(static_cast<T>(block.direction[0][i]), static_cast<T>(block.direction[1][i]),
                         static_cast<T>(block.direction[2][i]), basis + stride * i);

    std::size_t num_boxes = 0;
    for (std::size_t j = 0; j < num_kept; ++j) {
        const std::size_t i = lanes[j];
        // An estimate: if this row is kept, the next ones mostly are too.
        const T* ahead = sh + sh_stride * (i + kRowsAhead);
        for (std::size_t k = 0; k < row_values; k += line) __builtin_prefetch(ahead + k);
        T color[3];
        add_terms<degree>(sh + sh_stride * i, basis + stride * i, color);
        for (int c = 0; c < 3; ++c) color[c] += T(0.5);
        if (!(absolute(color[0]) + absolute(color[1]) + absolute(color[2]) <= kLargest<T>)) {
            --reasons[index(kKept)], ++reasons[index(kNotFinite)];
            continue;
        }
        BoxRecord<T>& box = boxes[num_boxes++];
        for (int c = 0; c < 3; ++c) box.color[c] = color[c] > 0 ? color[c] : 0;
        fill(block, i, first + i, lock, box);
    }
    return num_boxes;
}

template <int degree, class T>
std::size_t run(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin, std::size_t end,
                BoxRecord<T>* boxes, ProjectCounts& culled) {
    std::size_t num_boxes = 0, reasons[kNumReasons] = {};
    Block block{};
    for (std::size_t i = 0; i < kBlock; ++i) block.num_sigmas[i] = params.num_sigmas;
    for (std::size_t first = begin; first < end; first += kBlock) {
        const std::size_t count = end - first < kBlock ? end - first : kBlock;
        load(gaussians, first, count, block);
        place<T>(params, first, count, block);
        num_boxes += store<degree>(gaussians, first, count, params.lock, block, boxes + num_boxes, reasons);
    }
    culled.behind_near += reasons[index(kBehindNear)];
    culled.not_finite += reasons[index(kNotFinite)];
    culled.faint += reasons[index(kFaint)];
    culled.outside += reasons[index(kOutside)];
    return num_boxes;
}

template <class T>
std::size_t run(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin, std::size_t end,
                BoxRecord<T>* boxes, ProjectCounts& culled) {
    switch (params.sh_degree) {
        case 0:
            return run<0>(gaussians, params, begin, end, boxes, culled);
        case 1:
            return run<1>(gaussians, params, begin, end, boxes, culled);
        case 2:
            return run<2>(gaussians, params, begin, end, boxes, culled);
        default:
            return run<3>(gaussians, params, begin, end, boxes, culled);
    }
}

}  // namespace

template <class T>
std::size_t project_rows(const GaussianColumns<T>& gaussians, const ProjectParams& params, std::size_t begin,
                         std::size_t end, BoxRecord<T>* boxes, ProjectCounts& culled) {
    return run(gaussians, params, begin, end, boxes, culled);
}

#ifdef BRUSHGS_IN_DOUBLE
template std::size_t project_rows<double>(const GaussianColumns<double>&, const ProjectParams&, std::size_t,
                                          std::size_t, BoxRecord<double>*, ProjectCounts&);
#else
template std::size_t project_rows<float>(const GaussianColumns<float>&, const ProjectParams&, std::size_t, std::size_t,
                                         BoxRecord<float>*, ProjectCounts&);
#endif

}  // namespace brushgs::BRUSHGS_ISA
