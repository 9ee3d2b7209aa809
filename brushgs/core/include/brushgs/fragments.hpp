// The fragments of a picture, pixel by pixel, in the order in which the rasterizer blends them.
//
// A fragment is a stroke, or its underpaint, at one pixel. The weights are those of `rasterize`, by the same
// arithmetic. Records are sampled by a kernel; the rest is plain code, in fragments.cpp, since fragments are rarely
// needed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/memory.hpp"
#include "brushgs/raster.hpp"

namespace brushgs {

// The fragments of the requested rows of pixels.
template <class T>
struct Fragments {
    Buffer<std::int64_t> starts;         // [pixels + 1] pixel i has the fragments starts[i] to starts[i + 1] - 1
    Buffer<std::int32_t> rows;           // the box of each
    Buffer<T> weights;                   // of its color, and of anything else
    Buffer<T> shades;                    // by which streaks multiply its color
    Buffer<std::uint8_t> is_underpaint;  // 0 or 1
    std::size_t num_pixels, count;
};

// The fragments of the rows `params.first_row` to `params.end_row`, the first of which begins a row of tiles. The
// result depends neither on `num_threads` nor on the division into calls.
template <class T>
Fragments<T> find_fragments(const RasterParams& params, const BoxView<T>& boxes);

// A record at the pixels of a tile, in blocks of 4 x 4 pixels.
template <class T>
struct SampledRecord {
    std::uint32_t id;
    bool is_underpaint;
    std::size_t next_place;  // in the list of the tile: of a stroke its own, of underpaint of the strokes to come
    std::uint32_t blocks;    // that have alphas
    const T (*alphas)[16];   // [32]
    const T (*shades)[16];   // [32]; null: 1
};

// Takes the records of a tile, nearest first.
template <class T>
class RecordSink {
public:
    std::uint16_t alive[32];  // pixels of each block that take more records
    std::uint32_t alive_blocks;

    virtual void add(const SampledRecord<T>& record) = 0;

protected:
    ~RecordSink() = default;
};

// Implemented once per instruction set, in fragments_kernel.cpp.
#define BRUSHGS_DECLARE_SAMPLE_TILE(isa)                            \
    namespace isa {                                                 \
    template <class T>                                              \
    void sample_tile(const TileTask<T>& task, RecordSink<T>& sink); \
    }
BRUSHGS_DECLARE_SAMPLE_TILE(in_double)
BRUSHGS_DECLARE_SAMPLE_TILE(baseline)
BRUSHGS_DECLARE_SAMPLE_TILE(avx2)
BRUSHGS_DECLARE_SAMPLE_TILE(avx512)
#undef BRUSHGS_DECLARE_SAMPLE_TILE

}  // namespace brushgs
