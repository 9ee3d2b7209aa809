// From the footprint of a Gaussian to a stroke: the anchored direction, and the fade. With all values for their
// derivatives; the compiler drops unused ones.
#pragma once

#include "brushgs/footprint.hpp"

namespace brushgs::BRUSHGS_ISA {

// How much the major axis of the ellipse pulls on an anchored direction: 1 + this x (the squared sine between
// the longest axis and the view) x (the squared anisotropy). At 8, orbits of trained scenes in steps of 1.5
// degrees turn no stroke by more than 15 degrees a step, away from the singular views; at 20 some do.
constexpr double kAnchorPull = 8;

// An anchored direction and its intermediate values. In the frame of the ellipse, p along its major axis and q across.
struct Anchored {
    double cosine;      // between the longest axis and the view
    double side;        // squared sine between them
    double anisotropy;  // of the variances, 0 to 1
    double pull;        // of the major axis
    double p, q;        // projection of the longest axis
    double along;       // p, stretched
    double seen;        // 1, or 0 where the projection is too short to give a direction
    Direction direction;
};

// In the frame of the ellipse (x along its major axis) the projection p of the Gaussian's longest axis is
// stretched along x: that bends it toward the branch of the major axis nearer to it, not at all where the
// ellipse is round or the longest axis is seen end-on. Continuous wherever p is not zero, that is for every view
// but the two along the longest axis.
[[gnu::always_inline]] static inline Anchored anchored(const Direction& major, const Variances& variance,
                                                       const LongestAxis& longest, const double view[3]) {
    Anchored a;
    a.cosine = longest.axis[0] * view[0] + longest.axis[1] * view[1] + longest.axis[2] * view[2];
    a.side = larger(1 - a.cosine * a.cosine, 0);
    a.anisotropy = (variance.along - variance.across) / (variance.along + variance.across);
    a.pull = 1 + kAnchorPull * a.side * a.anisotropy * a.anisotropy;
    a.p = major.cosine * longest.x + major.sine * longest.y;
    a.q = major.cosine * longest.y - major.sine * longest.x;
    a.along = a.pull * a.p;
    const double length = __builtin_sqrt(a.along * a.along + a.q * a.q);
    const bool is_seen = length > kDirectionNoise * longest.length;  // not end-on to the last digit
    const double inverse = 1 / length;
    const double x = is_seen ? a.along * inverse : 1.0, y = is_seen ? a.q * inverse : 0.0;
    const double bent_cosine = major.cosine * x - major.sine * y, bent_sine = major.sine * x + major.cosine * y;
    a.seen = is_seen ? 1.0 : 0.0;
    a.direction = {bent_cosine, bent_sine, angle_of(bent_cosine, bent_sine)};
    return a;
}

// The factor on the opacity of a Gaussian in an antialiased scene: the root of det S / det(S + low_pass I), S the
// covariance M M^T in px^2, so that Gaussians enlarged by the low-pass become fainter. The root of det S is the length
// of the cross product of the rows of M, and det(S + h I) = det S + h (trace S + h), a sum without a difference:
// needles and discs seen edge-on keep their digits. Source: Yu et al. 2024, Mip-Splatting, section 5.2.
struct Compensation {
    double normal[3];  // the cross product at unit length, or 0
    double area;       // its length, px^2
    double grown;      // its square with the low-pass
    double share;
};

[[gnu::always_inline]] static inline Compensation compensation_of(const Footprint& f, double low_pass) {
    Compensation c;
    const double nx = f.mx[1] * f.my[2] - f.mx[2] * f.my[1], ny = f.mx[2] * f.my[0] - f.mx[0] * f.my[2],
                 nz = f.mx[0] * f.my[1] - f.mx[1] * f.my[0];
    c.area = __builtin_sqrt(nx * nx + ny * ny + nz * nz);
    const double inverse = c.area > 0 ? 1 / c.area : 0.0;
    c.normal[0] = nx * inverse, c.normal[1] = ny * inverse, c.normal[2] = nz * inverse;
    c.grown = c.area * c.area + low_pass * (f.sum + low_pass);
    c.share = low_pass > 0 ? c.area / __builtin_sqrt(c.grown) : 1.0;
    return c;
}

// A smooth step from 0 to 1 between 0 and 1, and its derivative.
[[gnu::always_inline]] static inline double smooth_step(double t) {
    const double x = t < 0 ? 0 : (t > 1 ? 1 : t);
    return x * x * (3 - 2 * x);
}
[[gnu::always_inline]] static inline double smooth_slope(double t) {
    const double x = t < 0 ? 0 : (t > 1 ? 1 : t);
    return 6 * x * (1 - x);
}

// A stroke fades in between the near plane and this many times its distance. The near plane of a framed camera lies
// at 1 % of the way to the subject, and a step of 1.5 degrees around it moves the camera by 2.6 %.
constexpr double kFadedNear = 8;
// As a function of the inverse length of the box, the root of the picture's area over its own: a box that grows evenly
// toward the camera fades evenly.
constexpr double kWhole = 0.5;     // up to 4 pictures in area a stroke is whole,
constexpr double kVanished = 0.1;  // and from 100 on it is gone

// The factor on the opacity of a stroke: 0 at the near plane, 0 if its box is 100 times the picture, times the ratio of
// its lengths without and with the low-pass, which is small below a pixel; smooth, so that no stroke appears or
// vanishes from one frame to the next.
struct Fade {
    double nearness, smallness;  // whole from 1 on, nothing at 0
    double root;                 // inverse length of the box in lengths of the picture
    double length;               // what the low-pass leaves of it
    [[gnu::always_inline]] inline double share() const {
        return smooth_step(nearness) * smooth_step(smallness) * length;
    }
};

// `variance` is along the major axis.
[[gnu::always_inline]] static inline Fade fade_of(const View& camera, double depth, double box_area, double variance,
                                                  double low_pass) {
    Fade fade;
    fade.nearness = (depth - camera.near) / ((kFadedNear - 1) * camera.near);
    fade.root = __builtin_sqrt(camera.width * camera.height / box_area);
    fade.smallness = (fade.root - kVanished) / (kWhole - kVanished);
    fade.length = __builtin_sqrt(larger(variance - low_pass, 0) / variance);
    return fade;
}

}  // namespace brushgs::BRUSHGS_ISA
