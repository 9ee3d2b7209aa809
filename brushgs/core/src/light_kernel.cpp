// The loops of lighting, compiled once per instruction set (see CMakeLists.txt): each runs along a row, and the
// compiler makes vectors of it. Nothing is reassociated, so all sets give the same bits.
#include "brushgs/light.hpp"

#include <cmath>

namespace brushgs::BRUSHGS_ISA {

namespace {

// Row y of the blurred height, from place 1 on: one pixel beyond the picture on either side. `wide` is memory for the
// row and the pixels that the blur reaches beyond it.
template <class T>
void blur_row(const LightParams<T>& params, int y, T* __restrict__ wide, T* __restrict__ row) {
    const int width = params.width, taps = static_cast<int>(params.blur.size()), radius = taps / 2;
    T* const middle = wide + radius;
    for (int k = 0; k < taps; ++k) {
        int from = y + k - radius;
        from = from < 0 ? 0 : (from >= params.height ? params.height - 1 : from);
        const T* const source = params.heights + static_cast<std::size_t>(from) * static_cast<std::size_t>(width);
        const T weight = static_cast<T>(params.blur[static_cast<std::size_t>(k)]);
        if (k == 0)
            for (int x = 0; x < width; ++x) middle[x] = weight * source[x];
        else
            for (int x = 0; x < width; ++x) middle[x] += weight * source[x];
    }
    for (int k = 1; k <= radius; ++k) {
        middle[-k] = middle[0];
        middle[width - 1 + k] = middle[width - 1];
    }
    for (int k = 0; k < taps; ++k) {
        const T weight = static_cast<T>(params.blur[static_cast<std::size_t>(k)]);
        const T* const source = wide + k;
        if (k == 0)
            for (int x = 0; x < width; ++x) row[x + 1] = weight * source[x];
        else
            for (int x = 0; x < width; ++x) row[x + 1] += weight * source[x];
    }
    row[0] = row[1];
    row[width + 1] = row[width];
}

// How far each pixel of a row faces a direction, relative to a flat one; `direction` is x and y over z. The rows are of
// blurred heights, from the first pixel of the picture on.
template <class T>
void face_row(const T* __restrict__ above, const T* __restrict__ own, const T* __restrict__ below, int width,
              const double (&direction)[2], T* __restrict__ facing) {
    const T along_x = static_cast<T>(0.5 * direction[0]), along_y = static_cast<T>(0.5 * direction[1]);
    for (int x = 0; x < width; ++x) {
        const T step_x = own[x + 1] - own[x - 1], step_y = below[x] - above[x];  // twice the slopes
        const T length = std::sqrt(1 + T(0.25) * (step_x * step_x + step_y * step_y));
        const T cosine = (1 - (along_x * step_x + along_y * step_y)) / length;
        facing[x] = cosine > 0 ? cosine : 0;
    }
}

}  // namespace

template <class T>
void light_rows(const LightParams<T>& params, int first, int end, T* memory) {
    const int width = params.width, last = params.height - 1;
    const auto columns = static_cast<std::size_t>(width);
    T* const wide = memory;
    T* rows[3];
    rows[0] = wide + (columns + params.blur.size() - 1);
    rows[1] = rows[0] + (columns + 2);
    rows[2] = rows[1] + (columns + 2);
    T* const __restrict__ factor = rows[2] + (columns + 2);
    T* const __restrict__ shine = factor + columns;
    T* const __restrict__ power = shine + columns;

    const T strength = static_cast<T>(params.strength), gloss = static_cast<T>(params.gloss);
    const double z =
        1 / std::sqrt(1 + params.half_way[0] * params.half_way[0] + params.half_way[1] * params.half_way[1]);
    const T flat = static_cast<T>(std::pow(z, params.exponent));
    const bool shines = gloss > 0;

    const auto within = [&](int y) { return y < 0 ? 0 : (y > last ? last : y); };
    blur_row(params, within(first - 1), wide, rows[0]);
    blur_row(params, first, wide, rows[1]);
    for (int y = first; y < end; ++y) {
        blur_row(params, within(y + 1), wide, rows[2]);
        face_row(rows[0] + 1, rows[1] + 1, rows[2] + 1, width, params.lamp, factor);
        for (int x = 0; x < width; ++x) {  // by itself: of two bounds in one loop the compiler makes branches
            const T shade = factor[x];
            factor[x] = 1 + strength * ((shade < 2 ? shade : 2) - 1);
        }
        const std::size_t from = static_cast<std::size_t>(y) * columns;
        const T* const rgb = params.rgb + 3 * from;
        T* const lit = params.lit + 3 * from;
        if (shines) {
            face_row(rows[0] + 1, rows[1] + 1, rows[2] + 1, width, params.half_way, power);
            for (int x = 0; x < width; ++x) shine[x] = 1;
            for (int rest = params.exponent; rest > 0; rest >>= 1) {
                if (rest & 1)
                    for (int x = 0; x < width; ++x) shine[x] *= power[x];
                for (int x = 0; x < width; ++x) power[x] *= power[x];
            }
            for (int x = 0; x < width; ++x) {
                const T more = flat * (shine[x] - 1);
                shine[x] = gloss * (more > 0 ? more : 0);
            }
            if (params.alpha != nullptr)
                for (int x = 0; x < width; ++x) shine[x] *= params.alpha[from + static_cast<std::size_t>(x)];
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c) lit[3 * x + c] = rgb[3 * x + c] * factor[x] + shine[x];
        } else {
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c) lit[3 * x + c] = rgb[3 * x + c] * factor[x];
        }
        T* const done = rows[0];
        rows[0] = rows[1];
        rows[1] = rows[2];
        rows[2] = done;
    }
}

#ifdef BRUSHGS_IN_DOUBLE
template void light_rows<double>(const LightParams<double>&, int, int, double*);
#else
template void light_rows<float>(const LightParams<float>&, int, int, float*);
#endif

}  // namespace brushgs::BRUSHGS_ISA
