// Niantic's SPZ, versions 1 to 4 -> columns of drawable Gaussians. The contract is that of
// brushgs/formats/scenes/spz.py and spz_container.py, which know the sources.
#pragma once

#include <string_view>

#include "brushgs/scene_rows.hpp"

namespace brushgs {

// Reads the content of a file, without gzip, where it took `num_packed` bytes; 0: it is the file itself.
void read_spz(std::string_view content, std::size_t num_packed, SceneColumns& out);

}  // namespace brushgs
