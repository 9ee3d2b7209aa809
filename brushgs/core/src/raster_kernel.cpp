// The hot loops of the rasteriser, compiled once per instruction set (see CMakeLists.txt).
#include <cmath>
#include <limits>

#include "brushgs/lanes.hpp"
#include "brushgs/raster.hpp"
#include "brushgs/sampling.hpp"
#include "brushgs/trig.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

constexpr double kMinExtent = 1e-12;  // pixels: anything thinner holds no pixel centre

template <class T>
T clamped(T x, T low, T high) {
    return x < low ? low : (x > high ? high : x);
}

// Scale from pixels to the kernel's own unit (texels, standard deviations or half axes), along one axis.
struct AxisMap {
    double scale;   // units per pixel
    double middle;  // coordinate of the box centre
    double reach;   // painted half length, in half extents
};

AxisMap image_axis(double half_extent, int texels, double reach) {
    const double last = texels - 1;
    return {0.5 * last / (reach * half_extent), 0.5 * last, reach};
}

// A Gaussian of little opacity falls under the skip threshold inside its box: paint no further than that.
double visible_sigmas(double opacity) {
    const double sigmas = std::sqrt(2 * std::log(opacity / kMinAlpha)) * (1 + 1e-6);
    return sigmas < kGaussianSigmas ? sigmas : kGaussianSigmas;
}

template <class T>
void make_record(const RasterParams& params, const BoxView<T>& boxes, std::size_t i, SinCos axis, Record<T>& record,
                 Outline& outline) {
    record.left = record.top = 0;
    record.right = record.bottom = -1;
    const double half_u = static_cast<double>(boxes.half_extents[2 * i]);
    const double half_v = static_cast<double>(boxes.half_extents[2 * i + 1]);
    const double opacity = static_cast<double>(boxes.opacities[i]);
    if (!(half_u > kMinExtent && half_v > kMinExtent) || opacity < kMinAlpha) return;

    const bool is_image = params.kernel == Kernel::bilinear || params.kernel == Kernel::nearest;
    AxisMap u, v;
    double limit = 1;
    record.level = 0;
    if (is_image) {
        record.level = params.level_of_box.empty() ? 0 : params.level_of_box[i];
        const Level& level = params.levels[static_cast<std::size_t>(record.level)];
        u = image_axis(half_u, level.columns, level.reach_u);
        v = image_axis(half_v, level.rows, level.reach_v);
    } else if (params.kernel == Kernel::gaussian) {
        limit = visible_sigmas(opacity);
        u = {kGaussianSigmas / half_u, 0, limit / kGaussianSigmas};
        v = {kGaussianSigmas / half_v, 0, limit / kGaussianSigmas};
    } else {
        u = {1 / half_u, 0, 1};
        v = {1 / half_v, 0, 1};
    }

    const double center_x = static_cast<double>(boxes.centers[2 * i]);
    const double center_y = static_cast<double>(boxes.centers[2 * i + 1]);
    const double reach_u = half_u * u.reach, reach_v = half_v * v.reach;
    const double reach_x = std::fabs(axis.cos) * reach_u + std::fabs(axis.sin) * reach_v;
    const double reach_y = std::fabs(axis.sin) * reach_u + std::fabs(axis.cos) * reach_v;
    const double left = std::ceil(clamped(center_x - reach_x - 0.5, 0.0, 1e5));
    const double top = std::ceil(clamped(center_y - reach_y - 0.5, static_cast<double>(params.first_row), 1e5));
    const double right = std::floor(clamped(center_x + reach_x - 0.5, -1.0, params.width - 1.0));
    const int end_row = params.end_row < params.height ? params.end_row : params.height;
    const double bottom = std::floor(clamped(center_y + reach_y - 0.5, -1.0, end_row - 1.0));
    if (!(left <= right && top <= bottom)) return;
    record.left = static_cast<std::int16_t>(left);
    record.top = static_cast<std::int16_t>(top);
    record.right = static_cast<std::int16_t>(right);
    record.bottom = static_cast<std::int16_t>(bottom);

    const double anchor_x = std::floor(clamped(center_x, 0.0, static_cast<double>(params.width))) + 0.5;
    const double anchor_y = std::floor(clamped(center_y, 0.0, static_cast<double>(params.height))) + 0.5;
    const double du_dx = axis.cos * u.scale, du_dy = axis.sin * u.scale;
    const double dv_dx = -axis.sin * v.scale, dv_dy = axis.cos * v.scale;
    record.anchor_x = static_cast<std::int16_t>(anchor_x);
    record.anchor_y = static_cast<std::int16_t>(anchor_y);
    record.offset_u = static_cast<T>(u.middle + du_dx * (anchor_x - center_x) + du_dy * (anchor_y - center_y));
    record.offset_v = static_cast<T>(v.middle + dv_dx * (anchor_x - center_x) + dv_dy * (anchor_y - center_y));
    record.du_dx = static_cast<T>(du_dx);
    record.du_dy = static_cast<T>(du_dy);
    record.dv_dx = static_cast<T>(dv_dx);
    record.dv_dy = static_cast<T>(dv_dy);
    record.red = boxes.colors[3 * i];
    record.green = boxes.colors[3 * i + 1];
    record.blue = boxes.colors[3 * i + 2];
    record.opacity = static_cast<T>(is_image ? opacity / 255 : opacity);
    record.depth = boxes.depths[i];
    record.limit = static_cast<T>(limit);
    outline = {static_cast<float>(center_x), static_cast<float>(center_y), static_cast<float>(axis.cos),
               static_cast<float>(axis.sin), static_cast<float>(reach_u),  static_cast<float>(reach_v)};
}

}  // namespace

