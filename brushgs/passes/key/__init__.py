"""A lamp in the scene lights strokes: arrays in, arrays out; others say where it stands, and its strength."""

from brushgs.passes.key.normals import stroke_normals
from brushgs.passes.key.shade import KeyLight

__all__ = ["KeyLight", "stroke_normals"]
