// Tiles in which very many fragments wait for each other, in soft order: see soft_crowd.hpp.
//
// First all fragments of the tile are kept, then each block is blended cell by cell. Compiled once per instruction set,
// see CMakeLists.txt.
#pragma once

#include <cstddef>
#include <cstdint>

#include "brushgs/soft_crowd.hpp"
#include "brushgs/soft_order.hpp"

namespace brushgs::BRUSHGS_ISA {

template <class T, Shading stored>
class CrowdBlender {
    using L = Lanes<T>;
    using Real = typename L::Real;
    using Tile = SoftTile<T>;
    static constexpr int W = L::width, num_parts = kBlockPixels / W;

public:
    CrowdBlender(const TileTask<T>& task, Crowd<T>& crowd, SoftState<T>& soft, Tile& tile)
        : records_(task.records),
          attributes_(task.boxes.layers),
          num_channels_(task.boxes.layers.count),
          crowd_(crowd),
          soft_(soft),
          tile_(tile) {}

    // Keeps the fragments of a record.
    [[gnu::noinline]] void add(const SoftSamples<T, stored>& samples) {
        const auto row = static_cast<std::uint32_t>(crowd_.ids.size());
        Real largest[num_parts];
        for (Real& part : largest) part = L::set(0);
        bool is_painted = false;
        for (std::uint32_t blocks = samples.blocks; blocks != 0; blocks &= blocks - 1) {
            const int b = __builtin_ctz(blocks);
            const unsigned pixels = samples.pixels[b] & static_cast<unsigned>(tile_.alive[b]);
            if (pixels == 0) continue;
            is_painted = true;
            CrowdBlock<T>& block = crowd_.blocks[b];
            if (block.count == block.capacity) grow(crowd_, block);
            const std::size_t place = block.count++;
            block.rows[place] = row;
            unsigned last = 0;
            for (int part = 0; part < num_parts; ++part) {
                const int lane = part * W;
                const Real alpha = L::where(L::from_bits(pixels >> lane), L::load(samples.alphas[b] + lane));
                const Real before = L::load(soft_.light[b] + lane), after = before - before * alpha;
                const auto all = L::from_bits(~0u);
                L::store(block.alphas.get() + kBlockPixels * place + lane, alpha);
                L::store(soft_.light[b] + lane, after);
                for (int c = 0; c < num_shades(stored); ++c)
                    L::store(shades_of(block, place, c) + lane,
                             L::load(samples.shades_of(b) + c * kNumBlocks * kBlockPixels + lane));
                if (crowd_.keeps_heights)
                    L::store(block.heights.get() + kBlockPixels * place + lane, L::load(samples.heights_of(b) + lane));
                largest[part] = L::select(L::less(all, largest[part], alpha), alpha, largest[part]);
                last |= L::bits(L::less(all, after, L::set(static_cast<T>(kLeastLight)))) << lane;
            }
            if (last != 0) finish_pixels(tile_, b, last);
        }
        if (!is_painted) return;
        alignas(64) T alphas[kBlockPixels];
        for (int part = 0; part < num_parts; ++part) L::store(alphas + part * W, largest[part]);
        T alpha = 0;
        for (const T one : alphas) alpha = alpha < one ? one : alpha;
        add_row(crowd_, samples.record.id, samples.record.depth, samples.record.squared_softness, alpha);
    }

    // Blends all stored fragments.
    [[gnu::noinline]] void finish() {
        plan_cells(crowd_);
        std::size_t passed[kNumBlocks] = {};             // fragments that lie in front of all cells to come
        alignas(64) T behind[kNumBlocks][kBlockPixels];  // the light that passes these
        for (auto& block : behind)
            for (T& pixel : block) pixel = 1;
        const CrowdCell* const cells = crowd_.cells.data();
        const std::size_t num_cells = crowd_.cells.size();
        for (std::size_t c = 0; c < num_cells; ++c) {
            const CrowdCell& cell = cells[c];
            find_shares(crowd_, cell);
            for (int b = 0; b < kNumBlocks; ++b) {
                const CrowdBlock<T>& block = crowd_.blocks[b];
                pass(block, cell.first, passed[b], behind[b]);
                Window window{passed[b], passed[b], 0};
                for (; window.end < block.count && block.rows[window.end] < cell.end; ++window.end)
                    if (crowd_.cell_of_row.data()[block.rows[window.end]] == c)
                        crowd_.own.data()[window.num_own++] = static_cast<std::uint32_t>(window.end);
                if (window.num_own > 0) blend(block, b, cell, window, behind[b]);
            }
        }
        for (std::uint16_t& pixels : soft_.shared) pixels = 0xFFFF;  // the weights of all are scaled
    }

private:
    // The places of a block with fragments that partly hide a cell, and how many of them belong to the cell.
    struct Window {
        std::size_t begin, end, num_own;
    };

    // Goes on to the first fragment of a row from `row` on.
    [[gnu::always_inline]] static inline void pass(const CrowdBlock<T>& block, std::uint32_t row, std::size_t& passed,
                                                   T (&behind)[kBlockPixels]) {
        std::size_t next = passed;
        while (next < block.count && block.rows[next] < row) ++next;
        for (int lane = 0; lane < kBlockPixels && next > passed; lane += W) {
            Real light = L::load(behind + lane);
            for (std::size_t k = passed; k < next; ++k)
                light = light - light * L::load(block.alphas.get() + kBlockPixels * k + lane);
            L::store(behind + lane, light);
        }
        passed = next;
    }

