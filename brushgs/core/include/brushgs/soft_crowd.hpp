// The soft order where very many fragments wait, in time linear in their number.
//
// The light that reaches a fragment is a function of its depth and softness that is smooth at the scale of its
// softness. So strokes of similar depth and softness form cells; the light is computed at a few Chebyshev points of
// each cell, and interpolated at its strokes. Strokes hide others by definition, at their own depths, and keep their
// own weight: nothing is merged, and a stroke that crosses a border jumps by no more than the error of interpolation.
// Cells with no more strokes than points have their points at the strokes, without error. Underpaint has no softness:
// in its cells the light that passes softer strokes is interpolated, and what they hide of each other is exact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "brushgs/memory.hpp"
#include "brushgs/raster.hpp"

namespace brushgs {

constexpr std::size_t kDepthPoints = 6, kSoftnessPoints = 4;  // of a cell
constexpr std::size_t kMostPoints = kDepthPoints * kSoftnessPoints;

// Strokes of a tile, or their underpaint, with common points of interpolation.
struct CrowdCell {
    std::uint32_t first, end;   // rows that hide some of it in part; those before lie wholly in front, others behind
    std::uint32_t first_point;  // of `Crowd::points`
    std::uint32_t num_points;   // at most kMostPoints
    bool is_direct;             // its points are its strokes
    bool is_hard;               // without softness: its rows hide those behind them in it wholly
    std::uint32_t own;          // its first row
    double depth, softness;     // the least depth and the largest softness in it
};

struct CrowdPoint {
    double depth, squared_softness;
    std::uint32_t rank;  // rows before it are the nearer ones
    bool is_stroke;      // which is not hidden by itself
};

// The fragments of one block of 4 x 4 pixels, in stroke order.
template <class T>
struct CrowdBlock {
    Buffer<T> alphas;            // [capacity, 16] 0 in pixels without the fragment
    Buffer<T> shades;            // [capacity, num_shades, 16] as in `SoftQueues`
    Buffer<T> heights;           // [capacity, 16]
    Buffer<std::uint32_t> rows;  // [capacity] of the crowd
    std::size_t count = 0, capacity = 0;
};

// All fragments of a tile. Kept by each thread from tile to tile.
template <class T>
struct Crowd {
    CrowdBlock<T> blocks[kTileWidth * kTileHeight / 16];
    int num_shades = 0;
    bool keeps_heights = false;
    // By row: a stroke or its underpaint, in stroke order.
    std::vector<double> depths, softness;
    std::vector<double> alphas;  // the largest in the tile
    std::vector<std::uint32_t> ids;
    // The result of `plan_cells`.
    std::vector<CrowdCell> cells;  // by `first`
    std::vector<CrowdPoint> points;
    std::vector<std::uint32_t> cell_of_row;
    std::vector<std::uint32_t> point_of_row;  // of a direct cell, counted from its first
    std::vector<T> factors;                   // [rows, kMostPoints] of the points of its cell, unless that is direct
    // Of one cell, by `find_shares`: row r - first of the cell, of `stride` rows.
    std::vector<T> shares;               // [points, stride] of what lies at the point that row r hides
    std::vector<std::uint8_t> is_front;  // [stride] whether row r lies wholly in front of the cell
    std::size_t stride = 0;
    std::vector<std::uint32_t> own;  // memory for places of a block
};

// These allocate, in soft_crowd.cpp: a kernel's file would compile the library's templates for its instruction set.

template <class T>
void clear(Crowd<T>& crowd, int num_shades, bool keeps_heights);

// Makes room for more fragments of a block.
template <class T>
void grow(const Crowd<T>& crowd, CrowdBlock<T>& block);

// A stroke at its depth, with the largest alpha of its fragments.
template <class T>
void add_row(Crowd<T>& crowd, std::uint32_t id, T depth, T squared_softness, T alpha);

// Sorts the rows into cells.
template <class T>
void plan_cells(Crowd<T>& crowd);

template <class T>
void find_shares(Crowd<T>& crowd, const CrowdCell& cell);

}  // namespace brushgs
