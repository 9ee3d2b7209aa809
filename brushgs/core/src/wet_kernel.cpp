// The loops of a wet layer, compiled once per instruction set (see CMakeLists.txt): the compiler makes vectors of them.
// Nothing is reassociated, so all sets give the same bits.
#include "brushgs/wet.hpp"

#include <cmath>

#include "brushgs/logs.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr int kRun = 64;             // pixels whose numbers fit the stack, so that the loops become vectors
constexpr double kDeviation = 0.27;  // of the noise of one octave
constexpr double kLn2 = 0.693147180559945309417;
constexpr double kLuma[3] = {0.2126, 0.7152, 0.0722};
constexpr double kVeil = 0.1;                   // share of the paper that stays where an outline is lost
constexpr double kLeastColor = 0.02;            // pigments are never blacker
constexpr double kLargestCell = 1e9;            // lattice indices beyond are clamped
constexpr std::uint32_t kGolden = 0x9E3779B1u;  // a prime close to 2^32 / golden ratio
constexpr std::uint32_t kPrimes[3] = {0x8DA6B343u, 0xD8163841u, 0xCB1AB31Fu};
constexpr double kRounder = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to a whole number
constexpr double kGain = 1 / 0.6;                // amplitude of an octave over that of the next finer one

template <class T>
[[gnu::always_inline]] inline T within(T x, T least, T most) {
    const T above = x > least ? x : least;
    return above < most ? above : most;
}

template <class T>
[[gnu::always_inline]] inline T smoothstep(T x) {
    const T t = within<T>(x, 0, 1);
    return t * t * (3 - 2 * t);
}

template <class T>
[[gnu::always_inline]] inline T log_of(T x) {
    return log2_of<T>(x) * static_cast<T>(kLn2);
}

template <class T>
[[gnu::always_inline]] inline T exp_of(T x) {
    return exp2_of<T>(within<T>(x * static_cast<T>(1 / kLn2), -120, 120));
}

[[gnu::always_inline]] inline std::uint32_t mixed(std::uint32_t bits) {
    bits ^= bits >> 16;
    bits *= 0x7FEB352Du;
    bits ^= bits >> 15;
    bits *= 0x846CA68Bu;
    bits ^= bits >> 16;
    return bits;
}

// The product of the place with one of twelve directions: Perlin 2002.
template <class T>
[[gnu::always_inline]] inline T slope(std::uint32_t hash, T x, T y, T z) {
    const std::uint32_t h = hash & 15;
    const T u = h < 8 ? x : y;
    const T other = ((h == 12) | (h == 14)) ? x : z;
    const T v = h < 4 ? y : other;
    return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

template <class T>
[[gnu::always_inline]] inline T fade(T f) {
    return f * f * f * (f * (f * 6 - 15) + 10);
}

// Where the pixels of a run lie in the cells of an octave.
template <class T>
struct Cells {
    std::uint32_t at[3][kRun];  // hashes of the cells along each axis
    T parts[3][kRun];           // place in the cell, 0 to 1
};

// Adds noise of one octave, by weights.
template <class T>
[[gnu::always_inline]] inline void add_octave(const Cells<T>& cells, const std::uint32_t (&streams)[kRun],
                                              std::uint32_t flip, const T (&weights)[kRun], T (&sums)[kRun]) {
    for (int i = 0; i < kRun; ++i) {
        const T x = cells.parts[0][i], y = cells.parts[1][i], z = cells.parts[2][i];
        const T to_x = fade(x), to_y = fade(y), to_z = fade(z);
        const std::uint32_t near_x = cells.at[0][i], far_x = near_x + kPrimes[0];
        const std::uint32_t near_y = cells.at[1][i], far_y = near_y + kPrimes[1];
        const std::uint32_t near_z = cells.at[2][i] ^ streams[i] ^ flip;
        const std::uint32_t far_z = (cells.at[2][i] + kPrimes[2]) ^ streams[i] ^ flip;
        const T a = slope<T>(mixed(near_x ^ near_y ^ near_z), x, y, z);
        const T b = slope<T>(mixed(far_x ^ near_y ^ near_z), x - 1, y, z);
        const T c = slope<T>(mixed(near_x ^ far_y ^ near_z), x, y - 1, z);
        const T d = slope<T>(mixed(far_x ^ far_y ^ near_z), x - 1, y - 1, z);
        const T e = slope<T>(mixed(near_x ^ near_y ^ far_z), x, y, z - 1);
        const T f = slope<T>(mixed(far_x ^ near_y ^ far_z), x - 1, y, z - 1);
        const T g = slope<T>(mixed(near_x ^ far_y ^ far_z), x, y - 1, z - 1);
        const T h = slope<T>(mixed(far_x ^ far_y ^ far_z), x - 1, y - 1, z - 1);
        const T ab = a + to_x * (b - a), cd = c + to_x * (d - c);
        const T ef = e + to_x * (f - e), gh = g + to_x * (h - g);
        const T near_plane = ab + to_y * (cd - ab), far_plane = ef + to_y * (gh - ef);
        const T noise = near_plane + to_z * (far_plane - near_plane);
        sums[i] += weights[i] * (noise * static_cast<T>(1 / kDeviation));
    }
}

// 2^-n for whole numbers n.
[[gnu::always_inline]] inline double inverse_power(std::int32_t n) {
    const std::uint64_t bits = static_cast<std::uint64_t>(1023 - static_cast<std::int64_t>(n)) << 52;
    double power;
    __builtin_memcpy(&power, &bits, sizeof power);
    return power;
}

}  // namespace

