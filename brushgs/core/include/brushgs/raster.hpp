// From boxes and a stroke texture to a picture: strokes are blended front to back, tile by tile.
//
// The definition is brushgs/rendering/reference.py; this is the same, fast. In short:
//   1. every box becomes a record: the affine map from pixel to texel, and the tiles it overlaps;
//   2. every tile gets the list of its records, in stroke order (two passes: count, then fill);
//   3. every tile is painted alone, in 4 x 4 pixel blocks, until no pixel lets light through.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "brushgs/blending.hpp"
#include "brushgs/layers.hpp"

namespace brushgs {

constexpr int kTileWidth = 32;   // pixels; measured best, together with the height (8 x 4 blocks: 32 bits)
constexpr int kTileHeight = 16;  // pixels

enum class Kernel { bilinear, nearest, gaussian, ellipse };
enum class Blend { cover, glaze };

// Each box of a stroke image again, as a soft kernel (Kernel::gaussian) behind the stroke.
template <class T>
struct UnderpaintView {
    const T* setbacks = nullptr;      // [M] world units behind the stroke; null: no underpaint
    double reach = 0;                 // half extents, in those of the box; with `reaches` the largest of them
    const double* reaches = nullptr;  // [M] the same of each box, in place of `reach`; or null
    double opacity = 0;               // in that of the box
};

// Streaks of bristles: factors on a stroke's color across the stroke, see brushgs/rendering/streaks.py.
constexpr int kBristles = 12;       // across a box
constexpr int kBristleMargin = 12;  // beyond it on either side: filtered levels of an image are larger than the box
template <class T>
struct StreakView {
    // Two bands of noise, 0 to 255: entry 2 k packs bristles k and k + 1 of the first, low byte first, entry 2 k + 1
    // those of the second, so that one load gets all four. Box i starts at bristle starts[i] + kBristleMargin.
    const std::uint16_t* noise = nullptr;  // [2 (256 + kBristles + 2 kBristleMargin + 2)]; null: no streaks
    const std::uint8_t* starts = nullptr;  // [M]
    const T* weights = nullptr;            // [M, 2] of the bands: the factor is 1 + sum of weight (noise / 127.5 - 1)
    const T* slopes = nullptr;             // [M, 2] derivative of the weights by the half extent along v, per pixel
    // [M, 3] single bristles of the first band again, of a size of their own: how many across the box, at most
    // kMostFine, the weight of their noise on the color, and on the height in pixels; null: none. Without derivative.
    const T* fine = nullptr;
};
constexpr double kMostFine = 2048;

// Underpaint is thinner than its stroke, and smooth: this share of the stroke's thickness, and no gain.
constexpr double kUnderpaintThickness = 0.15 / 0.8;

// M boxes, nearest first; layout as in brushgs.Boxes.
template <class T>
struct BoxView {
    std::size_t count;            // M
    const T* centers;             // [M, 2] pixels
    const T* half_extents;        // [M, 2] pixels
    const T* angles;              // [M] radians
    const T* colors;              // [M, 3]; of glazes log2 of the share of the light that they let through, <= 0
    const T* opacities;           // [M]
    Channels<const T> layers;     // [M] each: what the layers of the picture are means of
    const T* depths = nullptr;    // [M] world units, for the soft order and for underpaint
    const T* softness = nullptr;  // [M] world units; null: each box hides all that lies behind it
    UnderpaintView<T> underpaint = {};
    StreakView<T> streaks = {};
    const T* reliefs = nullptr;  // [M, 2] pixels: thickness of the paint, and gain of the brush's own height
    const T* limits = nullptr;   // [H, W] world units: how far back boxes are seen; null: all the way
    const T* fades = nullptr;    // [M, 2] with limits: the depth at which a box is gone, were it the limit; and 1 over
                                 // the part of the limits over which it fades
};

// One pre-filtered version of the stroke image. Entry (row i, column j) of `pairs` packs the 8-bit texels (i, j)
// and (i + 1, j), low byte first; so the four bytes from there on are the 2 x 2 texels of a bilinear sample, and
// one load gets them (half the memory of packing all four: more of it stays in cache). The last row is paired
// with itself, and one more entry stands at the very end.
struct Level {
    const std::uint16_t* pairs;  // [rows * columns + 1]
    int columns;                 // >= 2
    int rows;                    // >= 2
    double reach_u;              // the level spans -reach to reach of the box's half extent; 1: just the box
    double reach_v;
    // For pictures with a height, or null: `pairs`, and in the high half of each entry the pair of the brush's height.
    const std::uint32_t* pairs_with_height = nullptr;  // [rows * columns + 1]
    // Of a colored brush, or null: what is added to the color of the stroke, a word a texel: red, green and blue,
    // low byte first, in steps of `tint_step` from kTintZero. The last row is there twice, and one more entry.
    const std::uint32_t* tints = nullptr;  // [(rows + 1) * columns + 1]
    double tint_step = 0;
};
constexpr int kTintZero = 128;

struct RasterParams {
    Kernel kernel;
    int width;                   // pixels
    int height;                  // pixels
    int num_threads;             // >= 1, at most; negative: exactly so many, whether they pay or not
    double min_transmittance;    // 0 to 1: a pixel is finished before it lets less light through
    Blend blend = Blend::cover;  // glaze: without layers, underpaint and streaks
    int first_row = 0;           // pixels: the rows first_row to end_row are painted alone, as a
    int end_row = 1 << 15;       // strip of the picture; `rasterize` sets both
    // The part of the picture that is painted and that planes [H, W] hold, pixels: its first row and column, which
    // begin a tile, and its size; 0: up to the end of the picture. Its pixels are those of the whole, bit for bit.
    int top = 0, left = 0, part_height = 0, part_width = 0;
    std::span<const Level> levels;                // images only: at least one
    std::span<const std::uint16_t> level_of_box;  // [M] row of `levels`; empty: all use levels[0]
    bool has_tints = false;                       // whether a level has tints; not for glazes

