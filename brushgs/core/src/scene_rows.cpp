#include "brushgs/scene_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "brushgs/row_sink.hpp"
#include "brushgs/rows.hpp"
#include "brushgs/spz_rows.hpp"

namespace brushgs {

namespace {

static_assert(std::endian::native == std::endian::little, "rows are copied as they stand in files");

constexpr std::size_t kSplatRow = 32;  // position and scales as float32; r, g, b, opacity and w, x, y, z as bytes
constexpr std::size_t kMostHeader = std::size_t{1} << 20, kMostProperties = 1000, kMostElements = 100;

// Text of a file, latin-1, as Python's repr shows it, in UTF-8.
std::string quoted(std::string_view text, std::size_t most) {
    constexpr std::string_view digits = "0123456789abcdef";
    std::string shown = "'";
    for (const char c : text.substr(0, most)) {
        const auto byte = static_cast<std::uint8_t>(c);
        if (byte == '\t') {
            shown += "\\t";
        } else if (byte < 32 || (byte >= 127 && byte <= 160) || byte == 173) {
            shown += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
        } else if (byte == '\\' || byte == '\'') {
            shown += {'\\', c};
        } else if (byte < 127) {
            shown += c;
        } else {
            shown += {static_cast<char>(0xc0 | byte >> 6), static_cast<char>(0x80 | (byte & 63))};
        }
    }
    return shown + "'";
}

void read_splat(std::string_view bytes, SceneColumns& out) {
    if (bytes.size() % kSplatRow != 0) {
        out.fault = "the bytes of a .splat scene must be a multiple of 32, got " + std::to_string(bytes.size()) +
                    "; it is cut off or of another format: copy or download it again";
        return;
    }
    reserve(out, bytes.size() / kSplatRow);
    RowSink sink{out};
    for (const char* row = bytes.data(); row != bytes.data() + bytes.size(); row += kSplatRow) {
        std::array<float, 6> numbers;
        std::array<std::uint8_t, 8> octets;
        std::memcpy(numbers.data(), row, sizeof numbers);
        std::memcpy(octets.data(), row + sizeof numbers, sizeof octets);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            sink.mean[axis] = numbers[axis];
            sink.scale[axis] = std::log(numbers[3 + axis]);
            sink.sh[axis] = (static_cast<float>(octets[axis]) / 255 - 0.5F) / kC0;
        }
        sink.logit = logit_of(octets[3]);
        for (std::size_t i = 0; i < 4; ++i) sink.quat[i] = (static_cast<float>(octets[4 + i]) - 128) / 128;
        sink.add();
    }
}

// Whether a row may be one of a .splat: `_is_plausible` of brushgs/formats/format.py.
bool is_plausible(const char* row) {
    constexpr float largest = 1e6F;
    std::array<float, 6> numbers;
    std::array<std::uint8_t, 8> octets;
    std::memcpy(numbers.data(), row, sizeof numbers);
    std::memcpy(octets.data(), row + sizeof numbers, sizeof octets);
    float square = 0;
    for (std::size_t i = 4; i < 8; ++i) square += std::pow((static_cast<float>(octets[i]) - 128) / 128, 2.0F);
    const auto scales = numbers.begin() + 3;
    return std::all_of(numbers.begin(), scales, [](float value) { return std::abs(value) < largest; }) &&
           std::all_of(scales, numbers.end(), [](float value) { return value >= 0 && value < largest; }) &&
           *std::max_element(scales, numbers.end()) > 0 && square > 0.95F * 0.95F && square < 1.05F * 1.05F;
}

// Whether bytes are a .splat, which has no magic number: by the name of the file unless they are text, or by some rows.
bool is_splat(std::string_view bytes, bool is_named_splat) {
    const auto is_text = [](char c) { return (c >= 32 && c < 127) || c == '\t' || c == '\r' || c == '\n'; };
    const std::size_t count = bytes.size() / kSplatRow, num_inspected = std::min<std::size_t>(64, count);
    if (is_named_splat) return !std::ranges::all_of(bytes.substr(0, 64), is_text);
    if (bytes.size() % kSplatRow != 0 || count < 8) return false;
    for (std::size_t i = 0; i < num_inspected; ++i) {
        if (!is_plausible(bytes.data() + kSplatRow * (i * count / num_inspected))) return false;
    }
    return true;
}

enum class Number { i1, u1, i2, u2, i4, u4, f4, f8 };

struct Property {
    std::string_view name;
    Number type;
    std::size_t offset;  // bytes from the start of a row
};

struct Element {
    std::string_view name;
    std::size_t count = 0, row_size = 0;
    std::vector<Property> properties;
    std::vector<std::string_view> lists;