template <class T>
void noise_row(const SpaceNoiseParams<T>& params, int y) {
    const std::size_t from = static_cast<std::size_t>(y) * static_cast<std::size_t>(params.width);
    const int octaves = params.octaves;
    for (int first = 0; first < params.width; first += kRun) {
        const int count = params.width - first < kRun ? params.width - first : kRun;
        const T* const depth = params.depth + from + static_cast<std::size_t>(first);
        T* const noise = params.noise + 3 * (from + static_cast<std::size_t>(first));
        bool is_empty = true;
        for (int i = 0; i < count; ++i) is_empty &= !(depth[i] > 0);
        if (is_empty) {
            for (int i = 0; i < 3 * count; ++i) noise[i] = 0;
            continue;
        }
        alignas(64) T depths[kRun], levels[kRun], distances[kRun];
        alignas(64) double points[3][kRun], scales[kRun];
        for (int i = 0; i < kRun; ++i) depths[i] = i < count && depth[i] > 0 ? depth[i] : T(1);
        for (int i = 0; i < kRun; ++i) {
            const double z = static_cast<double>(depths[i]), x = first + i + 0.5;
            double square = 0;
            for (int a = 0; a < 3; ++a) {
                points[a][i] =
                    z * (params.corner[a] + x * params.across[a] + (y + 0.5) * params.down[a]) + params.origin[a];
                const double apart = points[a][i] - params.focus[a];
                square += apart * apart;
            }
            distances[i] = static_cast<T>(std::sqrt(square) / params.reach);
            levels[i] = static_cast<T>(within(params.finest * z, 1e-30, 1e30));
        }
        alignas(64) std::int32_t whole[kRun];
        alignas(64) T parts[kRun], flow[kRun], slow[kRun], of_flow[kRun], of_slow[kRun], weights[kRun];
        for (int i = 0; i < kRun; ++i) {
            const T level = log2_of<T>(levels[i]);
            const std::int32_t n = static_cast<std::int32_t>(level);
            whole[i] = n - (level < static_cast<T>(n) ? 1 : 0);
            parts[i] = level - static_cast<T>(whole[i]);
            flow[i] = slow[i] = of_flow[i] = of_slow[i] = 0;
        }
        for (int i = 0; i < kRun; ++i) scales[i] = inverse_power(whole[i]);
        T amplitude = 1;
        for (int k = 0; k <= octaves + 1; ++k) {
            alignas(64) Cells<T> cells;
            alignas(64) std::uint32_t streams[kRun];
            const double smaller = inverse_power(k);
            for (int a = 0; a < 3; ++a)
                for (int i = 0; i < kRun; ++i) {
                    const double place = within(points[a][i] * (scales[i] * smaller), -kLargestCell, kLargestCell);
                    const double near = (place + kRounder) - kRounder;
                    const double cell = near > place ? near - 1 : near;
                    cells.parts[a][i] = static_cast<T>(place - cell);
                    cells.at[a][i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell)) * kPrimes[a];
                }
            for (int i = 0; i < kRun; ++i)
                streams[i] = mixed(params.seed + kGolden * static_cast<std::uint32_t>(whole[i] + k));
            if (k <= octaves) {
                for (int i = 0; i < kRun; ++i) {
                    const T share = k == 0 ? 1 - parts[i] : (k == octaves ? parts[i] : T(1));
                    weights[i] = amplitude * share;
                    of_flow[i] += weights[i] * weights[i];
                }
                add_octave(cells, streams, 0, weights, flow);
            }
            if (k >= octaves - 1) {
                for (int i = 0; i < kRun; ++i) {
                    const T apart = parts[i] < T(0.5) ? T(0.5) - parts[i] : parts[i] - T(0.5);
                    const T share = k == octaves - 1 ? 1 - parts[i] : (k == octaves ? T(1.5) - apart : parts[i]);
                    weights[i] = share * T(1 / 1.5);
                    of_slow[i] += weights[i] * weights[i];
                }
                add_octave(cells, streams, ~0u, weights, slow);
            }
            amplitude *= static_cast<T>(kGain);
        }
        for (int i = 0; i < kRun; ++i) {
            flow[i] /= std::sqrt(of_flow[i]);
            slow[i] /= std::sqrt(of_slow[i]);
        }
        for (int i = 0; i < count; ++i) {
            const bool is_there = depth[i] > 0;
            noise[3 * i] = is_there ? flow[i] : T(0);
            noise[3 * i + 1] = is_there ? slow[i] : T(0);
            noise[3 * i + 2] = is_there ? distances[i] : T(0);
        }
    }
}

