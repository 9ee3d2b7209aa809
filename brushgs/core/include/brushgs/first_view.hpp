// Which way up a scene stands, and where its front is: evidence from its Gaussians, and from small pictures of a sample
// of them, which account for what hides what. brushgs/first_view says why.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace brushgs {

// The subject of a scene, thinned; lengths in radii of its box, relative to the middle.
struct ViewSample {
    std::vector<double> places;                              // [count, 3]
    std::vector<double> areas;                               // [count] product of the two larger scales
    std::vector<float> means, quats, scales, opacities, sh;  // for pictures: scales are enlarged where rows are left
                                                             // out, so that surfaces stay closed; sh [count, 1, 3]
    std::size_t count = 0;                                   // 0: nothing with extent is visible
    std::size_t num_rows = 0;                                // in the box, before thinning
    double center[3] = {}, radius = 0;                       // of the box, world units
};

template <class T>
struct SceneView {
    const T *means, *quats, *scales, *opacities, *sh;  // see GaussianColumns
    std::size_t count, sh_terms;
};

template <class T>
ViewSample take_view_sample(const SceneView<T>& scene);

// Of each of the axes +x, +y, +z, -x, -y, -z, as all that follows.
using PerAxis = std::array<double, 6>;

// How often trained scenes have each axis up, among 51.
constexpr PerAxis kUpPriors{0.03, 0.15, 0.17, 0.03, 0.58, 0.04};

// The kinds of evidence, in the order of `measure_up`: the typical size over scenes, and the weight in log odds.
struct Evidence {
    const char* name;
    double scale, weight;
};
constexpr std::array<Evidence, 8> kEvidence{{{"size", 0.060, -0.90},
                                             {"size_at_pole", 0.102, -0.95},
                                             {"edges", 0.017, 0.38},
                                             {"edges_at_pole", 0.026, 0.19},
                                             {"foot", 0.691, 0.46},
                                             {"low_mass", 0.103, 0.5},
                                             {"low_ground", 0.109, 0.5},
                                             {"stable", 0.208, 0.51}}};

// The values of each kind of evidence.
std::array<PerAxis, kEvidence.size()> measure_up(const ViewSample& sample, int num_threads);

// Log odds without priors.
PerAxis up_evidence(const ViewSample& sample, int num_threads);

// The probability that each axis is up; of a sample without rows that of the priors alone.
PerAxis up_chances(const ViewSample& sample, int num_threads);

// The axis to take: the most probable one, unless -y is nearly as probable.
std::size_t believed_axis(const PerAxis& chances);

// Angles are radians.
constexpr double kElevation = 0.26179938779914941;      // 15 degrees
constexpr double kFlatElevation = 0.69813170079773179;  // 40 degrees, for flat ground
constexpr double kFlatHeight = 0.15;                    // of height over width: below, a subject is flat

// The elevation of the first view of a subject of this size.
inline double default_elevation(double width, double height, double depth) {
    return height < kFlatHeight * (width > depth ? width : depth) ? kFlatElevation : kElevation;
}

constexpr double kFrontMargin = 0.9;  // of the scores of both ends: below, the front is not sure
constexpr double kLean =
    0.3490658503988659;  // 20 degrees: turn of first views from the front to the side of more detail

// The front of a subject.
struct Front {
    double azimuth;
    double lean;      // turn to the side that shows more
    double margin;    // score of the front minus that of the back, in standard deviations over azimuths
    double likeness;  // of the best mirror plane, over the median one
};

// `level` are the rows right, down, forward [3, 3] of a level view from azimuth 0.
Front find_front(const ViewSample& sample, const double* level, int num_threads);

// Overlap of a subject with its mirror image, 0 to 1, for planes through the vertical axis; plane i contains the view
// from azimuth pi i / kMirrorPlanes. Places [count, 3] are in the axes of a level view, in radii.
constexpr std::size_t kMirrorPlanes = 32;
std::array<double, kMirrorPlanes> mirror_likeness(const std::vector<double>& places, const std::vector<double>& weights,
                                                  int num_threads);

}  // namespace brushgs
