"""Passes that change colors: palettes, grading, broken color, and the light of a lamp."""
