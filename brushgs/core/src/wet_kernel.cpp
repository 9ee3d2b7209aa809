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
constexpr double kLeastColor = 0.02;            // pigments are never blacker
constexpr double kLargestCell = 1e9;            // lattice indices beyond are clamped
constexpr std::uint32_t kGolden = 0x9E3779B1u;  // a prime close to 2^32 / golden ratio
constexpr double kGain = 1 / 0.6;               // amplitude of an octave over that of the next finer one

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
    const T other = (h == 12) | (h == 14) ? x : z;
    const T v = h < 4 ? y : other;
    return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

template <class T>
[[gnu::always_inline]] inline T fade(T f) {
    return f * f * f * (f * (f * 6 - 15) + 10);
}

// Noise of one octave at a place in its cells.
template <class T>
[[gnu::always_inline]] inline T octave(const double (&p)[3], std::uint32_t stream) {
    T f[3], s[3];
    std::uint32_t at[3], next[3];
    constexpr std::uint32_t primes[3] = {0x8DA6B343u, 0xD8163841u, 0xCB1AB31Fu};
    for (int a = 0; a < 3; ++a) {
        const double place = within(p[a], -kLargestCell, kLargestCell);
        std::int32_t cell = static_cast<std::int32_t>(place);
        cell -= place < cell ? 1 : 0;
        f[a] = static_cast<T>(place - cell);
        s[a] = fade(f[a]);
        at[a] = static_cast<std::uint32_t>(cell) * primes[a];
        next[a] = at[a] + primes[a];
    }
    T planes[2];
    for (int k = 0; k < 2; ++k) {
        const std::uint32_t of_z = (k ? next[2] : at[2]) ^ stream;
        const T z = f[2] - static_cast<T>(k);
        T lines[2];
        for (int j = 0; j < 2; ++j) {
            const std::uint32_t of_y = (j ? next[1] : at[1]) ^ of_z;
            const T y = f[1] - static_cast<T>(j);
            const T a = slope<T>(mixed(at[0] ^ of_y), f[0], y, z);
            const T b = slope<T>(mixed(next[0] ^ of_y), f[0] - 1, y, z);
            lines[j] = a + s[0] * (b - a);
        }
        planes[k] = lines[0] + s[1] * (lines[1] - lines[0]);
    }
    return (planes[0] + s[2] * (planes[1] - planes[0])) * static_cast<T>(1 / kDeviation);
}

[[gnu::always_inline]] inline double power_of_two(std::int32_t exponent) {
    const std::uint64_t bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(exponent) + 1023) << 52;
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
        double points[3][kRun];
        std::int32_t whole[kRun];
        T parts[kRun], flow[kRun], slow[kRun], squares[kRun], of_slow[kRun];
        for (int i = 0; i < count; ++i) {
            const double z = static_cast<double>(depth[i]);
            const double x = first + i + 0.5;
            double square = 0;
            for (int a = 0; a < 3; ++a) {
                points[a][i] =
                    z * (params.corner[a] + x * params.across[a] + (y + 0.5) * params.down[a]) + params.origin[a];
                const double apart = points[a][i] - params.focus[a];
                square += apart * apart;
            }
            noise[3 * i + 2] = static_cast<T>(std::sqrt(square) / params.reach);
            const double size = params.finest * (z > 0 ? z : 1);
            const T level = log2_of<T>(static_cast<T>(within(size, 1e-30, 1e30)));
            std::int32_t n = static_cast<std::int32_t>(level);
            n -= level < static_cast<T>(n) ? 1 : 0;
            whole[i] = n;
            parts[i] = level - static_cast<T>(n);
            flow[i] = slow[i] = squares[i] = of_slow[i] = 0;
        }
        T amplitude = 1;
        for (int k = 0; k <= octaves + 1; ++k) {
            const bool in_flow = k <= octaves, in_slow = k >= octaves - 1;
            for (int i = 0; i < count; ++i) {
                const double scale = power_of_two(-whole[i] - k);
                const double p[3] = {points[0][i] * scale, points[1][i] * scale, points[2][i] * scale};
                const std::uint32_t stream = mixed(params.seed + kGolden * static_cast<std::uint32_t>(whole[i] + k));
                const T t = parts[i];
                if (in_flow) {
                    const T share = k == 0 ? 1 - t : (k == octaves ? t : T(1));
                    const T weight = amplitude * share;
                    flow[i] += weight * octave<T>(p, stream);
                    squares[i] += weight * weight;
                }
                if (in_slow) {
                    const T middle = t < T(0.5) ? T(0.5) - t : t - T(0.5);
                    const T weight =
                        k == octaves - 1 ? (1 - t) / T(1.5) : (k == octaves ? 1 - middle / T(1.5) : t / T(1.5));
                    slow[i] += weight * octave<T>(p, ~stream);
                    of_slow[i] += weight * weight;
                }
            }
            amplitude *= static_cast<T>(kGain);
        }
        for (int i = 0; i < count; ++i) {
            const bool is_there = depth[i] > 0;
            noise[3 * i] = is_there ? flow[i] / std::sqrt(squares[i]) : T(0);
            noise[3 * i + 1] = is_there ? slow[i] / std::sqrt(of_slow[i]) : T(0);
            noise[3 * i + 2] = is_there ? noise[3 * i + 2] : T(0);
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

template <class T>
void key_pixels(const KeyParams<T>& params, std::size_t first, std::size_t end) {
    const T least = static_cast<T>(kLeastColor), range = params.high - params.low;
    for (std::size_t i = first; i < end; ++i) {
        const T alpha = params.alpha[i], over = alpha > 0 ? 1 / alpha : 0;
        const T empty = alpha > 0 ? 0 : 1;
        T densities[3], luma = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const T color = within<T>(params.rgb[3 * i + c] * over + empty, least, 1);
            luma += static_cast<T>(kLuma[c]) * color;
            densities[c] = -log_of(color);
        }
        const T level = within<T>((luma - params.low) / range, T(1e-4), 1);
        const T light = params.darkest + (1 - params.darkest) * exp2_of<T>(params.gamma * log2_of(level));
        const T wanted = -log_of(light), own = -log_of(luma);
        const T factor = wanted / (own > T(1e-3) ? own : T(1e-3));
        const T mean = (densities[0] + densities[1] + densities[2]) * (factor / 3);
        T found = 0;
        for (int c = 0; c < 3; ++c) {
            const T strong = mean + params.chroma * (densities[c] * factor - mean);
            densities[c] = strong > 0 ? strong : 0;
            found += static_cast<T>(kLuma[c]) * exp_of(-densities[c]);
        }
        const T is = -log_of(found), again = wanted / (is > T(1e-3) ? is : T(1e-3));
        const T most = again < 2 ? again : 2, cover = smoothstep<T>(params.solid * alpha);
        for (std::size_t c = 0; c < 3; ++c) params.keyed[3 * i + c] = 1 - cover * (1 - exp_of(-densities[c] * most));
    }
}

