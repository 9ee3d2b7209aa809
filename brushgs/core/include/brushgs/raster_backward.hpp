// The derivative of `rasterize`: from the gradient of a loss by the picture to that by the boxes and the texels.
//
// Strokes are blended once more from front to back, tile by tile, by the code that painted them: so the light in front
// of each fragment, the fragments too faint to count and the end of each pixel are the same, bit for bit. The sum
// behind a fragment is the whole picture minus the sum in front. No data are kept per fragment; painting may have kept
// the blocks of pixels that a record paints on, see Trace.
//   1. every tile sums what its records get from its pixels: some numbers for each record of its list;
//   2. every box adds up what its tiles found, tile by tile, and turns it into gradients.
#pragma once

#include "brushgs/raster.hpp"
#include "brushgs/record_sums.hpp"

namespace brushgs {

// Picture and gradients of the loss by it; layout as in brushgs.Frame. Layers without a gradient are not among those
// here, nor their attributes among those of the boxes.
template <class T>
struct PictureGradients {
    const T* rgb;                // [H, W, 3] as painted
    const T* alpha;              // [H, W] as painted
    Channels<const T> layers;    // [H, W] each, as painted
    const T* v_rgb;              // [H, W, 3]
    const T* v_alpha;            // [H, W] or null: 0
    Channels<const T> v_layers;  // [H, W] each
};

// Gradients of the loss by the boxes; layout as in brushgs.Boxes. All are written.
template <class T>
struct BoxGradients {
    T* centers;          // [M, 2]
    T* half_extents;     // [M, 2]
    T* angles;           // [M]
    T* colors;           // [M, 3]
    T* opacities;        // [M]
    Channels<T> layers;  // [M] each: by the attributes
};

// The sums of a tile for one record. With a the alpha, x and y the pixel from the record's anchor, and U and V the
// derivative of the loss by u and v, but for the factor `opacity` of the record where it is an image. From kLayers on
// there is one sum for each channel of the layers, then one of the derivative by the half extent along v as far as
// streaks fade with it.
enum Sum { kU, kUx, kUy, kV, kVx, kVy, kAlpha, kRed, kGreen, kBlue, kLayers };

// Number of sums per record: a multiple of four, since they are added up in fours.
constexpr int num_sums(int channels) { return (kLayers + channels + 1 + 3) / 4 * 4; }

// Where a tile writes its sums.
template <class T>
struct TileSums {
    RecordSums<T> strokes;
    RecordSums<T> underpaints;  // null, where there is no underpaint
};

// Differentiate. `texels` has for each level of `params` the gradient by its texels, [rows, columns], by coverage
// of 0 to 1, which is added to; or is empty. `params` are those of painting. `trace` is what painting kept, or null:
// it is then found again. Results depend neither on that nor on `num_threads`, bit for bit.
template <class T>
void rasterize_backward(const RasterParams& params, const BoxView<T>& boxes, const Trace<T>* trace,
                        const PictureGradients<T>& picture, const BoxGradients<T>& gradients,
                        std::span<double* const> texels);

// Implemented once per instruction set, in raster_backward_kernel.cpp. `texels` may be null.
#define BRUSHGS_DECLARE_RASTER_BACKWARD(isa)                                                         \
    namespace isa {                                                                                  \
    template <class T>                                                                               \
    void differentiate_tile(const TileTask<T>&, const PictureGradients<T>&, const TileSums<T>& sums, \
                            double* const* texels);                                                  \
    }
BRUSHGS_DECLARE_RASTER_BACKWARD(in_double)
BRUSHGS_DECLARE_RASTER_BACKWARD(baseline)
BRUSHGS_DECLARE_RASTER_BACKWARD(avx2)
BRUSHGS_DECLARE_RASTER_BACKWARD(avx512)
#undef BRUSHGS_DECLARE_RASTER_BACKWARD

}  // namespace brushgs
