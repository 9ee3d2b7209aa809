// The bytes of a scene file in memory -> columns of drawable Gaussians, for a page that has no Python.
// The contract is that of brushgs/formats/scenes: the same rows in the same order, and the same sentence where a file
// is refused. Scales and opacities may differ in the last bit, as `exp` does between NumPy and the C library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace brushgs {

struct GaussianColumns {
    std::vector<float> means;      // [count, 3] world units
    std::vector<float> quats;      // [count, 4] w, x, y, z; not zero
    std::vector<float> scales;     // [count, 3] standard deviations, world units
    std::vector<float> opacities;  // [count] 0 to 1
    std::vector<float> sh;         // [count, sh_terms, 3]
    std::size_t count = 0;
    std::size_t sh_terms = 1;  // 1, 4, 9 or 16
};

// These rows of it.
GaussianColumns taken(const GaussianColumns& gaussians, const std::vector<std::uint32_t>& rows);

struct SceneColumns : GaussianColumns {
    std::size_t num_dropped = 0;  // rows that cannot be drawn
    bool is_antialiased = false;  // see brushgs/values/notes.py
    int up = -1;                  // the axis that the file says is up: +x, +y, +z, -x, -y, -z; -1: it does not
    std::string fault;            // why the file is refused, one sentence; empty if it was read
};

// Reads a binary PLY of the layout of 3DGS trainers, a .splat or an SPZ; the bytes decide which, and for a .splat the
// suffix of the file too. Of gzip data it takes the content, and the bytes that it had packed; else 0.
SceneColumns read_scene_rows(std::string_view bytes, bool is_named_splat, std::size_t num_packed);

}  // namespace brushgs
