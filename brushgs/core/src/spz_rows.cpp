#include "brushgs/spz_rows.hpp"

#include <cstring>
#include <numbers>
#include <numeric>

#include "brushgs/row_sink.hpp"

// Of wasm/zstd.zig.
extern "C" std::size_t unpack_zstd(const char* from, std::size_t from_size, char* to, std::size_t to_size);

namespace brushgs {

namespace {

constexpr std::string_view kMagic = "NGSP";
constexpr std::size_t kHeaderSize = 16, kRecordSize = 8;
constexpr std::size_t kLatestHeaderSize = 32, kStreamSize = 16;  // of the latest version; of an entry of its table
constexpr std::uint64_t kMostUnpacked = 300'000'000;             // bytes; MOST_BYTES of brushgs/outlets/painter/page.py
constexpr std::size_t kMostOfBlock = std::size_t{1} << 17;       // of zstd, which is unpacked as a whole
constexpr std::size_t kMostDegree = 4, kMostUsedDegree = 3, kMostBits = 24;
constexpr unsigned kLatest = 4;                                        // version; its blocks are zstd streams
constexpr unsigned kAntialiased = 1, kHasExtensions = 2, kTree = 128;  // flags
constexpr unsigned kCoordinateSystem = 0xadbe0003, kNumSystems = 17;
constexpr std::array<std::size_t, 6> kOddInX{3, 4, 7, 10, 13, 15};  // basis functions that change sign with x
constexpr const char* kAgain = "; download or copy it again";

std::uint32_t word_at(const char* place) {
    std::uint32_t word;
    std::memcpy(&word, place, sizeof word);
    return word;
}

std::uint8_t byte_at(const char* place) { return static_cast<std::uint8_t>(*place); }

struct Header {
    std::uint32_t version, num_rows;
    std::size_t degree, bits;  // of the stored spherical harmonics; fractional ones of positions
    unsigned flags;

    std::size_t used_terms() const {
        const std::size_t used = std::min(degree, kMostUsedDegree) + 1;
        return used * used;
    }
    // Bytes per Gaussian in each block: positions, opacities, colors, scales, rotations, harmonics.
    std::array<std::size_t, 6> widths() const {
        return {version == 1 ? 6U : 9U, 1, 3, 3, version < 3 ? 3U : 4U, 3 * ((degree + 1) * (degree + 1) - 1)};
    }
    std::size_t num_streams() const { return degree == 0 ? 5 : 6; }
    std::uint64_t row_size() const {
        const auto all = widths();
        return std::accumulate(all.begin(), all.end(), std::uint64_t{0});
    }
};

// As `check_decoded_size` says it: few bytes must not fill the memory.
std::string fault_of_size(const Header& header, std::uint64_t size) {
    constexpr std::uint64_t growth = 100, small = std::uint64_t{64} << 20;
    const std::uint64_t decoded = header.num_rows * (4 * (11 + 3 * header.used_terms()) + header.row_size());
    if (decoded <= growth * size + small) return "";
    return std::to_string(header.num_rows) + " Gaussians take " + std::to_string(decoded >> 20) +
           " MiB in memory and " + std::to_string(size >> 20) +
           " MiB in the file, too little for numbers of a scene; export it with floats";
}

std::string fault_of(const Header& header, bool was_gzip) {
    if (header.version < 1 || header.version > kLatest) {
        return "is an SPZ scene that must have a version from 1 to 4, got " + std::to_string(header.version) +
               "; export it as PLY or an earlier version of SPZ";
    }
    if (header.version == kLatest && was_gzip)
        return "is an SPZ scene of version 4 within gzip data; unpack it with gunzip";
    if (header.num_rows == 0) return "holds no Gaussians: its header says 0; export the scene again";
    if (header.degree > kMostDegree) {
        return "is damaged: spherical harmonics must have a degree from 0 to 4, got " + std::to_string(header.degree) +
               kAgain;
    }
    if (header.bits > kMostBits) {
        return "is damaged: positions must have at most 24 fractional bits, got " + std::to_string(header.bits) +
               kAgain;
    }
    if ((header.flags & kTree) != 0 && header.version < kLatest)
        return "holds a tree of levels of detail; export the scene without levels of detail";
    return "";
}

// A number of 16 bits: one of sign, 5 of exponent, 10 of fraction.
float half_at(const char* place) {
    std::uint16_t half;
    std::memcpy(&half, place, sizeof half);
    const int exponent = half >> 10 & 31, fraction = half & 1023;
    float value =
        std::ldexp(static_cast<float>(exponent == 0 ? fraction : fraction + 1024), std::max(exponent, 1) - 25);
    if (exponent == 31) value = fraction == 0 ? HUGE_VALF : std::nanf("");
    return (half & 0x8000) != 0 ? -value : value;
}

void read_position(const Header& header, const char* place, std::array<float, 3>& mean) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (header.version == 1) {
            mean[axis] = half_at(place + 2 * axis);
            continue;
        }
        const char* bytes = place + 3 * axis;
        const auto word = static_cast<std::uint32_t>(byte_at(bytes) << 8 | byte_at(bytes + 1) << 16) |
                          static_cast<std::uint32_t>(byte_at(bytes + 2)) << 24;
        mean[axis] =
            std::ldexp(static_cast<float>(static_cast<std::int32_t>(word) >> 8), -static_cast<int>(header.bits));
    }
}

