// What each box makes up of a picture: sums of values of pixels by the weights that the box is blended with.
//
// The weight of a box at a pixel is its alpha times the transmittance in front. Such sums are the derivative of a
// picture by its colors, bit for bit those of `rasterize_backward`; but they need neither the picture nor the slopes
// of coverage, and take 0.5 to 0.7 of its time.
#pragma once

#include "brushgs/raster.hpp"
#include "brushgs/record_sums.hpp"

namespace brushgs {

// The summed values; layout as in brushgs.Frame.
template <class T>
struct PixelValues {
    const T* values;  // [H, W, 3] or null: zeros
    const T* shares;  // [H, W]
};

// The sums of M boxes.
template <class T>
struct PaintedSums {
    T* values;  // [M, 3] or null: not wanted
    T* shares;  // [M]
};

constexpr int kNumPaintedSums = 4;  // of a record in a tile: three values and the share

// Sum over the pixels of boxes of an analytic kernel, without softness and underpaint. All is written. Results do not
// depend on `num_threads`, bit for bit.
template <class T>
void sum_painted(const RasterParams& params, const BoxView<T>& boxes, const PixelValues<T>& pixels,
                 const PaintedSums<T>& sums);

// Implemented once per instruction set, in painted_sums_kernel.cpp.
#define BRUSHGS_DECLARE_PAINTED_SUMS(isa)                                                \
    namespace isa {                                                                      \
    template <class T>                                                                   \
    void sum_tile(const TileTask<T>&, const PixelValues<T>&, const RecordSums<T>& sums); \
    }
BRUSHGS_DECLARE_PAINTED_SUMS(in_double)
BRUSHGS_DECLARE_PAINTED_SUMS(baseline)
BRUSHGS_DECLARE_PAINTED_SUMS(avx2)
BRUSHGS_DECLARE_PAINTED_SUMS(avx512)
#undef BRUSHGS_DECLARE_PAINTED_SUMS

}  // namespace brushgs
