// Strokes -> which of them are worth their place in the budget: brushgs/passes/reduce/worth.py says which are not.
#pragma once

#include "brushgs/surroundings.hpp"

namespace brushgs {

constexpr double kFaintStroke = 0.06;  // opacity, relative to that of the scene

// Marks [count], 1 or 0, of strokes as merged, not solidified yet. Opacities are relative to those of the scene: if
// the 99th percentile is below 0.8, they are scaled up to it. All are worth it if all opacities are 0.
template <class T>
std::vector<std::uint8_t> worth_keeping(const StrokeQuery<T>& strokes);

}  // namespace brushgs
