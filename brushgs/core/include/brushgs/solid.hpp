// Strokes -> more opaque and smaller ones, at equal opacity x area: brushgs/passes/form/solid.py says why.
#pragma once

#include "brushgs/surroundings.hpp"

namespace brushgs {

// Writes scales [count, 3] and opacities [count]. The new opacity is o + strength x s x o (1 - o): with o that of the
// stroke and s the share of light that it and its neighbors stop at its center.
template <class T>
void make_solid(const StrokeQuery<T>& strokes, double strength, T* scales, T* opacities);

}  // namespace brushgs
