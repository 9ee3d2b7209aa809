// Display-encoded colors -> OKLab, by tables of both curves; and what an eye at the usual distance sees of a picture.
#pragma once

#include <cstddef>

namespace brushgs {

struct OklabTables {
    const float* light;  // [num_light] linear light of encoded values, evenly spaced from 0 to 1
    std::size_t num_light;
    const float* roots;  // [num_roots] cube roots of squares of values, likewise
    std::size_t num_roots;
    const float* cones_from_rgb;  // [3, 3]
    const float* lab_from_roots;  // [3, 3]
};

// Writes [3, count] from colors [count, 3], 0 to 1; what is beyond is clipped.
void oklab_planes(const OklabTables& tables, const float* rgb, std::size_t count, int num_threads, float* planes);

struct PlainPicture {
    const float* rgb;    // [height, width, 3] premultiplied
    const float* alpha;  // [height, width]
    std::size_t height, width;
};

// Writes the colors of means of squares of 2 x 2 pixels over black and over white, [2, 3, h, w] with h and w the
// halves, rounded up: an odd last row or column is not averaged.
void seen_planes(const OklabTables& tables, const PlainPicture& picture, int num_threads, float* planes);

struct SeenErrors {
    const float* plain;    // as `seen_planes` writes them
    const float* painted;  // likewise
    std::size_t height, width;
    float low, high;  // differences below which none counts, and above which all count
    int num_threads;
    double* errors;  // [height, width] squared, the mean over black and white
};

void seen_errors(const SeenErrors& query);

}  // namespace brushgs