    const Property* find(std::string_view wanted) const {
        const auto found = std::ranges::find(properties, wanted, &Property::name);
        return found == properties.end() ? nullptr : &*found;
    }
};

struct Header {
    std::string_view encoding;
    std::vector<Element> elements;
    std::size_t data = 0;                          // offset of the first row
    bool is_flat = false, is_antialiased = false;  // by the last comment that states how the scene was trained
    std::string fault;
};

constexpr std::array<std::pair<std::string_view, Number>, 16> kTypes{{
    {"char", Number::i1},
    {"int8", Number::i1},
    {"uchar", Number::u1},
    {"uint8", Number::u1},
    {"short", Number::i2},
    {"int16", Number::i2},
    {"ushort", Number::u2},
    {"uint16", Number::u2},
    {"int", Number::i4},
    {"int32", Number::i4},
    {"uint", Number::u4},
    {"uint32", Number::u4},
    {"float", Number::f4},
    {"float32", Number::f4},
    {"double", Number::f8},
    {"float64", Number::f8},
}};
constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    while (true) {
        const std::size_t start = line.find_first_not_of(" \t\v\f");
        if (start == std::string_view::npos) return words;
        line.remove_prefix(start);
        const std::size_t end = std::min(line.find_first_of(" \t\v\f"), line.size());
        words.push_back(line.substr(0, end));
        line.remove_prefix(end);
    }
}

// The number of rows that an element states; more than a file can hold stays more than it can hold.
bool read_count(std::string_view text, std::size_t& count) {
    if (text.empty() || !std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; })) return false;
    count = 0;
    for (const char c : text.substr(0, 9)) count = 10 * count + static_cast<std::size_t>(c - '0');
    if (text.size() > 9) count = 999'999'999;
    return true;
}

void add_property(Header& header, std::string_view type, std::string_view name) {
    Element& element = header.elements.back();
    const auto known = std::ranges::find(kTypes, type, &std::pair<std::string_view, Number>::first);
    if (known == kTypes.end()) {
        header.fault = "property " + quoted(name, 80) + " has the unknown type " + quoted(type, 40) +
                       "; write it as one of char, uchar, short, ushort, int, uint, float, double";
    } else if (element.properties.size() >= kMostProperties) {
        header.fault = "the header must name at most 1000 properties of an element; export it as a 3DGS scene";
    } else if (element.find(name) != nullptr) {
        header.fault = "property " + quoted(name, 80) + " stands twice in the header; export it again";
    } else {
        element.properties.push_back({name, known->second, element.row_size});
        element.row_size += kSizes[static_cast<std::size_t>(known->second)];
    }
}

void read_line(Header& header, std::string_view line) {
    const auto words = words_of(line);
    if (words.empty()) return;
    if (words[0] == "comment" || words[0] == "obj_info") {
        std::string text;
        for (std::size_t i = 1; i < words.size(); ++i) text += words[i];
        const auto to_lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
        std::ranges::transform(text, text.begin(), to_lower);
        const bool is_flat = text == "splatrendermode:2dgs";
        const bool is_antialiased = text == "splatrendermode:mip" || text == "antialiased1";
        if (is_flat || is_antialiased || text == "splatrendermode:default" || text == "antialiased0") {
            header.is_flat = is_flat;
            header.is_antialiased = is_antialiased;
        }
    } else if (words[0] == "format" && words.size() == 3 && header.elements.empty() &&
               (words[1] == "ascii" || words[1] == "binary_little_endian" || words[1] == "binary_big_endian")) {
        header.encoding = words[1];
    } else if (words[0] == "element" && words.size() == 3) {
        Element element;
        element.name = words[1];
        if (header.elements.size() >= kMostElements) {
            header.fault = "the header must name at most 100 elements; export it as a 3DGS scene";
        } else if (!read_count(words[2], element.count)) {
            header.fault = "element " + quoted(words[1], 80) + " must have a whole number of rows, got " +
                           quoted(words[2], 40) + "; export it again";
        }
        header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && !header.elements.empty()) {
        header.elements.back().lists.push_back(words[4]);
    } else if (words[0] == "property" && words.size() == 3 && !header.elements.empty()) {
        add_property(header, words[1], words[2]);
    } else {
        header.fault = "the header line " + quoted(line, 80) + " is not PLY; the file is damaged: get it again";
    }
}

