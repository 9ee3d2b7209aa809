// From the fragments of pixels to layers of a picture: means, what shows most, and samples for compositing.
// brushgs/rendering/layers.py says what they mean. One pass over the fragments each: NumPy needs many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "brushgs/coats.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

// The fragments of pixels, front to back: those of pixel i from starts[i] to starts[i + 1] - 1.
template <class T>
struct FragmentView {
    const std::int64_t* starts;         // [pixels + 1]
    const std::int32_t* marks;          // row of a table of marks
    const T* weights;                   // of the colour
    const T* shades;                    // by which the colour is multiplied
    const std::uint8_t* is_underpaint;  // 0 or 1
    std::size_t num_pixels;
};

// Sums over the fragments of each pixel of weight x values, [marks, channels], to sums [pixels, channels].
template <class T>
void sum_fragments(const FragmentView<T>& fragments, const T* values, std::size_t num_channels, int num_threads,
                   T* sums) {
    for_pixels(fragments.num_pixels, num_threads, [=](std::size_t first, std::size_t end) {
        for (std::size_t pixel = first; pixel < end; ++pixel) {
            T* const sum = sums + pixel * num_channels;
            std::fill_n(sum, num_channels, T(0));
            for (std::int64_t i = fragments.starts[pixel]; i < fragments.starts[pixel + 1]; ++i) {
                const T* const value = values + static_cast<std::size_t>(fragments.marks[i]) * num_channels;
                for (std::size_t c = 0; c < num_channels; ++c) sum[c] += fragments.weights[i] * value[c];
            }
        }
    });
}

// What pixels are covered by, most first: those of pixel i from starts[i] to starts[i + 1] - 1.
template <class T>
struct Shares {
    Buffer<std::int64_t> starts;  // [pixels + 1]
    Buffer<std::int32_t> keys;
    Buffer<T> weights;
    std::size_t num_pixels, count;
};

// The sums over the fragments of each pixel of their weights, by the keys [marks] of their marks; largest first, ties
// by key. The least are left out, as long as they are less than `least` together.
template <class T>
Shares<T> share_fragments(const FragmentView<T>& fragments, const std::int32_t* keys, T least, int num_threads) {
    struct Share {
        std::int32_t key;
        T weight;
    };
    const std::size_t num_pixels = fragments.num_pixels;
    std::vector<std::vector<Share>> found((num_pixels + kPixelsPerItem - 1) / kPixelsPerItem);
    Buffer<std::int64_t> starts = make_buffer<std::int64_t>(num_pixels + 1);
    for_pixels(num_pixels, num_threads, [&](std::size_t first_pixel, std::size_t end_pixel) {
        std::vector<Share>& shares = found[first_pixel / kPixelsPerItem];
        std::vector<Share> own;
        for (std::size_t pixel = first_pixel; pixel < end_pixel; ++pixel) {
            own.clear();
            for (std::int64_t i = fragments.starts[pixel]; i < fragments.starts[pixel + 1]; ++i) {
                const std::int32_t key = keys[fragments.marks[i]];
                const auto same = std::find_if(own.begin(), own.end(), [=](const Share& s) { return s.key == key; });
                if (same == own.end())
                    own.push_back({key, fragments.weights[i]});
                else
                    same->weight += fragments.weights[i];
            }
            std::sort(own.begin(), own.end(), [](const Share& a, const Share& b) {
                return a.weight > b.weight || (a.weight == b.weight && a.key < b.key);
            });
            T rest = 0;
            while (own.size() > 1 && rest + own.back().weight < least) {
                rest += own.back().weight;
                own.pop_back();
            }
            starts[pixel] = static_cast<std::int64_t>(own.size());
            shares.insert(shares.end(), own.begin(), own.end());
        }
    });
    std::int64_t total = 0;
    for (std::size_t pixel = 0; pixel <= num_pixels; ++pixel) {
        const std::int64_t count = pixel < num_pixels ? starts[pixel] : 0;
        starts[pixel] = total;
        total += count;
    }
    const auto count = static_cast<std::size_t>(total);
    Shares<T> all{std::move(starts), make_buffer<std::int32_t>(count), make_buffer<T>(count), num_pixels, count};
    for (std::size_t item = 0, i = 0; item < found.size(); ++item)
        for (const Share& share : found[item]) {
            all.keys[i] = share.key;
            all.weights[i++] = share.weight;
        }
    return all;
}

