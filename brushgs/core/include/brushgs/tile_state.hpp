// The pixels of one tile while it is painted, and how they become a part of the picture.
//
// Compiled once per instruction set, see CMakeLists.txt. `channels` is the number of channels of the picture's layers;
// `has_relief` says whether the picture has a height.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/sampling.hpp"

namespace brushgs::BRUSHGS_ISA {

// What is known of a record's color at each pixel of a tile.
enum class Shading {
    none,     // nothing: it is that of the record
    streaks,  // the factor of it
    tints     // it itself, red, green and blue
};
constexpr int num_shades(Shading shading) {
    return shading == Shading::tints ? 3 : (shading == Shading::streaks ? 1 : 0);
}

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

// Prefetches record i of a tile: records are in depth order, so those of a tile are far apart in memory.
template <class T, int channels>
[[gnu::always_inline]] inline void prefetch(const TileTask<T>& task, const Attributes<T, channels>& attributes,
                                            std::size_t i) {
    constexpr std::size_t ahead = 4;
    const std::uint32_t id = task.ids[i + ahead < task.num_ids ? i + ahead : i];
    __builtin_prefetch(&task.records[id]);
    for (int c = 0; c < channels; ++c)
        __builtin_prefetch(attributes.columns[c].values + id * attributes.columns[c].stride);
}

// One block of 4 x 4 pixels after another, so that the data of a block are contiguous.
template <class T, int channels, bool has_relief = false>
struct TileState {
    static constexpr int num_planes = 3 + channels + has_relief;
    std::uint16_t alive[kNumBlocks];  // pixels that still let light through
    std::uint32_t alive_blocks;
    T min_transmittance;  // a pixel is finished before it lets less light through

    // With fewer planes in use than there are, the others are not to be read.
    [[gnu::always_inline]] inline explicit TileState(const TileTask<T>& task, int num_used = num_planes) {
        min_transmittance = static_cast<T>(task.params.min_transmittance);
        for (Block& block : blocks_) {
            for (T& pixel : block.light) pixel = 1;
            __builtin_memset(block.planes, 0, static_cast<std::size_t>(num_used) * sizeof block.planes[0]);
        }
        alive_blocks = open_pixels(task.params.width - task.x0, task.params.height - task.y0, alive);
    }

    // Of block b: the transmittance of its strokes so far, and sum k of weight x red, green, blue, each attribute,
    // height. [kBlockPixels]
    [[gnu::always_inline]] inline T* light(int b) { return blocks_[b].light; }
    [[gnu::always_inline]] inline const T* light(int b) const { return blocks_[b].light; }
    [[gnu::always_inline]] inline T* plane(int k, int b) { return blocks_[b].planes[k]; }
    [[gnu::always_inline]] inline const T* plane(int k, int b) const { return blocks_[b].planes[k]; }

private:
    struct alignas(64) Block {
        T light[kBlockPixels], planes[num_planes][kBlockPixels];
    };
    Block blocks_[kNumBlocks];
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

// A tile in rows, as it goes into the picture.
template <class T, int channels, bool has_relief>
struct TileRows {
    alignas(64) T rgb[kTileHeight][3 * kTileWidth];
    alignas(64) T alpha[kTileHeight][kTileWidth];
    alignas(64) T layers[channels > 0 ? channels : 1][kTileHeight][kTileWidth];
    alignas(64) T height[has_relief ? kTileHeight : 1][kTileWidth];