Header read_header(std::string_view bytes) {
    Header header;
    const std::string_view newline = bytes.starts_with("ply\r\n") ? "\r\n" : bytes.substr(3, 1);
    const std::string last = std::string(newline) + "end_header" + std::string(newline);
    const std::size_t end = bytes.substr(0, kMostHeader).find(last);
    if (end == std::string_view::npos) {
        header.fault = "the header has no 'end_header' line; the file is cut off or damaged: get it again";
        return header;
    }
    header.data = end + last.size();
    std::string_view rest = bytes.substr(0, end);
    while (header.fault.empty()) {
        const std::size_t next = rest.find(newline);
        if (next == std::string_view::npos) break;
        rest.remove_prefix(next + newline.size());
        read_line(header, rest.substr(0, rest.find(newline)));
    }
    if (header.fault.empty() && header.encoding.empty()) {
        header.fault = "the header has no 'format' line; the file is damaged: get it again";
    }
    return header;
}

template <class T>
float number_at(const char* place) {
    T value;
    std::memcpy(&value, place, sizeof value);
    return static_cast<float>(value);
}

float read_number(const char* row, const Property& property) {
    const char* place = row + property.offset;
    switch (property.type) {
        case Number::i1:
            return number_at<std::int8_t>(place);
        case Number::u1:
            return number_at<std::uint8_t>(place);
        case Number::i2:
            return number_at<std::int16_t>(place);
        case Number::u2:
            return number_at<std::uint16_t>(place);
        case Number::i4:
            return number_at<std::int32_t>(place);
        case Number::u4:
            return number_at<std::uint32_t>(place);
        case Number::f4:
            return number_at<float>(place);
        default:
            return number_at<double>(place);
    }
}

// The spherical-harmonic terms of each row, from its f_rest properties; 0 and a fault if they are no complete bands.
std::size_t count_terms(const Element& vertex, std::string& fault) {
    std::size_t num_rest = 0;
    for (const Property& one : vertex.properties) num_rest += one.name.starts_with("f_rest_") ? 1 : 0;
    std::string gap;
    for (std::size_t i = 0; i < num_rest; ++i) {
        const std::string name = "f_rest_" + std::to_string(i);
        if (vertex.find(name) == nullptr && (gap.empty() || name < gap)) gap = name;
    }
    for (const std::size_t terms : {1U, 4U, 9U, 16U}) {
        if (num_rest == 3 * (terms - 1) && gap.empty()) return terms;
    }
    fault = "must have 0, 9, 24 or 45 f_rest properties (degree 0 to 3), got " + std::to_string(num_rest) +
            (gap.empty() ? "" : " and no " + quoted(gap, 80)) +
            "; export it with complete bands of spherical harmonics";
    return 0;
}

bool is_in_range(const Element& element, std::string_view prefix) {
    return std::ranges::any_of(element.properties, [&](const Property& one) { return one.name.starts_with(prefix); });
}