namespace {

// Weights of a pixel for the one before it: the steps of a guide between them hold the smoothing back.
template <class T>
[[gnu::always_inline]] inline void weights_of(const T* __restrict__ own, const T* __restrict__ before,
                                              const T* __restrict__ hold, T rate, int count, T* __restrict__ weights) {
    for (int x = 0; x < count; ++x) {
        const T red = own[3 * x] - before[3 * x], green = own[3 * x + 1] - before[3 * x + 1],
                blue = own[3 * x + 2] - before[3 * x + 2];
        const T step = (red > 0 ? red : -red) + (green > 0 ? green : -green) + (blue > 0 ? blue : -blue);
        weights[x] = exp2_of<T>(within<T>(rate * (1 + hold[x] * step), -120, 0));
    }
}

template <class T, int C>
void smooth_rows_of(const SmoothParams<T>& params, double sigma, int first, int end, T* memory) {
    const auto width = static_cast<std::size_t>(params.width);
    const T rate = static_cast<T>(-std::sqrt(2.0) / (sigma * kLn2));
    const T flat = exp2_of<T>(rate > -120 ? rate : -120);
    const int rows = end - first;
    T* planes[4];
    const T* weights[4];
    for (int r = 0; r < 4; ++r) {  // the last row stands for those that are missing
        const int row = r < rows ? r : rows - 1;
        const std::size_t from = static_cast<std::size_t>(first + row) * width;
        planes[r] = params.planes + from * C;
        T* const own = memory + static_cast<std::size_t>(row) * width;
        weights[r] = own;
        if (r != row) continue;
        own[0] = 0;
        if (params.guide == nullptr)
            for (std::size_t x = 1; x < width; ++x) own[x] = flat;
        else
            weights_of(params.guide + 3 * (from + 1), params.guide + 3 * from, params.hold + from + 1, rate,
                       params.width - 1, own + 1);
    }
    if (rows == 4) {
        for (std::size_t x = 1; x < width; ++x)
            for (int r = 0; r < 4; ++r)
                for (int c = 0; c < C; ++c) {
                    T* const at = planes[r] + x * C + c;
                    *at += weights[r][x] * (at[-C] - *at);
                }
        for (std::size_t x = width - 1; x > 0; --x)
            for (int r = 0; r < 4; ++r)
                for (int c = 0; c < C; ++c) {
                    T* const at = planes[r] + (x - 1) * C + c;
                    *at += weights[r][x] * (at[C] - *at);
                }
        return;
    }
    for (int r = 0; r < rows; ++r) {
        for (std::size_t x = 1; x < width; ++x)
            for (int c = 0; c < C; ++c) {
                T* const at = planes[r] + x * C + c;
                *at += weights[r][x] * (at[-C] - *at);
            }
        for (std::size_t x = width - 1; x > 0; --x)
            for (int c = 0; c < C; ++c) {
                T* const at = planes[r] + (x - 1) * C + c;
                *at += weights[r][x] * (at[C] - *at);
            }
    }
}

// A row of a strip moves towards the one before it, by weights of each of its numbers.
template <class T>
[[gnu::always_inline]] inline void move_row(T* __restrict__ own, const T* __restrict__ before,
                                            const T* __restrict__ weights, int count) {
    for (int i = 0; i < count; ++i) own[i] += weights[i] * (before[i] - own[i]);
}

template <class T, int C>
void smooth_columns_of(const SmoothParams<T>& params, double sigma, int first, int end, T* memory) {
    const auto width = static_cast<std::size_t>(params.width);
    const T rate = static_cast<T>(-std::sqrt(2.0) / (sigma * kLn2));
    const T flat = exp2_of<T>(rate > -120 ? rate : -120);
    const int columns = end - first, count = columns * C;
    T* const narrow = memory;
    T* const weights = memory + columns;
    const auto at = [&](int y) {
        return params.planes + (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(first)) * C;
    };
    for (int y = 1; y < params.height; ++y) {
        T* const wide = weights + static_cast<std::size_t>(y) * static_cast<std::size_t>(count);
        if (params.guide == nullptr) {
            for (int i = 0; i < count; ++i) wide[i] = flat;
        } else {
            const std::size_t own = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(first);
            weights_of(params.guide + 3 * own, params.guide + 3 * (own - width), params.hold + own, rate, columns,
                       narrow);
            for (int x = 0; x < columns; ++x)
                for (int c = 0; c < C; ++c) wide[C * x + c] = narrow[x];
        }
        move_row(at(y), at(y - 1), wide, count);
    }
    for (int y = params.height - 1; y > 0; --y)
        move_row(at(y - 1), at(y), weights + static_cast<std::size_t>(y) * static_cast<std::size_t>(count), count);
}

}  // namespace

