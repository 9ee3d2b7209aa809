// The pixels of one tile while it is painted, and how they become a part of the picture.
//
// Compiled once per instruction set, see CMakeLists.txt. `channels` is the number of channels of the picture's layers;
// `has_relief` says whether the picture has a height.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

// The first `channels` of a set of channels, read by row.
template <class T, int channels>
struct Attributes {
    Channel<const T> columns[channels > 0 ? channels : 1];

    [[gnu::always_inline]] inline explicit Attributes(const Channels<const T>& all) {
        for (int c = 0; c < channels; ++c) columns[c] = all.channels[c];
    }
    [[gnu::always_inline]] inline T of(std::size_t row, int c) const {
        return columns[c].values[row * columns[c].stride];
    }
};

// Asks early for what record i of a tile needs: records lie in depth order, those of a tile are far apart in memory.
template <class T, int channels>
[[gnu::always_inline]] inline void prefetch(const TileTask<T>& task, const Attributes<T, channels>& attributes,
                                            std::size_t i) {
    constexpr std::size_t ahead = 4;
    const std::uint32_t id = task.ids[i + ahead < task.num_ids ? i + ahead : i];
    __builtin_prefetch(&task.records[id]);
    for (int c = 0; c < channels; ++c)
        __builtin_prefetch(attributes.columns[c].values + id * attributes.columns[c].stride);
}

// Planes of 4 x 4 blocks, so that a block is one run of memory.
template <class T, int channels, bool has_relief = false>
struct TileState {
    static constexpr int num_planes = 3 + channels + has_relief;
    std::uint16_t alive[kNumBlocks];  // pixels that still let light through
    std::uint32_t alive_blocks;
    T min_transmittance;  // a pixel is finished before it lets less light through

    [[gnu::always_inline]] inline explicit TileState(const TileTask<T>& task) {
        min_transmittance = static_cast<T>(task.params.min_transmittance);
        __builtin_memset(planes_, 0, sizeof planes_);
        T* all = light_[0];
        for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
        alive_blocks = open_pixels(task.params.width - task.x0, task.params.height - task.y0, alive);
    }

    // Of block b: what passes its strokes so far, the transmittance, and sum k of weight x red, green, blue, each
    // attribute, height. [kBlockPixels]
    [[gnu::always_inline]] inline T* light(int b) { return light_[b]; }
    [[gnu::always_inline]] inline const T* light(int b) const { return light_[b]; }
    [[gnu::always_inline]] inline T* plane(int k, int b) { return planes_[k][b]; }
    [[gnu::always_inline]] inline const T* plane(int k, int b) const { return planes_[k][b]; }

private:
    alignas(64) T light_[kNumBlocks][kBlockPixels];
    alignas(64) T planes_[num_planes][kNumBlocks][kBlockPixels];
};

// Four pixels of one row of a block: three runs of four become twelve interleaved values.
template <class T>
[[gnu::always_inline]] inline void interleave(const T* red, const T* green, const T* blue, T* rgb) {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    Four r, g, b;
    __builtin_memcpy(&r, red, sizeof r);
    __builtin_memcpy(&g, green, sizeof g);
    __builtin_memcpy(&b, blue, sizeof b);
    const Four rg = __builtin_shufflevector(r, g, 0, 4, 1, 5), rg_high = __builtin_shufflevector(r, g, 2, 6, 3, 7);
    const Four first = __builtin_shufflevector(rg, b, 0, 1, 4, 2);
    const Four second = __builtin_shufflevector(__builtin_shufflevector(rg, b, 3, 5, 3, 5), rg_high, 0, 1, 4, 5);
    const Four third = __builtin_shufflevector(rg_high, b, 6, 2, 3, 7);
    __builtin_memcpy(rgb, &first, sizeof first);
    __builtin_memcpy(rgb + 4, &second, sizeof second);
    __builtin_memcpy(rgb + 8, &third, sizeof third);
}

// Four pixels of block b, from p on, to four of the picture.
template <class T, int channels, bool has_relief>
[[gnu::always_inline]] inline void write_four(const TileState<T, channels, has_relief>& tile, int b, int p,
                                              const Picture<T>& picture, std::size_t pixel) {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    interleave(tile.plane(0, b) + p, tile.plane(1, b) + p, tile.plane(2, b) + p, picture.rgb + 3 * pixel);
    Four transmittance;
    __builtin_memcpy(&transmittance, tile.light(b) + p, sizeof transmittance);
    const Four opaque = T(1) - transmittance;
    __builtin_memcpy(picture.alpha + pixel, &opaque, sizeof opaque);
    for (int c = 0; c < channels; ++c) {
        Four sum;
        __builtin_memcpy(&sum, tile.plane(3 + c, b) + p, sizeof sum);
        const Four mean = opaque > 0 ? sum / opaque : Four{};
        const Channel<T> layer = picture.layers.channels[c];
        T* const to = layer.values + pixel * layer.stride;
        if (layer.stride == 1)
            __builtin_memcpy(to, &mean, sizeof mean);
        else
            for (int i = 0; i < 4; ++i) to[static_cast<std::size_t>(i) * layer.stride] = mean[i];
    }
    if constexpr (has_relief) __builtin_memcpy(picture.height + pixel, tile.plane(3 + channels, b) + p, sizeof opaque);
}

// The first `count` of four pixels, where the picture ends within a block.
template <class T, int channels, bool has_relief>
void write_some(const TileState<T, channels, has_relief>& tile, int b, int p, const Picture<T>& picture,
                std::size_t pixel, int count) {
    for (int i = p; i < p + count; ++i, ++pixel) {
        for (int k = 0; k < 3; ++k) picture.rgb[3 * pixel + static_cast<std::size_t>(k)] = tile.plane(k, b)[i];
        const T opaque = 1 - tile.light(b)[i];
        picture.alpha[pixel] = opaque;
        for (int c = 0; c < channels; ++c) {
            const Channel<T> layer = picture.layers.channels[c];
            layer.values[pixel * layer.stride] = opaque > 0 ? tile.plane(3 + c, b)[i] / opaque : 0;
        }
        if constexpr (has_relief) picture.height[pixel] = tile.plane(3 + channels, b)[i];
    }
}

// The picture by value: what lies behind a reference would be read anew after every store.
template <class T, int channels, bool has_relief>
void write_tile(const TileTask<T>& task, const TileState<T, channels, has_relief>& tile, const Picture<T> picture) {
    const int width = task.params.width, height = task.params.height, x0 = task.x0, y0 = task.y0;
    const int num_columns = width - x0 < kTileWidth ? width - x0 : kTileWidth;
    const int num_rows = height - y0 < kTileHeight ? height - y0 : kTileHeight;
    for (int y = 0; y < num_rows; ++y) {
        const std::size_t first =
            static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x0);
        const int first_block = y / kBlockSize * kBlockColumns, p = y % kBlockSize * kBlockSize;
        int x = 0;
        for (; x + kBlockSize <= num_columns; x += kBlockSize)
            write_four(tile, first_block + x / kBlockSize, p, picture, first + static_cast<std::size_t>(x));
        if (x < num_columns)
            write_some(tile, first_block + x / kBlockSize, p, Picture<T>(picture), first + static_cast<std::size_t>(x),
                       num_columns - x);
    }
}

}  // namespace brushgs::BRUSHGS_ISA