    int bottom() const { return part_height == 0 ? height : top + part_height; }
    int right() const { return part_width == 0 ? width : left + part_width; }
    std::size_t row_length() const { return static_cast<std::size_t>(right() - left); }
    // Of a pixel of the picture in the planes.
    std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y - top) * row_length() + static_cast<std::size_t>(x - left);
    }
};

template <class T>
struct Picture {
    T* rgb;               // [H, W, 3] premultiplied; of glazes the tint: the product over boxes of color^alpha
    T* alpha;             // [H, W]
    Channels<T> layers;   // [H, W] each
    T* height = nullptr;  // [H, W] pixels, or null; needs `reliefs` of the boxes and, of levels, pairs with height
    // Whether the strokes are laid over what the planes hold, as `lay_over` lays a picture of them (see coats.hpp), but
    // planes of tiles without strokes are left alone. Not for glazes. Strokes hide the share `hidden` of the height.
    bool lays = false;
    T hidden = 1;
};

// The data of one stroke at every pixel: texel = offset + gradient . (pixel - anchor). The anchor is a whole pixel in
// or near the picture, so that differences are exact even for a distant box center. One cache line.
template <class T>
struct alignas(64) Record {
    T offset_u, offset_v;  // texels (Gaussian: standard deviations; ellipse: half axes) at the anchor's center
    T du_dx, du_dy, dv_dx, dv_dy;
    T color[3];
    T opacity;                              // images: per texel unit, that is / 255
    T limit;                                // analytic kernels: |u| and |v| of anything visible stay below this
    std::int32_t level;                     // images: row of `levels`
    std::int16_t anchor_x, anchor_y;        // pixels
    std::int16_t left, top, right, bottom;  // pixels of the picture that the box may cover; empty: right < left
};
static_assert(sizeof(Record<float>) == 64);

// The outline of a painted box, including its underpaint, for the search for its tiles.
struct Outline {
    float center_x, center_y;               // pixels
    float cos, sin;                         // of the u axis
    float reach_u, reach_v;                 // painted half lengths, pixels
    std::int16_t left, top, right, bottom;  // as in `Record`; if empty, nothing else is set
};

