// The passes over fragments.
#include "brushgs/fragment_layers.hpp"

#include <algorithm>
#include <utility>

#include "brushgs/pixel_runs.hpp"

namespace brushgs {

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
    const std::size_t count = starts_of_counts(starts.get(), num_pixels);
    Shares<T> all{std::move(starts), make_buffer<std::int32_t>(count), make_buffer<T>(count), num_pixels, count};
    for (std::size_t item = 0, i = 0; item < found.size(); ++item)
        for (const Share& share : found[item]) {
            all.keys[i] = share.key;
            all.weights[i++] = share.weight;
        }
    return all;
}

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

#define BRUSHGS_INSTANTIATE(T)                                                               \
    template void sum_fragments(const FragmentView<T>&, const T*, std::size_t, int, T*);     \
    template Shares<T> share_fragments(const FragmentView<T>&, const std::int32_t*, T, int); \
    template void make_samples(const FragmentView<T>&, const MarkView<T>&, const Setting<T>&, int, const SamplesOut&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