// x, y and z as bytes; w >= 0 follows from the unit length.
void read_first_three(const char* place, std::array<float, 4>& quat) {
    int rest = 255 * 255;
    for (std::size_t i = 0; i < 3; ++i) {
        const int whole = 2 * byte_at(place + i) - 255;
        quat[i + 1] = static_cast<float>(whole) / 255;
        rest -= whole * whole;
    }
    quat[0] = std::sqrt(static_cast<float>(std::max(rest, 0))) / 255;
}

// Three components of 10 bits; the upper two bits of a word name the largest of x, y, z, w, which follows from them.
void read_smallest_three(const char* place, std::array<float, 4>& quat) {
    const std::uint32_t word = word_at(place);
    const std::size_t largest = word >> 30;
    float rest = 1;
    for (std::size_t i = 0, shift = 30; i < 4; ++i) {
        if (i == largest) continue;
        shift -= 10;
        const std::uint32_t bits = word >> shift & 1023;
        const double magnitude = (bits & 511) / 511.0 / std::numbers::sqrt2;
        const auto part = static_cast<float>(bits > 511 ? -magnitude : magnitude);
        quat[(i + 1) % 4] = part;
        rest -= part * part;
    }
    quat[(largest + 1) % 4] = std::sqrt(std::max(rest, 0.0F));
}

// The axes of a file by number, of which 0 states nothing: bits for right, up and, where z is not up, back; true if
// they are left-handed.
bool read_axes(std::uint32_t number, SceneColumns& out) {
    if (number == 0) return false;
    const std::uint32_t code = number - 1;
    const bool is_z_up = code >= 8, is_right = (code & 1) != 0, is_up = (code & 2) != 0;
    const bool is_front = ((code & 4) != 0) != is_z_up;
    out.up = (is_z_up ? 2 : 1) + (is_up ? 0 : 3);
    return ((is_right ? 0 : 1) + (is_up ? 0 : 1) + (is_front ? 1 : 0) + (is_z_up ? 1 : 0)) % 2 == 1;
}

// Reads the records after the rows; true if x is to be negated.
bool read_extensions(std::string_view records, SceneColumns& out) {
    bool is_mirrored = false;
    while (records.size() >= kRecordSize && out.fault.empty()) {
        const std::uint32_t kind = word_at(records.data()), size = word_at(records.data() + 4);
        records.remove_prefix(kRecordSize);
        if (size > records.size()) {
            out.fault = "is damaged: an extension has " + std::to_string(size) + " bytes where " +
                        std::to_string(records.size()) + " are left" + kAgain;
        } else if (kind == kCoordinateSystem) {
            const std::uint32_t number = size < 4 ? kNumSystems : word_at(records.data());
            if (number < kNumSystems)
                is_mirrored = read_axes(number, out);
            else
                out.fault = "the coordinate system must be a number from 0 to 16; export the scene again";
        }
        records.remove_prefix(std::min<std::size_t>(size, records.size()));
    }
    return is_mirrored;
}

void turn_x(RowSink& sink, std::size_t sh_terms) {
    sink.mean[0] = -sink.mean[0];
    sink.quat[2] = -sink.quat[2];  // mirroring reverses rotations, except about x
    sink.quat[3] = -sink.quat[3];
    for (const std::size_t term : kOddInX) {
        if (term >= sh_terms) break;
        for (std::size_t k = 0; k < 3; ++k) sink.sh[3 * term + k] = -sink.sh[3 * term + k];
    }
}

void read_rows(const Header& header, const char* next, bool is_mirrored, SceneColumns& out) {
    const auto widths = header.widths();
    std::array<const char*, 6> places;
    for (std::size_t block = 0; block < places.size(); ++block) {
        places[block] = next;
        next += widths[block] * header.num_rows;
    }
    reserve(out, header.num_rows);
    RowSink sink{out};
    for (std::uint32_t row = 0; row < header.num_rows; ++row) {
        const auto [position, alpha, color, scale, rotation, rest] = places;
        read_position(header, position, sink.mean);
        sink.logit = logit_of(byte_at(alpha));
        for (std::size_t k = 0; k < 3; ++k) {
            sink.sh[k] = static_cast<float>((byte_at(color + k) / 255.0 - 0.5) / 0.15);
            sink.scale[k] = static_cast<float>(byte_at(scale + k)) / 16 - 10;
        }
        (header.version < 3 ? read_first_three : read_smallest_three)(rotation, sink.quat);
        for (std::size_t k = 3; k < 3 * out.sh_terms; ++k)
            sink.sh[k] = static_cast<float>(byte_at(rest + k - 3)) / 128 - 1;
        if (is_mirrored) turn_x(sink, out.sh_terms);
        sink.add();
        for (std::size_t block = 0; block < places.size(); ++block) places[block] += widths[block];
    }
}