// Records of tile t: ids[starts[t]] to ids[starts[t + 1]], in stroke order.
struct TileLists {
    int columns, rows;
    std::vector<std::uint32_t> starts;
    std::unique_ptr<std::uint32_t[]> ids;
};

// Underpaint of a painted stroke, behind some strokes that are not painted yet.
struct WaitingUnderpaint {
    double depth;         // world units
    std::uint32_t place;  // of the stroke, in the list of the tile
};

// The limits of one tile, in blocks of 4 x 4 pixels like the tile; infinite beyond the picture.
template <class T>
struct TileLimits {
    alignas(64) T limits[kTileWidth * kTileHeight / 16][16];
    T nearest, farthest;  // of those in the picture
};

// For each entry of the list of a tile the blocks of 4 x 4 pixels that its stroke paints on, one bit per block, row by
// row.
struct PaintedBlocks {
    std::uint32_t* strokes = nullptr;      // null: not kept
    std::uint32_t* underpaints = nullptr;  // the same of underpaint; null: not kept, or there is none
};

// One tile, to be painted or differentiated.
template <class T>
struct TileTask {
    const RasterParams& params;
    const BoxView<T>& boxes;
    const Record<T>* records;      // [M]
    const Record<T>* underpaints;  // [M] or null
    const std::uint32_t* ids;      // [num_ids] the records that reach the tile, or their underpaint, in stroke order
    std::size_t num_ids;
    int x0, y0;                  // pixels: the first of the tile
    WaitingUnderpaint* waiting;  // memory for num_ids of them, where there is underpaint
    const TileLimits<T>* limits = nullptr;
    PaintedBlocks painted = {};  // painting writes them, zeros before; differentiating reads them, if they were kept
};

// The pre-filtered level that each box needs: along each axis the number of `bounds` (half extents in pixels,
// descending) that the box does not exceed; both in one code, level_u * (size of bounds_v + 1) + level_v.
struct LevelChoice {
    std::vector<std::uint16_t> used;    // codes in use, ascending
    std::vector<std::uint16_t> of_box;  // [M] row of `used`
};

template <class T>
LevelChoice choose_levels(std::size_t count, const T* half_extents, std::span<const double> bounds_u,
                          std::span<const double> bounds_v);

template <class T>
struct Trace;

// Paint. The picture does not depend on `num_threads`, bit for bit. Needs as many layers of boxes as of the picture.
// `trace`, unless null, gets the data for the derivative; not for glazes, and only without softness or limits.
template <class T>
void rasterize(const RasterParams& params, const BoxView<T>& boxes, const Picture<T>& picture,
               Trace<T>* trace = nullptr);

template <class T>
struct SoftQueues;

// Implemented once per instruction set, in raster_kernel.cpp. Boxes begin to end become records[begin...], their
// underpaint, if any, records[M + begin...], and outlines[0...].
#define BRUSHGS_DECLARE_RASTER_KERNELS(isa)                                                                           \
    namespace isa {                                                                                                   \
    template <class T>                                                                                                \
    void make_records(const RasterParams&, const BoxView<T>&, std::size_t begin, std::size_t end, Record<T>* records, \
                      Outline* outlines);                                                                             \
    template <class T>                                                                                                \
    void paint_tile(const TileTask<T>&, const Picture<T>&);                                                           \
    template <class T>                                                                                                \
    void paint_tile_softly(const TileTask<T>&, SoftQueues<T>&, const Picture<T>&);                                    \
    template <class T>                                                                                                \
    void glaze_tile(const TileTask<T>&, const Picture<T>&);                                                           \
    }
BRUSHGS_DECLARE_RASTER_KERNELS(in_double)
BRUSHGS_DECLARE_RASTER_KERNELS(baseline)
BRUSHGS_DECLARE_RASTER_KERNELS(avx2)
BRUSHGS_DECLARE_RASTER_KERNELS(avx512)
#undef BRUSHGS_DECLARE_RASTER_KERNELS

}  // namespace brushgs
