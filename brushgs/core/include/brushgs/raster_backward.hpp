// The derivative of `rasterize`: from the gradient of a loss by the picture to that by the boxes and the texels.
//
// Strokes are blended once more from front to back, tile by tile, by the code that painted them: so the light in
// front of each fragment, the fragments too faint to count and the end of each pixel are the same, bit for bit.
// What lies behind a fragment is the whole picture less what lies in front. Nothing is kept per fragment.
//   1. every tile sums what its records get from its pixels: kNumSums numbers for each record of its list;
//   2. every box adds up what its tiles found, tile by tile, and turns it into gradients.
#pragma once

#include "brushgs/raster.hpp"

namespace brushgs {

// Picture and gradients of the loss by it; layout as in brushgs.Frame.
template <class T>
struct PictureGradients {
    const T* rgb;      // [H, W, 3] as painted
    const T* alpha;    // [H, W] as painted
    const T* depth;    // [H, W] as painted; may be null where v_depth is
    const T* v_rgb;    // [H, W, 3]
    const T* v_alpha;  // [H, W] or null: 0
    const T* v_depth;  // [H, W] or null: 0
};

// Gradients of the loss by the boxes; layout as in brushgs.Boxes. All are written.
template <class T>
struct BoxGradients {
    T* centers;       // [M, 2]
    T* half_extents;  // [M, 2]
    T* angles;        // [M]
    T* depths;        // [M]
    T* colors;        // [M, 3]
    T* opacities;     // [M]
};

// What a tile sums for one record. With a the alpha, x and y the pixel from the record's anchor, and U and V the
// derivative of the loss by u and v, but for the factor `opacity` of the record where it is an image.
enum Sum { kU, kUx, kUy, kV, kVx, kVy, kAlpha, kRed, kGreen, kBlue, kDepth, kNumUsedSums };
constexpr int kNumSums = 12;  // a multiple of four: they are added up in fours
static_assert(kNumUsedSums <= kNumSums);

// Differentiate. `texels` has for each level of `params` the gradient by its texels, [rows, columns], by coverage
// of 0 to 1, which is added to; or is empty. Results do not depend on `num_threads`, bit for bit. A pixel is
// finished before its transmittance falls under `min_transmittance`, as when it was painted.
template <class T>
void rasterize_backward(const RasterParams& params, double min_transmittance, const BoxView<T>& boxes,
                        const PictureGradients<T>& picture, const BoxGradients<T>& gradients,
                        std::span<double* const> texels);

// Implemented once per instruction set, in raster_backward_kernel.cpp. Writes sums[num_ids, kNumSums]; `texels` may
// be null.
#define BRUSHGS_DECLARE_RASTER_BACKWARD(isa)                                                       \
    namespace isa {                                                                                \
    template <class T>                                                                             \
    void differentiate_tile(const RasterParams&, T min_transmittance, const Record<T>* records,    \
                            const std::uint32_t* ids, std::size_t num_ids, int tile_x, int tile_y, \
                            const PictureGradients<T>&, T* sums, double* const* texels);           \
    }
BRUSHGS_DECLARE_RASTER_BACKWARD(baseline)
BRUSHGS_DECLARE_RASTER_BACKWARD(avx2)
BRUSHGS_DECLARE_RASTER_BACKWARD(avx512)
#undef BRUSHGS_DECLARE_RASTER_BACKWARD

}  // namespace brushgs