// The bytes of all blocks of a file of the latest version, whose table of contents begins at `table`; empty and a fault
// if it is damaged.
std::vector<char> unpacked(const Header& header, std::string_view content, std::uint64_t table, SceneColumns& out) {
    std::vector<char> blocks(static_cast<std::size_t>(header.row_size() * header.num_rows) + kMostOfBlock);
    char* to = blocks.data();
    std::size_t number = 0;
    std::string_view streams = content.substr(static_cast<std::size_t>(table) + header.num_streams() * kStreamSize);
    for (const std::size_t width : header.widths()) {
        if (width == 0) continue;
        std::uint64_t sizes[2];  // packed, and not
        std::memcpy(sizes, content.data() + table + number * kStreamSize, sizeof sizes);
        const std::uint64_t size = std::uint64_t{width} * header.num_rows;
        if (sizes[1] != size) {
            out.fault = "is damaged: stream " + std::to_string(number) + " must hold " + std::to_string(size) +
                        " bytes for " + std::to_string(header.num_rows) + " Gaussians, got " +
                        std::to_string(sizes[1]) + kAgain;
        } else if (sizes[0] > streams.size()) {
            out.fault = "is cut off: " + std::to_string(sizes[0] - streams.size()) +
                        " bytes before the end of stream " + std::to_string(number) + kAgain;
        } else if (unpack_zstd(streams.data(), static_cast<std::size_t>(sizes[0]), to,
                               static_cast<std::size_t>(size) + kMostOfBlock) != size) {
            out.fault = std::string("cannot be decompressed; it is cut off or damaged") + kAgain;
        }
        if (!out.fault.empty()) return {};
        streams.remove_prefix(static_cast<std::size_t>(sizes[0]));
        to += size;
        ++number;
    }
    return blocks;
}

void read_latest(const Header& header, std::string_view content, SceneColumns& out) {
    if (content.size() < kLatestHeaderSize) {
        out.fault = std::string("is cut off: within its header") + kAgain;
        return;
    }
    const std::uint64_t table = word_at(content.data() + kHeaderSize);
    const std::size_t stated = byte_at(content.data() + kHeaderSize - 1);
    if (table < kLatestHeaderSize || table + stated * kStreamSize > content.size()) {
        out.fault = "is cut off: its table of contents is said to begin at byte " + std::to_string(table) + " of " +
                    std::to_string(content.size()) + kAgain;
        return;
    }
    const auto records = content.substr(kLatestHeaderSize, static_cast<std::size_t>(table) - kLatestHeaderSize);
    const bool is_mirrored = (header.flags & kHasExtensions) != 0 && read_extensions(records, out);
    if (out.fault.empty() && stated != header.num_streams()) {
        out.fault = "is damaged: it must have " + std::to_string(header.num_streams()) + " streams for degree " +
                    std::to_string(header.degree) + ", got " + std::to_string(stated) + kAgain;
    }
    if (out.fault.empty() && header.row_size() * header.num_rows > kMostUnpacked) {
        out.fault = "holds more than " + std::to_string(kMostUnpacked / 1'000'000) +
                    " MB when it is unpacked, and this page reads at most that; paint it with brushgs render";
    }
    if (!out.fault.empty()) return;
    const std::vector<char> blocks = unpacked(header, content, table, out);
    if (out.fault.empty()) read_rows(header, blocks.data(), is_mirrored, out);
}

}  // namespace

void read_spz(std::string_view content, std::size_t num_packed, SceneColumns& out) {
    const bool was_gzip = num_packed > 0;
    if (content.substr(0, kMagic.size()) != kMagic.substr(0, content.size())) {
        const std::string what = content.starts_with("ply") ? "a PLY file" : "no SPZ scene";
        out.fault = "is gzip data that holds " + what + "; unpack it first, for example with gunzip";
        return;
    }
    if (content.size() < kHeaderSize) {
        out.fault = std::string("is cut off: within its header") + kAgain;
        return;
    }
    const char* begin = content.data();
    const Header header{word_at(begin + 4), word_at(begin + 8), byte_at(begin + 12), byte_at(begin + 13),
                        byte_at(begin + 14)};
    out.fault = fault_of(header, was_gzip);
    if (!out.fault.empty()) return;
    out.fault = fault_of_size(header, was_gzip ? num_packed : content.size());
    if (!out.fault.empty()) return;
    out.sh_terms = header.used_terms();
    out.is_antialiased = (header.flags & kAntialiased) != 0;
    if (header.version == kLatest) {
        read_latest(header, content, out);
        return;
    }
    const std::uint64_t needed = header.row_size() * header.num_rows, whole = kHeaderSize + needed;
    if (content.size() < whole) {
        out.fault =
            "is cut off: after " + std::to_string(content.size()) + " of " + std::to_string(whole) + " bytes" + kAgain;
        return;
    }
    const bool has_more = (header.flags & kHasExtensions) != 0;
    const auto records = content.substr(kHeaderSize + static_cast<std::size_t>(needed));
    const bool is_mirrored = has_more && read_extensions(records, out);
    if (out.fault.empty()) read_rows(header, content.data() + kHeaderSize, is_mirrored, out);
}

}  // namespace brushgs