template <class T>
void make_records(const RasterParams& params, const BoxView<T>& boxes, std::size_t begin, std::size_t end,
                  Record<T>* records, Outline* outlines) {
    constexpr std::size_t group = 64;  // one pass of vector trigonometry, small enough for the stack
    for (std::size_t first = begin; first < end; first += group) {
        const std::size_t count = end - first < group ? end - first : group;
        double sines[group], cosines[group], angles[group] = {};
        for (std::size_t k = 0; k < count; ++k) angles[k] = within_reach(static_cast<double>(boxes.angles[first + k]));
        for (std::size_t k = 0; k < group; ++k) {
            const SinCos axis = sincos_of(angles[k]);
            sines[k] = axis.sin;
            cosines[k] = axis.cos;
        }
        for (std::size_t k = 0; k < count; ++k)
            make_record(params, boxes, first + k, {sines[k], cosines[k]}, records[first + k],
                        outlines[first - begin + k]);
    }
}

namespace {

// The pixels of one tile while it is painted: planes of 4 x 4 blocks, so that a block is one run of memory.
template <class T>
struct TileState {
    alignas(64) T transmittance[kNumBlocks][kBlockPixels];
    alignas(64) T red[kNumBlocks][kBlockPixels];
    alignas(64) T green[kNumBlocks][kBlockPixels];
    alignas(64) T blue[kNumBlocks][kBlockPixels];
    alignas(64) T depth[kNumBlocks][kBlockPixels];
    std::uint16_t alive[kNumBlocks];  // pixels that still let light through
    std::uint32_t alive_blocks;
    T min_transmittance;  // a pixel is finished before it lets less light through

    void start(const RasterParams& params, int x0, int y0, bool with_depth) {
        const int num_columns = params.width - x0, num_rows = params.height - y0;
        min_transmittance = static_cast<T>(params.min_transmittance);
        __builtin_memset(red, 0, sizeof red);
        __builtin_memset(green, 0, sizeof green);
        __builtin_memset(blue, 0, sizeof blue);
        if (with_depth) __builtin_memset(depth, 0, sizeof depth);
        T* all = transmittance[0];
        for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
        alive_blocks = open_pixels(num_columns, num_rows, alive);
    }