template <class T>
void smooth_rows(const SmoothParams<T>& params, double sigma, int first, int end, T* memory) {
    if (params.channels == 3)
        smooth_rows_of<T, 3>(params, sigma, first, end, memory);
    else
        smooth_rows_of<T, 1>(params, sigma, first, end, memory);
}

template <class T>
void smooth_columns(const SmoothParams<T>& params, double sigma, int first, int end, T* memory) {
    if (params.channels == 3)
        smooth_columns_of<T, 3>(params, sigma, first, end, memory);
    else
        smooth_columns_of<T, 1>(params, sigma, first, end, memory);
}

namespace {

// Numbers of the pixels of a run, by channel, from a picture with C of them; those after the last are those of the
// last.
template <class T, int C>
[[gnu::always_inline]] inline void load(const T* from, int count, T (&to)[C][kRun]) {
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < C; ++c) to[c][i] = from[C * i + c];
    for (int c = 0; c < C; ++c)
        for (int i = count; i < kRun; ++i) to[c][i] = to[c][count - 1];
}

template <class T, int C>
[[gnu::always_inline]] inline void store(const T (&from)[C][kRun], int count, T* to) {
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < C; ++c) to[C * i + c] = from[c][i];
}

template <class T>
void key_run(const KeyParams<T>& params, std::size_t first, int count) {
    const T least = static_cast<T>(kLeastColor), over_range = 1 / (params.high - params.low);
    const T low = params.low, darkest = params.darkest, gamma = params.gamma, chroma = params.chroma;
    const T solid = params.solid;
    alignas(64) T rgb[3][kRun], alphas[1][kRun], wanted[kRun], factors[kRun], sums[kRun];
    load(params.rgb + 3 * first, count, rgb);
    load(params.alpha + first, count, alphas);
    for (int i = 0; i < kRun; ++i) sums[i] = 0;
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i) {
            const T alpha = alphas[0][i];
            const T straight = alpha > 0 ? rgb[c][i] / alpha : T(1);
            const T color = within<T>(straight, least, 1);
            sums[i] += static_cast<T>(kLuma[c]) * color;
            rgb[c][i] = -log_of(color);
        }
    for (int i = 0; i < kRun; ++i) {
        const T level = within<T>((sums[i] - low) * over_range, T(1e-4), 1);
        const T light = darkest + (1 - darkest) * exp2_of<T>(gamma * log2_of(level));
        const T own = -log_of(sums[i]);
        wanted[i] = -log_of(light);
        factors[i] = wanted[i] / (own > T(1e-3) ? own : T(1e-3));
        sums[i] = (rgb[0][i] + rgb[1][i] + rgb[2][i]) * (factors[i] / 3);
    }
    alignas(64) T found[kRun];
    for (int i = 0; i < kRun; ++i) found[i] = 0;
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i) {
            const T strong = sums[i] + chroma * (rgb[c][i] * factors[i] - sums[i]);
            rgb[c][i] = strong > 0 ? strong : 0;
            found[i] += static_cast<T>(kLuma[c]) * exp_of(-rgb[c][i]);
        }
    for (int i = 0; i < kRun; ++i) {
        const T is = -log_of(found[i]), again = wanted[i] / (is > T(1e-3) ? is : T(1e-3));
        factors[i] = again < 2 ? again : 2;
    }
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i)
            rgb[c][i] = 1 - smoothstep<T>(solid * alphas[0][i]) * (1 - exp_of(-rgb[c][i] * factors[i]));
    store(rgb, count, params.keyed + 3 * first);
}

