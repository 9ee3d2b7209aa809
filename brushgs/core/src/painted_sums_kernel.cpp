// The hot loop of sums over the pixels of boxes, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/painted_sums.hpp"

#include "brushgs/blend_lanes.hpp"
#include "brushgs/lane_sums.hpp"
#include "brushgs/sampling.hpp"
#include "brushgs/tile_state.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

// The pixels of one tile: planes of 4 x 4 blocks.
template <class T>
struct ValueTile {
    alignas(64) T transmittance[kNumBlocks][kBlockPixels];
    alignas(64) T values[kNumPaintedSums][kNumBlocks][kBlockPixels];
    std::uint16_t alive[kNumBlocks];  // pixels that still let light through
    std::uint32_t alive_blocks;
    T min_transmittance;  // as painted
};

// Fills four pixels of block b, from p on, with four of the picture.
template <class T>
[[gnu::always_inline]] inline void read_four(const T* rgb, const T* shares, int b, int p, ValueTile<T>& tile) {
    if (rgb != nullptr) {
        const Colors<T> color = deinterleave(rgb);
        __builtin_memcpy(tile.values[0][b] + p, &color.red, sizeof color.red);
        __builtin_memcpy(tile.values[1][b] + p, &color.green, sizeof color.green);
        __builtin_memcpy(tile.values[2][b] + p, &color.blue, sizeof color.blue);
    }
    __builtin_memcpy(tile.values[3][b] + p, shares, 4 * sizeof(T));
}

// The picture by value: through a reference it would be reloaded after every store to the tile.
template <class T>
void start(const TileTask<T>& task, const PixelValues<T> picture, ValueTile<T>& tile) {
    const int columns_left = task.params.width - task.x0, rows_left = task.params.height - task.y0;
    // Beyond the picture zeros are used, which add nothing.
    const bool is_whole = columns_left >= kTileWidth && rows_left >= kTileHeight && picture.values != nullptr;
    if (!is_whole) __builtin_memset(tile.values, 0, sizeof tile.values);
    tile.alive_blocks = open_pixels(columns_left, rows_left, tile.alive);
    tile.min_transmittance = static_cast<T>(task.params.min_transmittance);
    T* const all = tile.transmittance[0];
    for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
    for (int b = 0; b < kNumBlocks; ++b) {
        const int x = b % kBlockColumns * kBlockSize, y = b / kBlockColumns * kBlockSize;
        if (x >= columns_left) continue;
        const int count = columns_left - x < kBlockSize ? columns_left - x : kBlockSize;
        for (int row = 0; row < kBlockSize && y + row < rows_left; ++row) {
            const std::size_t pixel =
                static_cast<std::size_t>(task.y0 + y + row) * static_cast<std::size_t>(task.params.width) +
                static_cast<std::size_t>(task.x0 + x);
            const T* const rgb = picture.values == nullptr ? nullptr : picture.values + 3 * pixel;
            const T* const shares = picture.shares + pixel;
            if (count == kBlockSize) {
                read_four(rgb, shares, b, row * kBlockSize, tile);
                continue;
            }
            const std::size_t bytes = static_cast<std::size_t>(count) * sizeof(T);
            T some_rgb[3 * kBlockSize] = {}, some_shares[kBlockSize] = {};
            if (rgb != nullptr) __builtin_memcpy(some_rgb, rgb, 3 * bytes);
            __builtin_memcpy(some_shares, shares, bytes);
            read_four(rgb == nullptr ? nullptr : some_rgb, some_shares, b, row * kBlockSize, tile);
        }
    }
}

// Closes the pixels without any value: whatever is painted there adds nothing.
template <class T>
void close_empty(ValueTile<T>& tile) {
    using L = Lanes<T>;
    const auto all = L::from_bits(~0u);
    const auto zero = L::set(0);
    for (int b = 0; b < kNumBlocks; ++b) {
        unsigned open = 0;
        for (int lane = 0; lane < kBlockPixels; lane += L::width)
            for (int k = 0; k < kNumPaintedSums; ++k) {
                const auto value = L::load(tile.values[k][b] + lane);
                open |= (L::bits(L::less(all, value, zero)) | L::bits(L::less(all, zero, value))) << lane;
            }
        tile.alive[b] = static_cast<std::uint16_t>(tile.alive[b] & open);
        if (tile.alive[b] == 0) tile.alive_blocks &= ~(1u << b);
    }
}

// Returns whether the record paints in the tile; only then are there sums.
template <class T, Kernel kernel>
[[gnu::always_inline]] inline bool sum_record(const TileTask<T>& task, const Record<T>& record, ValueTile<T>& tile,
                                              T* sums) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint16_t pixels[kNumBlocks];
    const std::uint32_t blocks =
        sample_record<T, kernel, true>(task.params, record, task.x0, task.y0, tile, alphas, pixels);
    if (blocks == 0) return false;
    const Real darkest = L::set(tile.min_transmittance);
    alignas(64) T lanes[kNumPaintedSums][kBlockPixels];
    for (int lane = 0; lane < kBlockPixels; lane += L::width) {
        Real values[kNumPaintedSums];
        for (Real& value : values) value = L::set(0);
        for (std::uint32_t rest = blocks; rest != 0; rest &= rest - 1) {
            const int b = __builtin_ctz(rest);
            const Blended<T> blended = blend_lanes(L::load(alphas[b] + lane), darkest, tile.transmittance[b] + lane);
            finish_pixels(tile, b, blended.finished() << lane);
            for (int k = 0; k < kNumPaintedSums; ++k)
                values[k] = values[k] + blended.weight * L::load(tile.values[k][b] + lane);
        }
        for (int k = 0; k < kNumPaintedSums; ++k) L::store(lanes[k] + lane, values[k]);
    }
    add_lanes(lanes, sums);
    return true;
}

// By value, as above.
template <class T, Kernel kernel>
void sum_all(const TileTask<T> task, ValueTile<T>& tile, const RecordSums<T> sums) {
    const Attributes<T, 0> none(task.boxes.layers);
    std::size_t i = 0;
    for (; i < task.num_ids && tile.alive_blocks != 0; ++i) {
        prefetch(task, none, i);
        sums.is_seen[i] =
            sum_record<T, kernel>(task, task.records[task.ids[i]], tile, sums.values + kNumPaintedSums * i);
    }
    __builtin_memset(sums.is_seen + i, 0, task.num_ids - i);
}

}  // namespace

template <class T>
void sum_tile(const TileTask<T>& task, const PixelValues<T>& pixels, const RecordSums<T>& sums) {
    if (task.num_ids == 0) return;
    ValueTile<T> tile;
    start(task, pixels, tile);
    close_empty(tile);
    if (task.params.kernel == Kernel::gaussian)
        sum_all<T, Kernel::gaussian>(task, tile, sums);
    else
        sum_all<T, Kernel::ellipse>(task, tile, sums);
}

#ifdef BRUSHGS_IN_DOUBLE
template void sum_tile<double>(const TileTask<double>&, const PixelValues<double>&, const RecordSums<double>&);
#else
template void sum_tile<float>(const TileTask<float>&, const PixelValues<float>&, const RecordSums<float>&);
#endif

}  // namespace brushgs::BRUSHGS_ISA
