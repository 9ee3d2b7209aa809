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
    std::vector<float> rgb, alpha;     // [side, side, 3] premultiplied, [side, side]
    std::vector<float> depth, shades;  // [side, side], the shades premultiplied; or both empty
    std::size_t num_seen = 0;          // pixels that show the subject

    explicit SmallPicture(int length);
    bool is_seen(std::size_t pixel) const { return static_cast<double>(alpha[pixel]) > kSeen; }
    // Color and shade, 0 to 1.
    float straight(std::size_t pixel, std::size_t channel) const { return unmixed(rgb[3 * pixel + channel], pixel); }
    float shade(std::size_t pixel) const { return unmixed(shades[pixel], pixel); }

private:
    float unmixed(float premultiplied, std::size_t pixel) const;
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

// In its colors, with depth and a shade [count].
SmallPicture paint_with_shade(const ViewSample& sample, const ViewCamera& camera, const std::vector<float>& shades);

// [count] 0 to 1: the logarithm of the size of each Gaussian.
std::vector<float> shades_of_size(const ViewSample& sample);

// [count] painted area, opacity x area, without the extremes.
std::vector<double> painted_weights(const ViewSample& sample);

// The values with all above a quantile set to it.
std::vector<double> clipped(std::vector<double> values, double quantile);

}  // namespace brushgs