template <class T>
void part_run(const WashParams<T>& params, const WashNumbers<T>& n, std::size_t first, int count) {
    const T* const pictures[3] = {params.coarse + 3 * first, params.middle + 3 * first, params.fine + 3 * first};
    const T least = static_cast<T>(kLeastColor);
    alignas(64) T noise[3][kRun], colors[3][kRun], tones[kRun], factors[kRun];
    alignas(64) T laid[9][kRun], means[3][kRun], done[3][kRun];
    load(params.noise + 3 * first, count, noise);
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i) done[c][i] = 0;
    for (int wash = 0; wash < 3; ++wash) {
        load(pictures[wash], count, colors);
        for (int i = 0; i < kRun; ++i) tones[i] = T(1e-4);
        for (int c = 0; c < 3; ++c)
            for (int i = 0; i < kRun; ++i) {
                colors[c][i] = -log_of(within<T>(colors[c][i], least, 1));
                tones[i] += static_cast<T>(kLuma[c]) * colors[c][i];
            }
        for (int i = 0; i < kRun; ++i) factors[i] = 1;
        if (wash > 0) {
            const T step = n.steps[wash - 1], hardness = n.hardness[wash - 1], share = n.masses[wash - 1];
            const T wander = n.wander, at_focus = n.at_focus;
            for (int i = 0; i < kRun; ++i) {
                const T place = tones[i] / step + wander * noise[0][i] + 64;  // > 0, so that it can be cut
                const T whole = static_cast<T>(static_cast<std::int32_t>(place));
                const T level = whole - 64 + smoothstep<T>((place - whole - T(0.5)) * hardness + T(0.5));
                const T change = within<T>(level * step / tones[i], T(0.6), T(1.5)) - 1;
                factors[i] = 1 + share * (1 - at_focus * noise[2][i]) * change;
            }
        }
        if (wash == 1)
            for (int i = 0; i < count; ++i) params.tones[first + static_cast<std::size_t>(i)] = tones[i] * factors[i];
        for (int c = 0; c < 3; ++c) {
            T* const own = laid[3 * wash + c];
            for (int i = 0; i < kRun; ++i) {
                const T missing = n.shares[wash] * colors[c][i] * factors[i] - done[c][i];
                own[i] = missing > 0 ? missing : 0;
                done[c][i] += own[i];
            }
        }
        for (int i = 0; i < kRun; ++i)
            means[wash][i] = (laid[3 * wash][i] + laid[3 * wash + 1][i] + laid[3 * wash + 2][i]) * T(1.0 / 3);
    }
    store(laid, count, params.densities + 9 * first);
    store(means, count, params.means + 3 * first);
}

