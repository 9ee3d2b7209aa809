"""Strokes as textured rectangles for 3D programs: one .glb file, with the brushes and the first camera."""