template <class T>
void part_pixels(const WashParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end) {
    const T least = static_cast<T>(kLeastColor);
    for (std::size_t i = first; i < end; ++i) {
        const T* const colors[3] = {params.coarse + 3 * i, params.middle + 3 * i, params.fine + 3 * i};
        const T flow = params.noise[3 * i], focus = params.noise[3 * i + 2];
        const T away = 1 - n.at_focus * focus;
        T done[3] = {0, 0, 0};
        for (int wash = 0; wash < 3; ++wash) {
            T densities[3], tone = T(1e-4);
            for (int c = 0; c < 3; ++c) {
                densities[c] = -log_of(within<T>(colors[wash][c], least, 1));
                tone += static_cast<T>(kLuma[c]) * densities[c];
            }
            T factor = 1;
            if (wash > 0) {
                const T place = tone / n.steps[wash - 1] + n.wander * flow + 64;  // > 0, so that it can be cut
                const T whole = static_cast<T>(static_cast<std::int32_t>(place));
                const T level = whole - 64 + smoothstep<T>((place - whole - T(0.5)) * n.hardness[wash - 1] + T(0.5));
                const T change = within<T>(level * n.steps[wash - 1] / tone, T(0.6), T(1.5)) - 1;
                factor = 1 + n.masses[wash - 1] * away * change;
            }
            if (wash == 1) params.tones[i] = tone * factor;
            T sum = 0;
            for (int c = 0; c < 3; ++c) {
                const T missing = n.shares[wash] * densities[c] * factor - done[c];
                const T laid = missing > 0 ? missing : 0;
                done[c] += laid;
                params.densities[9 * i + static_cast<std::size_t>(3 * wash + c)] = laid;
                sum += laid;
            }
            params.means[3 * i + static_cast<std::size_t>(wash)] = sum / 3;
        }
    }
}

template <class T>
void mix_pixels(const MixParams<T>& params, const WashNumbers<T>& n, std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
        const T flow = params.noise[3 * i], slow = params.noise[3 * i + 1], focus = params.noise[3 * i + 2];
        const T grain = params.grain == nullptr ? 0 : (T(0.5) - params.grain[i]) * T(1 / 0.24);
        const T dip = (slow - n.dips[1]) / n.dips[2], crest = (slow - n.crests[1]) / n.crests[2];
        const T backruns = 1 - n.dips[0] * exp_of(-dip * dip) + n.crests[0] * exp_of(-crest * crest) * (1 - focus);
        const T* const means = params.means + 3 * i;
        T factors[3];
        for (std::size_t wash = 0; wash < 3; ++wash) {
            const T gathered = (means[wash] - params.blurred[3 * i + wash]) / (means[wash] + T(0.15));
            factors[wash] = 1 + n.rims[wash] * within<T>(gathered, 0, T(0.5));
        }
        factors[0] *= (1 + n.flows[0] * flow) * backruns;
        factors[1] *= 1 + n.flows[1] * flow;
        const T thick = within<T>((means[0] + means[1]) * T(1.3), T(0.12), 1);
        const T light = smoothstep<T>(
            (n.light[0] + n.light_noise[0] * grain + n.light_noise[1] * flow - params.tones[i]) / n.light[1]);
        T share = (1 + n.grain * grain * thick) * (1 - light);
        if (params.soft != nullptr) {
            const T luma = exp_of(-params.tones[i]);
            const T lost = smoothstep<T>((luma - n.lost[0]) / n.lost[1] + n.lost[2] * slow) * (1 - T(0.8) * focus);
            share *= 1 - lost * (1 - within<T>(2 * params.soft[i] - 1, 0, 1));
        }
        if (params.border != nullptr) share *= params.border[i];
        T tints[3], darkest = 1;
        for (std::size_t c = 0; c < 3; ++c) {
            const T* const densities = params.densities + 9 * i + c;
            const T sum = densities[0] * factors[0] + densities[3] * factors[1] + densities[6] * factors[2];
            tints[c] = exp_of(-within<T>(sum * share, 0, n.most));
            darkest = tints[c] < darkest ? tints[c] : darkest;
        }
        const T cover = smoothstep<T>((params.alpha[i] - T(0.1)) * 2);
        const T alpha = 1 - (1 - cover) * darkest;
        params.covered[i] = alpha;
        for (std::size_t c = 0; c < 3; ++c) {
            const T seen = tints[c] - 1 + alpha, above = seen > 0 ? seen : 0;
            params.rgb[3 * i + c] = params.paper == nullptr ? above : above * params.paper[3 * i + c];
        }
    }
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
