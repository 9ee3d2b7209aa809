// Small plain pictures of a sample of a scene, see first_view.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "brushgs/first_view.hpp"

namespace brushgs {

using Axes = std::array<double, 9>;  // rows right, down, forward of a camera in world axes

// The axes of a view from an azimuth and elevation, radians, from those of the level view from azimuth 0.
Axes axes_around(const double* level, double azimuth, double elevation);

constexpr double kLuminance[3] = {0.2126, 0.7152, 0.0722};  // weights of red, green and blue
constexpr double kSeen = 0.5;                               // alpha from which a pixel shows the subject

struct ViewCamera {
    Axes axes;
    int side;  // pixels of the square picture

    double focal() const;
    // x and y in the picture, pixels, and the depth of a point, in radii.
    std::array<double, 3> project(const double* point) const;
};

struct SmallPicture {
    std::size_t side;
    std::vector<float> rgb, alpha;  // [side, side, 3] premultiplied, [side, side]
    std::vector<float> depth;       // [side, side], or empty
    std::size_t num_seen;           // pixels that show the subject

    bool is_seen(std::size_t pixel) const { return static_cast<double>(alpha[pixel]) > kSeen; }
    float straight(std::size_t pixel, std::size_t channel) const;  // color, 0 to 1
};

// Pictures of one camera: the second, if asked for, has `shades` [count] in place of red, and no depth.
struct PicturePair {
    SmallPicture plain, shaded;
};

// Adds a row of a scene to a sample with a center and a radius, its scales times `growth`.
template <class T>
void add_row(const SceneView<T>& scene, std::size_t row, double growth, ViewSample& sample);

// A plain picture of Gaussians as a pinhole camera sees them.
struct PlainView {
    double viewmat[12];     // camera from world, the first three rows of [4, 4]
    double fx, fy, cx, cy;  // pixels
    int width, height;
    double near;  // world units
    bool is_antialiased;
};
struct ViewPicture {
    std::vector<float> rgb, alpha;  // [height, width, 3] premultiplied, [height, width]
};
ViewPicture paint_view(const SceneView<float>& scene, const PlainView& view);

// Red and green are these shades, 0 to 1 for each row.
SmallPicture paint_shades(const ViewSample& sample, const ViewCamera& camera, const std::vector<float>& red,
                          const std::vector<float>& green);

// In its colors, with depth; and with a shade in place of red.
PicturePair paint_pair(const ViewSample& sample, const ViewCamera& camera, const std::vector<float>& red);

// [count] 0 to 1: the logarithm of the size of each Gaussian.
std::vector<float> shades_of_size(const ViewSample& sample);

// [count] painted area, opacity x area, without the extremes.
std::vector<double> painted_weights(const ViewSample& sample);

// The values with all above a quantile set to it.
std::vector<double> clipped(std::vector<double> values, double quantile);

}  // namespace brushgs
