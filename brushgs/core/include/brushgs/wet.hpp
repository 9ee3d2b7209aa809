// A wet layer of watercolour: noise anchored in space, smoothing that keeps edges, and washes of pigment.
// Defined by tests/rendering/wet_reference.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace brushgs {

// Gradient noise of octaves at the points of space that pixels show: point = z (corner + x across + y down) + origin,
// of which the octave of size 1 is one unit. Octaves are chosen by their size in the picture.
template <class T>
struct SpaceNoiseParams {
    const T* depth;  // [H, W] camera z; 0: nothing there, and no noise
    T* noise;        // [H, W, 3] flow and slow noise of deviation 1, and the distance to the focus in its reach
    int width, height;
    double across[3], down[3], corner[3], origin[3];
    double focus[3];  // relative to the same origin
    double reach;     // > 0
    double finest;    // size of the finest octave for z 1
    int octaves;      // of the flow, >= 2
    std::uint32_t seed;
    int num_threads;  // >= 1; results do not depend on it
};
template <class T>
void space_noise(const SpaceNoiseParams<T>& params);

// The recursive filter of the domain transform, in place: Gastal and Oliveira 2011.
template <class T>
struct SmoothParams {
    T* planes;                    // [H, W, C]
    const T* guide;               // [H, W, 3] whose steps hold the smoothing back; null: nothing does
    const T* hold;                // [H, W] pixels of distance for a step of 1, summed over the channels of the guide
    int width, height, channels;  // 1 or 3 channels
    double sigma;                 // pixels, > 0
    int rounds;                   // >= 1
    int num_threads;              // >= 1; results do not depend on it
};
template <class T>
void smooth_planes(const SmoothParams<T>& params);

// Colors on white paper with the lights and darks of a watercolour.
template <class T>
struct KeyParams {
    const T* rgb;    // [pixels, 3] premultiplied
    const T* alpha;  // [pixels]
    T* keyed;        // [pixels, 3] on white
    std::size_t num_pixels;
    T low, high;  // luma that becomes the darkest and white
    T darkest, gamma, chroma;
    T solid;  // alpha x this, in a smooth step, is the share of the colors
    int num_threads;
};
template <class T>
void key_colors(const KeyParams<T>& params);

// Numbers of the washes, in the order of the fields of brushgs.rendering.wet_layer.Washes.
template <class T>
struct WashNumbers {
    T shares[3];       // of the density that is there after each wash
    T steps[2];        // density of a mass of the second and the third wash
    T hardness[2];     // of their borders
    T masses[2];       // how far densities move to those of masses, away from the focus
    T wander;          // of these borders with the flow, in steps
    T at_focus;        // share of masses and granulation that the focus leaves out
    T rims[3];         // of each wash
    T flows[2];        // amplitude of the flow in the first and the second wash
    T dips[3];         // depth, place and width of a backrun's pale level
    T crests[3];       // height, place and width of its dark one
    T grain;           // granulation
    T light[2];        // density of the second wash below which the paper is left, and over which that fades
    T light_noise[2];  // of that limit: with the grain, and with the flow
    T lost[6];         // score from which the outline is lost, over which that grows; its noise, focus, side, density
    T most;            // density
};

template <class T>
struct WashParams {
    const T *coarse, *middle, *fine;  // [pixels, 3] colors, smoothed
    const T* noise;                   // [pixels, 3], see `space_noise`; the third the focus, 0 to 1
    T* densities;                     // [pixels, 9] of the three washes
    T* means;                         // [pixels, 3] of their channels
    T* tones;                         // [pixels] density of the luma of the second
    std::size_t num_pixels;
    int num_threads;
};
template <class T>
void part_washes(const WashParams<T>& params, const WashNumbers<T>& numbers);

template <class T>
struct MixParams {
    const T* densities;  // [pixels, 9]
    const T* means;      // [pixels, 3]
    const T* blurred;    // [pixels, 3] means
    const T* tones;      // [pixels]
    const T* noise;      // [pixels, 3]
    const T* alpha;      // [pixels] of the strokes
    const T* soft;       // [pixels, 2] 0.5 at an outline to 1 where none is, and how far its side is that of the lamp,
                         // -1 to 1; null: no outline is lost
    const T* grain;      // [pixels] of the paper, 0 (a valley) to 1; null: smooth
    const T* border;     // [pixels] share of the washes there; null: all
    const T* paper;      // [pixels, 3]; null: white
    T* rgb;              // [pixels, 3]
    T* covered;          // [pixels] alpha
    std::size_t num_pixels;
    int num_threads;
};
template <class T>
void mix_washes(const MixParams<T>& params, const WashNumbers<T>& numbers);

#define BRUSHGS_DECLARE_WET(isa)                                                                                \
    namespace isa {                                                                                             \
    template <class T>                                                                                          \
    void noise_row(const SpaceNoiseParams<T>& params, int y);                                                   \
    template <class T>                                                                                          \
    void smooth_rows(const SmoothParams<T>& params, double sigma, int first, int end, T* memory);               \
    template <class T>                                                                                          \
    void smooth_columns(const SmoothParams<T>& params, double sigma, int first, int end, T* memory);            \
    template <class T>                                                                                          \
    void key_pixels(const KeyParams<T>& params, std::size_t first, std::size_t end);                            \
    template <class T>                                                                                          \
    void part_pixels(const WashParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end); \
    template <class T>                                                                                          \
    void mix_pixels(const MixParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end);   \
    }
BRUSHGS_DECLARE_WET(in_double)
BRUSHGS_DECLARE_WET(baseline)
BRUSHGS_DECLARE_WET(avx2)
BRUSHGS_DECLARE_WET(avx512)
#undef BRUSHGS_DECLARE_WET

}  // namespace brushgs