// What a sample takes of its mark.
template <class T>
struct MarkView {
    const T* colors;              // [marks, 3]
    const T* depths;              // [marks]
    const T* setbacks;            // [marks] how much further back underpaint lies
    const std::uint32_t* ids;     // [marks]
    const std::uint8_t* coats;    // [marks] row of `tints`
    std::vector<const T*> tints;  // [pixels, 3] each: of the glazes over a coat; null: none
};

// What lies behind the strokes of each pixel, and the light on all of it.
template <class T>
struct Setting {
    const T* rest_rgb;    // [pixels, 3] premultiplied; null: nothing
    const T* rest_alpha;  // [pixels]; with `rest_rgb`
    T rest_depth;
    const T* factors;  // [pixels] by which the lamp multiplies a colour; null: no lamp
    const T* shines;   // [pixels] which it adds, times alpha; with `factors`
};

// Where samples are written to, those of pixel i from starts[i] on: one for each fragment, and one where the rest has
// an alpha above 0.
struct SamplesOut {
    const std::int64_t* starts;  // [pixels]
    float* colors;               // [samples, 3] premultiplied
    float* alphas;               // [samples]
    float* depths;               // [samples] ascending within a pixel
    std::uint32_t* ids;          // [samples]
};

// Samples that, laid over each other, have the weights of the fragments.
template <class T>
void make_samples(const FragmentView<T>& fragments, const MarkView<T>& marks, const Setting<T>& setting,
                  int num_threads, const SamplesOut& out) {
    for_pixels(fragments.num_pixels, num_threads, [&](std::size_t first_pixel, std::size_t end_pixel) {
        for (std::size_t pixel = first_pixel; pixel < end_pixel; ++pixel) {
            const bool is_lit = setting.factors != nullptr;
            const T factor = is_lit ? setting.factors[pixel] : T(1), shine = is_lit ? setting.shines[pixel] : T(0);
            auto sample = static_cast<std::size_t>(out.starts[pixel]);
            float farthest = 0;
            const auto write = [&](const double(&rgb)[3], double alpha, T depth, std::uint32_t id) {
                for (std::size_t c = 0; c < 3; ++c)
                    out.colors[3 * sample + c] =
                        static_cast<float>(rgb[c] * static_cast<double>(factor) + alpha * static_cast<double>(shine));
                out.alphas[sample] = static_cast<float>(alpha);
                out.depths[sample] = farthest = std::max(farthest, static_cast<float>(depth));
                out.ids[sample++] = id;
            };
            double light = 1;  // behind the samples so far, as a reader of their alphas finds it
            for (std::int64_t i = fragments.starts[pixel]; i < fragments.starts[pixel + 1]; ++i) {
                const auto mark = static_cast<std::size_t>(fragments.marks[i]);
                const double weight = static_cast<double>(fragments.weights[i]);
                const double alpha = light > weight ? weight / light : 1;
                const T* const tint = marks.tints.empty() ? nullptr : marks.tints[marks.coats[mark]];
                double rgb[3];
                for (std::size_t c = 0; c < 3; ++c) {
                    const T shade = tint == nullptr ? fragments.shades[i] : fragments.shades[i] * tint[3 * pixel + c];
                    rgb[c] = alpha * static_cast<double>(shade * marks.colors[3 * mark + c]);
                }
                const T behind = fragments.is_underpaint[i] != 0 ? marks.setbacks[mark] : T(0);
                write(rgb, alpha, marks.depths[mark] + behind, marks.ids[mark]);
                light *= 1 - static_cast<double>(static_cast<float>(alpha));
            }
            if (setting.rest_rgb == nullptr || !(setting.rest_alpha[pixel] > 0)) continue;
            double rgb[3];
            for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<double>(setting.rest_rgb[3 * pixel + c]);
            write(rgb, static_cast<double>(setting.rest_alpha[pixel]), setting.rest_depth, 0);
        }
    });
}

}  // namespace brushgs
