"""Passes that change colours: palettes, grading, broken colour, and the light of a lamp."""