// Why the rows are no 3D Gaussians, as `check_inria` says it; empty if they are.
std::string fault_of_vertex(const Header& header, const Element& vertex) {
    if (!is_in_range(vertex, "scale_") && !is_in_range(vertex, "rot_") && !is_in_range(vertex, "f_dc_")) {
        const auto face = std::ranges::find(header.elements, "face", &Element::name);
        if (face != header.elements.end() && face->count > 0) {
            return "is a mesh (" + std::to_string(face->count) + " faces), not a 3D Gaussian scene; " +
                   "train a scene from pictures of it first";
        }
        if (vertex.find("x") != nullptr && vertex.find("y") != nullptr && vertex.find("z") != nullptr) {
            return "is a plain point cloud without scales and rotations; train it as a 3DGS scene first";
        }
    }
    for (const std::string_view name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
                                        "rot_0", "rot_1", "rot_2", "rot_3"}) {
        if (vertex.find(name) != nullptr) continue;
        if (std::ranges::find(vertex.lists, name) != vertex.lists.end()) {
            return "property " + quoted(name, 80) + " is a list; export it as a 3D Gaussian scene";
        }
        return "no property " + quoted(name, 80) + " among " + std::to_string(vertex.properties.size()) +
               " read; export it as a 3D Gaussian scene";
    }
    return "";
}

// What this page leaves to `brushgs render`; empty if nothing.
std::string left_out(const Header& header, const Element& vertex) {
    if (header.encoding != "binary_little_endian") return "is a PLY as text or big-endian";
    if (vertex.find("packed_position") != nullptr) return "is a compressed PLY";
    if (vertex.find("filter_3D") != nullptr) return "is a scene of Mip-Splatting with a filter";
    return "";
}

// Offset of the rows of `vertex`; 0 and a fault if they cannot be found or the file is cut off.
std::size_t start_of_rows(const Header& header, const Element& vertex, std::size_t size, std::string& fault) {
    std::size_t start = header.data;
    for (const Element& other : header.elements) {
        if (!other.lists.empty() && (other.count > 0 || &other == &vertex)) {
            fault = "has the list property " + quoted(other.lists[0], 80) + " of element " + quoted(other.name, 80) +
                    (&other == &vertex ? " in" : " before") +
                    " element 'vertex', so its rows cannot be found; export it without lists";
            return 0;
        }
        if (&other == &vertex) break;
        if (other.count > size / std::max<std::size_t>(other.row_size, 1))
            start = size;
        else
            start += other.count * other.row_size;
    }
    const std::uint64_t end = start + std::uint64_t{vertex.count} * vertex.row_size;
    if (end > size) {
        const std::size_t complete = size > start ? (size - start) / std::max<std::size_t>(vertex.row_size, 1) : 0;
        fault = "is cut off: of " + std::to_string(vertex.count) + " rows of element 'vertex' " +
                std::to_string(complete) + " are complete and " + std::to_string(end - size) +
                " bytes are missing; copy or export it again";
        return 0;
    }
    return start;
}

void read_rows(const char* rows, const Element& vertex, bool is_flat, SceneColumns& out) {
    const auto found = [&](const std::string& name) { return vertex.find(name); };
    std::array<const Property*, 3> means{}, scales{}, colors{};
    std::array<const Property*, 4> quats{};
    for (std::size_t i = 0; i < 4; ++i) quats[i] = found("rot_" + std::to_string(i));
    for (std::size_t i = 0; i < 3; ++i) {
        means[i] = found(std::string(1, static_cast<char>('x' + i)));
        scales[i] = i == 2 && is_flat ? nullptr : found("scale_" + std::to_string(i));
        colors[i] = found("f_dc_" + std::to_string(i));
    }
    std::vector<const Property*> rest;  // term by term, three channels each
    for (std::size_t term = 1; term < out.sh_terms; ++term) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
            rest.push_back(found("f_rest_" + std::to_string(channel * (out.sh_terms - 1) + term - 1)));
        }
    }
    const Property& opacity = *found("opacity");
    reserve(out, vertex.count);
    RowSink sink{out};
    for (std::size_t row = 0; row < vertex.count; ++row, rows += vertex.row_size) {
        for (std::size_t i = 0; i < 3; ++i) {
            sink.mean[i] = read_number(rows, *means[i]);
            sink.scale[i] =
                scales[i] == nullptr ? -std::numeric_limits<float>::infinity() : read_number(rows, *scales[i]);
            sink.sh[i] = read_number(rows, *colors[i]);
        }
        for (std::size_t i = 0; i < 4; ++i) sink.quat[i] = read_number(rows, *quats[i]);
        sink.logit = read_number(rows, opacity);
        for (std::size_t i = 0; i < rest.size(); ++i) sink.sh[3 + i] = read_number(rows, *rest[i]);
        sink.add();
    }
}