    [[gnu::always_inline]] inline void finish(int b, unsigned pixels) { finish_pixels(*this, b, pixels); }
};

template <class T, Kernel kernel, bool with_depth>
[[gnu::always_inline]] inline void blend_record(const RasterParams& params, const Record<T>& record, int x0, int y0,
                                                TileState<T>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width;
    // Two passes over the blocks: what a gather makes wait is then only the first, and that has few instructions.
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    std::uint32_t blocks = sample_record<T, kernel>(params, record, x0, y0, tile, alphas);
    const Real depth = L::set(record.depth);
    const Real red = L::set(record.red), green = L::set(record.green), blue = L::set(record.blue);
    const Real darkest = L::set(tile.min_transmittance);

    for (; blocks != 0; blocks &= blocks - 1) {
        const int b = __builtin_ctz(blocks);
        unsigned finished = 0;
        for (int part = 0; part < kBlockPixels / W; ++part) {
            const int lane = part * W;
            const Real alpha = L::load(alphas[b] + lane);
            const auto painted = L::at_least(L::from_bits(~0u), alpha, L::set(static_cast<T>(kMinAlpha)));
            const Real before = L::load(tile.transmittance[b] + lane);
            const Real full = before * alpha;
            const Real after = before - full;
            const auto kept = L::at_least(painted, after, darkest);
            const Real weight = L::where(kept, full);
            L::store(tile.transmittance[b] + lane, L::select(kept, after, before));
            const auto add = [&](T* plane, Real value) {
                L::store(plane + lane, L::load(plane + lane) + weight * value);
            };
            add(tile.red[b], red);
            add(tile.green[b], green);
            add(tile.blue[b], blue);
            if constexpr (with_depth) add(tile.depth[b], depth);
            finished |= (L::bits(painted) & ~L::bits(kept)) << lane;
        }
        tile.finish(b, finished);
    }
}

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

// Four pixels of a row of a block; `depth` may be null.
template <class T>
[[gnu::always_inline]] inline void write_four(const TileState<T>& tile, int b, int p, T* rgb, T* alpha, T* depth) {
    using Four [[gnu::vector_size(4 * sizeof(T))]] = T;
    interleave(tile.red[b] + p, tile.green[b] + p, tile.blue[b] + p, rgb);
    Four transmittance;
    __builtin_memcpy(&transmittance, tile.transmittance[b] + p, sizeof transmittance);
    const Four opaque = T(1) - transmittance;
    __builtin_memcpy(alpha, &opaque, sizeof opaque);
    if (depth == nullptr) return;
    Four sum;
    __builtin_memcpy(&sum, tile.depth[b] + p, sizeof sum);
    const Four mean = opaque > 0 ? sum / opaque : Four{};
    __builtin_memcpy(depth, &mean, sizeof mean);
}

// `num_columns` pixels of row y of the tile, to wherever they belong.
template <class T>
void write_row(const TileState<T>& tile, int y, int num_columns, T* rgb, T* alpha, T* depth) {
    const int first_block = y / kBlockSize * kBlockColumns, p = y % kBlockSize * kBlockSize;
    int x = 0;
    for (; x + kBlockSize <= num_columns; x += kBlockSize)
        write_four(tile, first_block + x / kBlockSize, p, rgb + 3 * x, alpha + x,
                   depth == nullptr ? nullptr : depth + x);
    if (x == num_columns) return;
    T colors[3 * kBlockSize], alphas[kBlockSize], depths[kBlockSize];  // the picture ends within a block
    write_four(tile, first_block + x / kBlockSize, p, colors, alphas, depths);
    for (int i = 0; x < num_columns; ++x, ++i) {
        for (int channel = 0; channel < 3; ++channel) rgb[3 * x + channel] = colors[3 * i + channel];
        alpha[x] = alphas[i];
        if (depth != nullptr) depth[x] = depths[i];
    }
}

template <class T>
void write_tile(const RasterParams& params, const TileState<T>& tile, int x0, int y0, const Picture<T>& picture) {
    const int num_columns = params.width - x0 < kTileWidth ? params.width - x0 : kTileWidth;
    const int num_rows = params.height - y0 < kTileHeight ? params.height - y0 : kTileHeight;
    for (int y = 0; y < num_rows; ++y) {
        const std::size_t first =
            static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(params.width) + static_cast<std::size_t>(x0);
        write_row(tile, y, num_columns, picture.rgb + 3 * first, picture.alpha + first,
                  picture.depth == nullptr ? nullptr : picture.depth + first);
    }
}

template <class T, Kernel kernel, bool with_depth>
void blend_all(const RasterParams& params, const Record<T>* records, const std::uint32_t* ids, std::size_t num_ids,
               int x0, int y0, TileState<T>& tile) {
    constexpr std::size_t ahead = 4;  // records lie in depth order: those of a tile are far apart in memory
    for (std::size_t i = 0; i < num_ids && tile.alive_blocks != 0; ++i) {
        __builtin_prefetch(&records[ids[i + ahead < num_ids ? i + ahead : i]]);
        blend_record<T, kernel, with_depth>(params, records[ids[i]], x0, y0, tile);
    }
}

template <class T, Kernel kernel>
void blend_with(const RasterParams& params, const Record<T>* records, const std::uint32_t* ids, std::size_t num_ids,
                int x0, int y0, TileState<T>& tile, bool with_depth) {
    if (with_depth)
        blend_all<T, kernel, true>(params, records, ids, num_ids, x0, y0, tile);
    else
        blend_all<T, kernel, false>(params, records, ids, num_ids, x0, y0, tile);
}

// Soft order. The definition is in brushgs/rendering/reference.py. A fragment whose depth is further from the next
// record's than any band reaches is final: it is retired into the sums, in stroke order, as sorted strokes are.
// Those that are not yet wait in the queue of their block, all its pixels together.

constexpr std::size_t kRetiredAtOnce = 6;  // fewer are left waiting: sums are loaded and stored once for all

// The state of a tile beyond that of sorted strokes; `transmittance` there is that of the retired fragments that show.
template <class T>
struct SoftState {
    alignas(64) T light[kNumBlocks][kBlockPixels];    // behind all fragments so far, those not shown included
    alignas(64) T weights[kNumBlocks][kBlockPixels];  // sum of those retired
    std::uint16_t shared[kNumBlocks];                 // pixels in which two fragments met within their softness