    // Adds the fragments of a cell in one block to the sums.
    void blend(const CrowdBlock<T>& block, int b, const CrowdCell& cell, const Window& window,
               const T (&behind)[kBlockPixels]) {
        const T* const shares = crowd_.shares.data();
        const std::uint8_t* const is_front = crowd_.is_front.data();
        const std::size_t stride = crowd_.stride;
        const T* const alphas = block.alphas.get();
        const std::uint32_t* const rows = block.rows.get();
        const std::uint32_t* const own = crowd_.own.data();
        const bool has_relief = crowd_.keeps_heights;
        for (int part = 0; part < num_parts; ++part) {
            const int lane = part * W;
            const Real passing = L::load(behind + lane);
            Real front = passing;  // the light that passes what lies wholly in front
            for (std::size_t k = window.begin; k < window.end; ++k)
                if (is_front[rows[k] - cell.first] != 0)
                    front = front - front * L::load(alphas + kBlockPixels * k + lane);
            Real lights[kMostPoints];
            for (std::size_t p = 0; p < cell.num_points; p += kDepthPoints) {
                Real light[kDepthPoints];
                for (Real& one : light) one = passing;
                const T* const first = shares + p * stride;
                for (std::size_t k = window.begin; k < window.end; ++k) {
                    const Real alpha = L::load(alphas + kBlockPixels * k + lane);
                    const T* const share = first + (rows[k] - cell.first);
                    for (std::size_t q = 0; q < kDepthPoints; ++q)
                        light[q] = light[q] - light[q] * (alpha * L::set(share[q * stride]));
                }
                for (std::size_t q = 0; q < kDepthPoints; ++q) lights[p + q] = light[q];
            }

            Real planes[Tile::num_planes];
            for (int k = 0; k < Tile::num_planes; ++k) planes[k] = L::load(tile_.plane(k, b) + lane);
            Real sum = L::load(soft_.weights[b] + lane), light = L::load(tile_.light(b) + lane);
            Real through = L::set(1);  // the light that passes the rows of a hard cell so far
            for (std::size_t i = 0; i < window.num_own; ++i) {
                const std::size_t place = own[i];
                const std::uint32_t row = rows[place], id = crowd_.ids.data()[row];
                const Real alpha = L::load(alphas + kBlockPixels * place + lane);
                Real seen;
                if (cell.is_direct) {
                    seen = lights[crowd_.point_of_row.data()[row]];
                } else {
                    const T* const factors = crowd_.factors.data() + kMostPoints * row;
                    seen = lights[0] * L::set(factors[0]);
                    for (std::size_t p = 1; p < cell.num_points; ++p) seen = seen + lights[p] * L::set(factors[p]);
                    if (cell.is_hard)
                        seen = seen * through;
                    else
                        seen = seen / (L::set(1) - alpha * L::set(T(0.5)));  // it does not hide itself
                }
                const auto painted = L::less(L::from_bits(~0u), L::set(0), alpha);
                const Real before = front * through;
                const auto kept = L::at_least(painted, before - before * alpha, L::set(tile_.min_transmittance));
                if (cell.is_hard) through = through - through * alpha;
                const Real weight = L::where(L::less(kept, L::set(0), seen), seen * alpha);
                Real of_color = weight;
                if constexpr (stored == Shading::streaks)
                    of_color = weight * L::load(shades_of(block, place, 0) + lane);
                const Record<T>& record = records_[id];
                for (int c = 0; c < 3; ++c) {
                    if constexpr (stored == Shading::tints)
                        planes[c] = planes[c] + weight * L::load(shades_of(block, place, c) + lane);
                    else
                        planes[c] = planes[c] + of_color * L::set(record.color[c]);
                }
                for (int c = 0; c < kMostChannels; ++c)
                    if (c < num_channels_) planes[3 + c] = planes[3 + c] + weight * L::set(attributes_.of(id, c));
                if (has_relief)
                    planes[Tile::num_planes - 1] = planes[Tile::num_planes - 1] +
                                                   weight * L::load(block.heights.get() + kBlockPixels * place + lane);
                sum = sum + weight;
                light = L::select(kept, light - light * alpha, light);
            }
            for (int k = 0; k < Tile::num_planes; ++k) L::store(tile_.plane(k, b) + lane, planes[k]);
            L::store(soft_.weights[b] + lane, sum);
            L::store(tile_.light(b) + lane, light);
        }
    }

    [[gnu::always_inline]] static inline T* shades_of(const CrowdBlock<T>& block, std::size_t place, int c) {
        return block.shades.get() + kBlockPixels * (num_shades(stored) * place + static_cast<std::size_t>(c));
    }

    const Record<T>* const records_;
    const Attributes<T, kMostChannels> attributes_;
    const int num_channels_;
    Crowd<T>& crowd_;
    SoftState<T>& soft_;
    Tile& tile_;
};

}  // namespace brushgs::BRUSHGS_ISA