void read_ply(std::string_view bytes, SceneColumns& out) {
    const Header header = read_header(bytes);
    out.fault = header.fault;
    if (!out.fault.empty()) return;
    const auto vertex = std::ranges::find(header.elements, "vertex", &Element::name);
    if (vertex == header.elements.end()) {
        std::string names;
        for (const Element& one : header.elements) names += (names.empty() ? "" : ", ") + std::string(one.name);
        out.fault =
            "has no element 'vertex' among: " + (names.empty() ? "none" : names) + "; export it as a 3D Gaussian scene";
        return;
    }
    if (vertex->count == 0) {
        out.fault = "holds no Gaussians: its header says 'element vertex 0'; export the scene again";
        return;
    }
    if (const std::string what = left_out(header, *vertex); !what.empty()) {
        out.fault = what + ", which this page does not read; paint it with brushgs, or export it as a binary PLY";
        return;
    }
    out.fault = fault_of_vertex(header, *vertex);
    if (!out.fault.empty()) return;
    out.sh_terms = count_terms(*vertex, out.fault);
    if (!out.fault.empty()) return;
    out.is_antialiased = header.is_antialiased;
    const std::size_t start = start_of_rows(header, *vertex, bytes.size(), out.fault);
    if (!out.fault.empty()) return;
    read_rows(bytes.data() + start, *vertex, header.is_flat || vertex->find("scale_2") == nullptr, out);
}

// Drops bands of spherical harmonics that are zero in every row.
void drop_zero_bands(SceneColumns& out) {
    std::size_t used = 1;
    for (std::size_t row = 0; row < out.count && used < out.sh_terms; ++row) {
        const float* terms = out.sh.data() + 3 * out.sh_terms * row;
        for (const std::size_t stop : {4U, 9U, 16U}) {
            if (stop <= used || stop > out.sh_terms) continue;
            const std::size_t start = stop == 4 ? 1 : stop == 9 ? 4 : 9;
            if (std::any_of(terms + 3 * start, terms + 3 * stop, [](float value) { return value != 0; })) used = stop;
        }
    }
    if (used == out.sh_terms) return;
    for (std::size_t row = 0; row < out.count; ++row) {
        std::memmove(out.sh.data() + 3 * used * row, out.sh.data() + 3 * out.sh_terms * row, 3 * used * sizeof(float));
    }
    out.sh.resize(3 * used * out.count);
    out.sh_terms = used;
}

}  // namespace

GaussianColumns taken(const GaussianColumns& gaussians, const std::vector<std::uint32_t>& rows) {
    return {taken_from(gaussians.means.data(), 3, rows),
            taken_from(gaussians.quats.data(), 4, rows),
            taken_from(gaussians.scales.data(), 3, rows),
            taken_from(gaussians.opacities.data(), 1, rows),
            taken_from(gaussians.sh.data(), 3 * gaussians.sh_terms, rows),
            rows.size(),
            gaussians.sh_terms};
}

SceneColumns read_scene_rows(std::string_view bytes, bool is_named_splat, std::size_t num_packed) {
    SceneColumns out;
    if (bytes.empty()) {
        out.fault = "is empty; copy or download it again";
    } else if (num_packed > 0 || bytes.starts_with("NGSP")) {
        read_spz(bytes, num_packed, out);
    } else if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) {
        read_ply(bytes, out);
    } else if (is_splat(bytes, is_named_splat)) {
        read_splat(bytes, out);
    } else {
        out.fault = "is neither a PLY nor a .splat or SPZ, which this page reads; brushgs render paints other scenes";
    }
    if (!out.fault.empty()) return out;
    if (out.count == 0) {
        out.fault = "no row of " + std::to_string(out.num_dropped) + " can be used; export the scene again";
        return out;
    }
    drop_zero_bands(out);
    return out;
}

}  // namespace brushgs