    void start(Pending<T>& pending) {
        T* all = light[0];
        for (int i = 0; i < kNumBlocks * kBlockPixels; ++i) all[i] = 1;
        __builtin_memset(weights, 0, sizeof weights);
        __builtin_memset(shared, 0, sizeof shared);
        __builtin_memset(pending.heads, 0, sizeof pending.heads);
        __builtin_memset(pending.tails, 0, sizeof pending.tails);
        if (pending.num_free == pending.num_slots) return;
        pending.num_free = 0;  // an error left slots in use
        for (std::size_t slot = pending.num_slots; slot > 0; --slot)
            pending.free_slots[pending.num_free++] = static_cast<std::uint32_t>(slot - 1);
    }
};

// Where the columns of `Pending` lie. A copy of one's own: vector stores may touch any other, so that each of its
// fields would be read anew after each store.
template <class T>
struct Queues {
    PendingSlot<T>* slots;
    std::uint32_t* free_slots;
    PendingEntry* entries;
    T* depths;
    T* squared_softness;
    std::size_t num_free, queue_size;

    [[gnu::always_inline]] inline explicit Queues(const Pending<T>& p)
        : slots(p.slots),
          free_slots(p.free_slots),
          entries(p.entries),
          depths(p.depths),
          squared_softness(p.squared_softness),
          num_free(p.num_free),
          queue_size(p.queue_size) {}
};

// Adds the `count` fragments from place `first` on, of block b, to the sums, and frees their slots.
template <class T, bool with_depth>
[[gnu::always_inline]] inline void retire(const Record<T>* records, int b, std::size_t first, std::size_t count,
                                          Queues<T>& queues, SoftState<T>& soft, TileState<T>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width;
    const PendingEntry* const entries = queues.entries + first;
    const PendingSlot<T>* const slots = queues.slots;
    for (int part = 0; part < kBlockPixels / W; ++part) {
        const int lane = part * W;
        Real red = L::load(tile.red[b] + lane), green = L::load(tile.green[b] + lane);
        Real blue = L::load(tile.blue[b] + lane), sum = L::load(soft.weights[b] + lane);
        Real light = L::load(tile.transmittance[b] + lane), depth{};
        if constexpr (with_depth) depth = L::load(tile.depth[b] + lane);
        for (std::size_t k = 0; k < count; ++k) {
            const PendingSlot<T>& slot = slots[entries[k].slot];
            const Record<T>& record = records[entries[k].record];
            const Real weight = L::load(slot.weight + lane);
            red = red + weight * L::set(record.red);
            green = green + weight * L::set(record.green);
            blue = blue + weight * L::set(record.blue);
            if constexpr (with_depth) depth = depth + weight * L::set(record.depth);
            sum = sum + weight;
            const auto shown = L::less(L::from_bits(~0u), L::set(0), weight);
            light = L::select(shown, light - light * L::load(slot.alpha + lane), light);
        }
        L::store(tile.red[b] + lane, red);
        L::store(tile.green[b] + lane, green);
        L::store(tile.blue[b] + lane, blue);
        L::store(soft.weights[b] + lane, sum);
        L::store(tile.transmittance[b] + lane, light);
        if constexpr (with_depth) L::store(tile.depth[b] + lane, depth);
    }
    for (std::size_t k = 0; k < count; ++k) queues.free_slots[queues.num_free++] = entries[k].slot;
}

// Makes room for one more fragment at the end of the queue of block b, and a free slot for it.
template <class T>
[[gnu::noinline]] void make_room(int b, Pending<T>& pending) {
    const auto queue = static_cast<std::size_t>(b);
    if (pending.num_free == 0) add_slots(pending);
    if (pending.tails[queue] < pending.queue_size) return;
    const std::size_t head = pending.heads[queue], count = pending.tails[queue] - head;
    if (2 * count >= pending.queue_size) {
        lengthen_queues(pending);
        return;
    }
    const auto to_start = [&](auto* column) {
        auto* first = column + queue * pending.queue_size;
        __builtin_memmove(first, first + head, count * sizeof *first);
    };
    to_start(pending.entries);
    to_start(pending.depths);
    to_start(pending.squared_softness);
    pending.heads[queue] = 0;
    pending.tails[queue] = count;
}

// How many fragments of a queue, from its first on, lie wholly in front of a fragment, and of all that come later too.
struct InFront {
    std::size_t of_this, of_all;
};

// The places `first` to `last` of the queue, for a fragment of this depth; `reach` is the largest squared band from
// there on.
template <class T>
[[gnu::always_inline]] inline InFront count_in_front(const Queues<T>& queues, std::size_t first, std::size_t last,
                                                     T depth, T softness_squared, T reach) {
    using L = Lanes<T>;
    constexpr std::size_t W = L::width;
    InFront count{0, 0};
    for (std::size_t k = 0; first + k < last && count.of_this == k; k += W) {
        const auto gap = L::set(depth) - L::load(queues.depths + first + k);
        const auto band = L::load(queues.squared_softness + first + k), squared = gap * gap;
        const auto all = L::from_bits(~0u);
        const unsigned this_bits = L::bits(L::at_least(all, squared, band + L::set(softness_squared)));
        const unsigned all_bits = L::bits(L::at_least(all, squared, band + L::set(reach)));
        count.of_this += static_cast<std::size_t>(__builtin_ctz(~this_bits | 1u << W));
        if (count.of_all == k) count.of_all += static_cast<std::size_t>(__builtin_ctz(~all_bits | 1u << W));
    }
    const std::size_t waiting = last - first;
    return {count.of_this < waiting ? count.of_this : waiting, count.of_all < waiting ? count.of_all : waiting};
}

// The share of what lies behind that a fragment hides which is nearer by x softness, 0 <= x <= 1: from half to all.
template <class T>
[[gnu::always_inline]] inline T share_hidden(T x) {
    return T(0.5) + x * (3 - x * x) * T(0.25);
}

// Adds the fragments of a record in block b, where their alpha is given, to the queue, and lets them and those that
// wait hide each other. `reach` is the largest squared band among this record and all behind it.
template <class T, bool with_depth>
[[gnu::always_inline]] inline void blend_softly(const Record<T>* records, std::uint32_t id, T softness_squared, T reach,
                                                const T* alphas, unsigned pixels, int b, Pending<T>& pending,
                                                Queues<T>& queues, SoftState<T>& soft, TileState<T>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    constexpr int W = L::width, num_parts = kBlockPixels / W;
    const auto queue = static_cast<std::size_t>(b);
    const T depth = records[id].depth;
    std::size_t start = queue * queues.queue_size;
    std::size_t head = start + pending.heads[queue], tail = start + pending.tails[queue];
    InFront in_front = count_in_front(queues, head, tail, depth, softness_squared, reach);
    if (in_front.of_all >= kRetiredAtOnce) {
        retire<T, with_depth>(records, b, head, in_front.of_all, queues, soft, tile);
        head += in_front.of_all;
        pending.heads[queue] = head - start;
        in_front = {in_front.of_this - in_front.of_all, 0};
    }
    const std::size_t next = head + in_front.of_all;
    const T* const behind_final = next < tail ? queues.slots[queues.entries[next].slot].before : soft.light[b];
    unsigned finished = 0;
    for (int part = 0; part < num_parts; ++part) {
        const Real light = L::load(behind_final + part * W);
        const auto dark = L::less(L::from_bits(~0u), light, L::set(tile.min_transmittance));
        finished |= L::bits(dark) << (part * W);
    }
    if (finished &= tile.alive[b]; finished != 0) {  // what waits and shows may still be hidden in part by what is not
        for (std::size_t k = next; k < tail; ++k) finished &= ~static_cast<unsigned>(queues.entries[k].shown);
        tile.finish(b, finished);
    }
    pixels &= tile.alive[b];
    if (pixels == 0) return;
    if (queues.num_free == 0 || tail - start == queues.queue_size) {
        pending.num_free = queues.num_free;
        make_room(b, pending);
        queues = Queues<T>(pending);
        start = queue * queues.queue_size;
        head = start + pending.heads[queue];
        tail = start + pending.tails[queue];
    }
    const std::uint32_t slot_id = queues.free_slots[--queues.num_free];
    PendingSlot<T>& slot = queues.slots[slot_id];

    // Light that passes what lies wholly in front, and that passes the fragments within a band as well.
    Real alpha[num_parts], front[num_parts], seen[num_parts];
    for (int part = 0; part < num_parts; ++part) {
        const auto painted = L::from_bits(pixels >> (part * W));
        alpha[part] = L::where(painted, L::load(alphas + part * W));
        front[part] = seen[part] = L::load(soft.light[b] + part * W);
    }
    unsigned shared = 0;
    for (std::size_t k = head + in_front.of_this; k < tail; ++k) {
        const unsigned both = queues.entries[k].pixels & pixels;
        if (both == 0) continue;
        PendingSlot<T>& other = queues.slots[queues.entries[k].slot];
        const T gap = depth - queues.depths[k], band = queues.squared_softness[k] + softness_squared;
        if (gap * gap >= band) {
            if (shared == 0) continue;
            for (int part = 0; part < num_parts; ++part) {
                const Real hidden = L::load(other.alpha + part * W);
                front[part] = front[part] - front[part] * hidden;
                seen[part] = seen[part] - seen[part] * hidden;
            }
            continue;
        }
        if (shared == 0)
            for (int part = 0; part < num_parts; ++part) front[part] = seen[part] = L::load(other.before + part * W);
        shared |= both;
        const T x = gap / std::sqrt(band);
        const T share = share_hidden(x < 1 ? x : T(1));
        const Real hidden_here = L::set(share), hidden_there = L::set(1 - share);
        for (int part = 0; part < num_parts; ++part) {
            const Real weight = L::load(other.weight + part * W);
            L::store(other.weight + part * W, weight - weight * (alpha[part] * hidden_there));
            seen[part] = seen[part] - seen[part] * (L::load(other.alpha + part * W) * hidden_here);
        }
    }
    soft.shared[b] = static_cast<std::uint16_t>(soft.shared[b] | shared);

    unsigned last = 0, shown = 0;
    for (int part = 0; part < num_parts; ++part) {
        const int lane = part * W;
        const auto all = L::from_bits(~0u);
        const Real left = front[part] - front[part] * alpha[part];
        const auto kept = L::at_least(all, left, L::set(tile.min_transmittance));
        shown |= (L::bits(kept) << lane) & pixels;
        const Real before = L::load(soft.light[b] + lane), after = before - before * alpha[part];
        L::store(soft.light[b] + lane, after);
        L::store(slot.alpha + lane, alpha[part]);
        L::store(slot.weight + lane, L::where(kept, seen[part] * alpha[part]));
        L::store(slot.before + lane, before);
        last |= L::bits(L::less(all, after, L::set(static_cast<T>(kLeastLight)))) << lane;
    }
    queues.entries[tail] = {slot_id, id, static_cast<std::uint16_t>(pixels), static_cast<std::uint16_t>(shown)};
    queues.depths[tail] = depth;
    queues.squared_softness[tail] = softness_squared;
    pending.tails[queue] = tail + 1 - start;
    if (last != 0) tile.finish(b, last);
}

// Retires all that waits. Where fragments shared a band, their weights are scaled to the alpha of the pixel.
template <class T, bool with_depth>
void finish_softly(const Record<T>* records, Pending<T>& pending, SoftState<T>& soft, TileState<T>& tile) {
    using L = Lanes<T>;
    using Real = typename L::Real;
    Queues<T> queues(pending);
    for (int b = 0; b < kNumBlocks; ++b) {
        const auto queue = static_cast<std::size_t>(b);
        const std::size_t waiting = pending.tails[queue] - pending.heads[queue];
        const std::size_t first = queue * queues.queue_size + pending.heads[queue];
        if (waiting > 0) retire<T, with_depth>(records, b, first, waiting, queues, soft, tile);
        if (soft.shared[b] == 0) continue;
        for (int lane = 0; lane < kBlockPixels; lane += L::width) {
            const Real weights = L::load(soft.weights[b] + lane);  // 0 where none leaves enough light to be seen
            const auto shared = L::at_least(L::from_bits(static_cast<unsigned>(soft.shared[b]) >> lane), weights,
                                            L::set(std::numeric_limits<T>::min()));
            const Real alpha = L::set(1) - L::load(tile.transmittance[b] + lane);
            const Real factor = L::select(shared, alpha / weights, L::set(1));
            const auto scale = [&](T* plane) { L::store(plane + lane, L::load(plane + lane) * factor); };
            scale(tile.red[b]);
            scale(tile.green[b]);
            scale(tile.blue[b]);
            if constexpr (with_depth) scale(tile.depth[b]);
        }
    }
    pending.num_free = queues.num_free;
}

template <class T, Kernel kernel, bool with_depth>
void blend_all_softly(const RasterParams& params, const Record<T>* records, const T* softness, const std::uint32_t* ids,
                      std::size_t num_ids, int x0, int y0, Pending<T>& pending, TileState<T>& tile) {
    constexpr std::size_t ahead = 4;
    make_reaches(pending, num_ids);
    T* const reaches = pending.reaches;
    T largest = 0;
    for (std::size_t i = num_ids; i > 0; --i) {
        const T squared = softness[ids[i - 1]] * softness[ids[i - 1]];
        reaches[i - 1] = largest = squared > largest ? squared : largest;
    }
    SoftState<T> soft;
    soft.start(pending);
    // A record is sampled before the one in front of it is blended: what blending does next hangs on the samples.
    struct Samples {
        alignas(64) T alphas[kNumBlocks][kBlockPixels];
        std::uint16_t pixels[kNumBlocks];
        std::uint32_t blocks;
    } samples[2];
    Queues<T> queues(pending);
    for (std::size_t i = 0; i <= num_ids && tile.alive_blocks != 0; ++i) {
        if (i < num_ids) {
            __builtin_prefetch(&records[ids[i + ahead < num_ids ? i + ahead : i]]);
            Samples& next = samples[i % 2];
            next.blocks =
                sample_record<T, kernel, true>(params, records[ids[i]], x0, y0, tile, next.alphas, next.pixels);
        }
        if (i == 0) continue;
        const std::uint32_t id = ids[i - 1];
        const Samples& own = samples[(i - 1) % 2];
        const T softness_squared = softness[id] * softness[id];
        for (std::uint32_t blocks = own.blocks; blocks != 0; blocks &= blocks - 1) {
            const int b = __builtin_ctz(blocks);
            blend_softly<T, with_depth>(records, id, softness_squared, reaches[i - 1], own.alphas[b], own.pixels[b], b,
                                        pending, queues, soft, tile);
        }
    }
    pending.num_free = queues.num_free;
    finish_softly<T, with_depth>(records, pending, soft, tile);
}

template <class T, Kernel kernel>
void blend_with_softly(const RasterParams& params, const Record<T>* records, const T* softness,
                       const std::uint32_t* ids, std::size_t num_ids, int x0, int y0, Pending<T>& pending,
                       TileState<T>& tile, bool with_depth) {
    if (with_depth)
        blend_all_softly<T, kernel, true>(params, records, softness, ids, num_ids, x0, y0, pending, tile);
    else
        blend_all_softly<T, kernel, false>(params, records, softness, ids, num_ids, x0, y0, pending, tile);
}

}  // namespace