template <class T>
void mix_run(const MixParams<T>& params, const WashNumbers<T>& n, std::size_t first, int count) {
    alignas(64) T densities[9][kRun], means[3][kRun], blurred[3][kRun], noise[3][kRun], factors[3][kRun];
    alignas(64) T tones[1][kRun], alphas[1][kRun], grains[1][kRun], more[1][kRun], outline[2][kRun], shares[kRun],
        kept[kRun], darkest[kRun];
    load(params.densities + 9 * first, count, densities);
    load(params.means + 3 * first, count, means);
    load(params.blurred + 3 * first, count, blurred);
    load(params.noise + 3 * first, count, noise);
    load(params.tones + first, count, tones);
    load(params.alpha + first, count, alphas);
    for (int i = 0; i < kRun; ++i) grains[0][i] = T(0.5);
    if (params.grain != nullptr) load(params.grain + first, count, grains);
    for (int wash = 0; wash < 3; ++wash)
        for (int i = 0; i < kRun; ++i) {
            const T gathered = (means[wash][i] - blurred[wash][i]) / (means[wash][i] + T(0.15));
            factors[wash][i] = 1 + n.rims[wash] * within<T>(gathered, 0, T(0.5));
        }
    for (int i = 0; i < kRun; ++i) {
        const T flow = noise[0][i], slow = noise[1][i], grain = (T(0.5) - grains[0][i]) * T(1 / 0.24);
        const T dip = (slow - n.dips[1]) / n.dips[2], crest = (slow - n.crests[1]) / n.crests[2];
        const T backruns =
            1 - n.dips[0] * exp_of(-dip * dip) + n.crests[0] * exp_of(-crest * crest) * (1 - noise[2][i]);
        factors[0][i] *= (1 + n.flows[0] * flow) * backruns;
        factors[1][i] *= 1 + n.flows[1] * flow;
        const T thick = within<T>((means[0][i] + means[1][i]) * T(1.3), T(0.12), 1) * (1 - n.at_focus * noise[2][i]);
        const T limit = n.light[0] + n.light_noise[0] * grain + n.light_noise[1] * flow;
        shares[i] = (1 + n.grain * grain * thick) * (1 - smoothstep<T>((limit - tones[0][i]) / n.light[1]));
    }
    for (int i = 0; i < kRun; ++i) kept[i] = 1;
    if (params.soft != nullptr) {
        load(params.soft + 2 * first, count, outline);
        for (int i = 0; i < kRun; ++i) {
            const T score =
                n.lost[2] * noise[1][i] - n.lost[3] * noise[2][i] + n.lost[4] * outline[1][i] - n.lost[5] * tones[0][i];
            const T lost = smoothstep<T>((score - n.lost[0]) / n.lost[1]);
            kept[i] = 1 - lost * (1 - smoothstep<T>(2 * outline[0][i] - 1));
            shares[i] *= kept[i];
        }
    }
    if (params.border != nullptr) {
        load(params.border + first, count, more);
        for (int i = 0; i < kRun; ++i) shares[i] *= more[0][i];
    }
    for (int i = 0; i < kRun; ++i) darkest[i] = 1;
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i) {
            const T sum = densities[c][i] * factors[0][i] + densities[3 + c][i] * factors[1][i] +
                          densities[6 + c][i] * factors[2][i];
            const T tint = exp_of(-within<T>(sum * shares[i], 0, n.most));
            means[c][i] = tint;
            darkest[i] = tint < darkest[i] ? tint : darkest[i];
        }
    for (int i = 0; i < kRun; ++i) {
        const T cover = smoothstep<T>((alphas[0][i] - T(0.4)) * 2) * (T(kVeil) + T(1 - kVeil) * kept[i]);
        alphas[0][i] = 1 - (1 - cover) * darkest[i];
    }
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kRun; ++i) {
            const T seen = means[c][i] - 1 + alphas[0][i];
            means[c][i] = seen > 0 ? seen : 0;
        }
    if (params.paper != nullptr) {
        load(params.paper + 3 * first, count, blurred);
        for (int c = 0; c < 3; ++c)
            for (int i = 0; i < kRun; ++i) means[c][i] *= blurred[c][i];
    }
    store(means, count, params.rgb + 3 * first);
    store(alphas, count, params.covered + first);
}

template <class Work>
[[gnu::always_inline]] inline void for_runs(std::size_t first, std::size_t end, const Work& work) {
    for (; first < end; first += kRun) work(first, end - first < kRun ? static_cast<int>(end - first) : kRun);
}

}  // namespace

template <class T>
void key_pixels(const KeyParams<T>& params, std::size_t first, std::size_t end) {
    for_runs(first, end, [&](std::size_t from, int count) { key_run(params, from, count); });
}

template <class T>
void part_pixels(const WashParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end) {
    for_runs(first, end, [&](std::size_t from, int count) { part_run(params, n, from, count); });
}

template <class T>
void mix_pixels(const MixParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end) {
    for_runs(first, end, [&](std::size_t from, int count) { mix_run(params, n, from, count); });
}

#define BRUSHGS_INSTANTIATE(T)                                                                           \
    template void noise_row<T>(const SpaceNoiseParams<T>&, int);                                         \
    template void smooth_rows<T>(const SmoothParams<T>&, double, int, int, T*);                          \
    template void smooth_columns<T>(const SmoothParams<T>&, double, int, int, T*);                       \
    template void key_pixels<T>(const KeyParams<T>&, std::size_t, std::size_t);                          \
    template void part_pixels<T>(const WashParams<T>&, const WashNumbers<T>&, std::size_t, std::size_t); \
    template void mix_pixels<T>(const MixParams<T>&, const WashNumbers<T>&, std::size_t, std::size_t);
#ifdef BRUSHGS_IN_DOUBLE
BRUSHGS_INSTANTIATE(double)
#else
BRUSHGS_INSTANTIATE(float)
#endif
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs::BRUSHGS_ISA