    [[gnu::always_inline]] inline TileRows(const TileState<T, channels, has_relief>& tile, const Picture<T>& picture) {
        for (int b = 0; b < kNumBlocks; ++b)
            for (int row = 0; row < kBlockSize; ++row)
                take_four(tile, picture, b, row * kBlockSize, b / kBlockColumns * kBlockSize + row,
                          b % kBlockColumns * kBlockSize);
    }

private:
    // Four pixels of block b, from p on, to (x, y).
    [[gnu::always_inline]] inline void take_four(const TileState<T, channels, has_relief>& tile,
                                                 const Picture<T>& picture, int b, int p, int y, int x) {
        using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
        interleave(tile.plane(0, b) + p, tile.plane(1, b) + p, tile.plane(2, b) + p, rgb[y] + 3 * x);
        Four transmittance;
        __builtin_memcpy(&transmittance, tile.light(b) + p, sizeof transmittance);
        const Four opaque = T(1) - transmittance;
        __builtin_memcpy(alpha[y] + x, &opaque, sizeof opaque);
        for (int c = 0; c < channels && c < picture.layers.count; ++c) {
            Four sum;
            __builtin_memcpy(&sum, tile.plane(3 + c, b) + p, sizeof sum);
            const Four mean = opaque > 0 ? sum / opaque : Four{};
            __builtin_memcpy(layers[c][y] + x, &mean, sizeof mean);
        }
        if (has_relief && picture.height != nullptr)
            __builtin_memcpy(height[y] + x, tile.plane(3 + channels, b) + p, sizeof opaque);
    }
};

// Calls `work(y, pixel, count)` for the rows y of a tile that lie in the planes: `count` pixels from `pixel` on.
template <class T, class Work>
[[gnu::always_inline]] inline void for_rows(const TileTask<T>& task, const Work& work) {
    const int right = task.params.right(), bottom = task.params.bottom(), x0 = task.x0, y0 = task.y0;
    const int num_columns = right - x0 < kTileWidth ? right - x0 : kTileWidth;
    const int num_rows = bottom - y0 < kTileHeight ? bottom - y0 : kTileHeight;
    std::size_t pixel = task.params.place(x0, y0);
    const std::size_t row_length = task.params.row_length();
    for (int y = 0; y < num_rows; ++y, pixel += row_length) work(y, pixel, num_columns);
}

template <class T>
[[gnu::always_inline]] inline void copy_row(T* to, const T* from, int count) {
    using L = Lanes<T>;
    int k = 0;
    for (; k + L::width <= count; k += L::width) L::store(to + k, L::load(from + k));
    for (; k < count; ++k) to[k] = from[k];
}

// A row of pixels of some planes; null where there is none.
template <class T>
struct PlanesRow {
    T* rgb;
    T* alpha;
    T* layers[kMostChannels];
    std::size_t strides[kMostChannels];
    T* height;
};

// Lays a row of a tile, `front`, over the same row of the picture, into `front`.
template <class T>
[[gnu::noinline]] void lay_row(const PlanesRow<T>& front, const PlanesRow<T>& back, T hidden, int count) {
    T passed[3 * kTileWidth];  // light, of each color
    for (int x = 0; x < count; ++x)
        for (int c = 0; c < 3; ++c) passed[3 * x + c] = 1 - front.alpha[x];
    for (int k = 0; k < 3 * count; ++k) front.rgb[k] = back.rgb[k] * passed[k] + front.rgb[k];
    if (front.height != nullptr)
        for (int x = 0; x < count; ++x)
            front.height[x] = back.height[x] * (1 - hidden * front.alpha[x]) + front.height[x];
    for (int c = 0; c < kMostChannels; ++c) {
        if (front.layers[c] == nullptr) continue;
        for (int x = 0; x < count; ++x) {
            const T behind = back.alpha[x] * (1 - front.alpha[x]), all = behind + front.alpha[x];
            const T below = back.layers[c][static_cast<std::size_t>(x) * back.strides[c]];
            const T sum = below * behind + front.alpha[x] * front.layers[c][x];
            front.layers[c][x] = all > 0 ? sum / all : sum;
        }
    }
    for (int x = 0; x < count; ++x) front.alpha[x] = back.alpha[x] * (1 - front.alpha[x]) + front.alpha[x];
}

// Through rows: fetching a line of the picture takes long, and with fewer stores per line more lines are fetched at
// once. A picture of 250 strokes takes 13 % less time. The picture by value: through a reference it would be reloaded
// after every store. The tile may have more planes than the picture.
template <class T, int channels, bool has_relief>
void write_tile(const TileTask<T>& task, const TileState<T, channels, has_relief>& tile, const Picture<T> picture) {
    TileRows<T, channels, has_relief> rows(tile, picture);
    const bool writes_height = has_relief && picture.height != nullptr;
    for_rows(task, [&](int y, std::size_t pixel, int count) {
        if (picture.lays) {
            PlanesRow<T> front{rows.rgb[y], rows.alpha[y], {}, {}, writes_height ? rows.height[y] : nullptr};
            PlanesRow<T> back{picture.rgb + 3 * pixel,
                              picture.alpha + pixel,
                              {},
                              {},
                              writes_height ? picture.height + pixel : nullptr};
            for (int c = 0; c < channels && c < picture.layers.count; ++c) {
                const Channel<T> layer = picture.layers.channels[c];
                front.layers[c] = rows.layers[c][y];
                back.layers[c] = layer.values + pixel * layer.stride;
                back.strides[c] = layer.stride;
            }
            lay_row(front, back, picture.hidden, count);
        }
        copy_row(picture.rgb + 3 * pixel, rows.rgb[y], 3 * count);
        copy_row(picture.alpha + pixel, rows.alpha[y], count);
        for (int c = 0; c < channels && c < picture.layers.count; ++c) {
            const Channel<T> layer = picture.layers.channels[c];
            T* const to = layer.values + pixel * layer.stride;
            if (layer.stride == 1)
                copy_row(to, rows.layers[c][y], count);
            else
                for (int x = 0; x < count; ++x) to[static_cast<std::size_t>(x) * layer.stride] = rows.layers[c][y][x];
        }
        if (writes_height) copy_row(picture.height + pixel, rows.height[y], count);
    });
}

// A tile without strokes.
template <class T>
void clear_tile(const TileTask<T>& task, const Picture<T> picture) {
    if (picture.lays) return;
    for_rows(task, [&](int, std::size_t pixel, int count) {
        const std::size_t bytes = static_cast<std::size_t>(count) * sizeof(T);
        __builtin_memset(picture.rgb + 3 * pixel, 0, 3 * bytes);
        __builtin_memset(picture.alpha + pixel, 0, bytes);
        for (int c = 0; c < picture.layers.count; ++c) {
            const Channel<T> layer = picture.layers.channels[c];
            for (std::size_t x = 0; x < static_cast<std::size_t>(count); ++x)
                layer.values[(pixel + x) * layer.stride] = 0;
        }
        if (picture.height != nullptr) __builtin_memset(picture.height + pixel, 0, bytes);
    });
}

}  // namespace brushgs::BRUSHGS_ISA