template <class T>
void paint_tile(const RasterParams& params, const Record<T>* records, const std::uint32_t* ids, std::size_t num_ids,
                int tile_x, int tile_y, const Picture<T>& picture) {
    const int x0 = tile_x * kTileWidth, y0 = tile_y * kTileHeight;
    TileState<T> tile;
    const bool with_depth = picture.depth != nullptr;
    tile.start(params, x0, y0, with_depth);
    switch (params.kernel) {
        case Kernel::bilinear:
            blend_with<T, Kernel::bilinear>(params, records, ids, num_ids, x0, y0, tile, with_depth);
            break;
        case Kernel::nearest:
            blend_with<T, Kernel::nearest>(params, records, ids, num_ids, x0, y0, tile, with_depth);
            break;
        case Kernel::gaussian:
            blend_with<T, Kernel::gaussian>(params, records, ids, num_ids, x0, y0, tile, with_depth);
            break;
        case Kernel::ellipse:
            blend_with<T, Kernel::ellipse>(params, records, ids, num_ids, x0, y0, tile, with_depth);
            break;
    }
    write_tile(params, tile, x0, y0, picture);
}

template <class T>
void paint_tile_softly(const RasterParams& params, const Record<T>* records, const T* softness,
                       const std::uint32_t* ids, std::size_t num_ids, int tile_x, int tile_y, Pending<T>& pending,
                       const Picture<T>& picture) {
    const int x0 = tile_x * kTileWidth, y0 = tile_y * kTileHeight;
    TileState<T> tile;
    const bool with_depth = picture.depth != nullptr;
    tile.start(params, x0, y0, with_depth);
    if (params.kernel == Kernel::bilinear)
        blend_with_softly<T, Kernel::bilinear>(params, records, softness, ids, num_ids, x0, y0, pending, tile,
                                               with_depth);
    else
        blend_with_softly<T, Kernel::nearest>(params, records, softness, ids, num_ids, x0, y0, pending, tile,
                                              with_depth);
    write_tile(params, tile, x0, y0, picture);
}

#define BRUSHGS_INSTANTIATE(T)                                                                                      \
    template void make_records<T>(const RasterParams&, const BoxView<T>&, std::size_t, std::size_t, Record<T>*,     \
                                  Outline*);                                                                        \
    template void paint_tile<T>(const RasterParams&, const Record<T>*, const std::uint32_t*, std::size_t, int, int, \
                                const Picture<T>&);                                                                 \
    template void paint_tile_softly<T>(const RasterParams&, const Record<T>*, const T*, const std::uint32_t*,       \
                                       std::size_t, int, int, Pending<T>&, const Picture<T>&);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs::BRUSHGS_ISA
