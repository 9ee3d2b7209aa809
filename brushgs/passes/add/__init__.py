"""Passes that add strokes: accents, a backdrop or a stage, and lines."""
