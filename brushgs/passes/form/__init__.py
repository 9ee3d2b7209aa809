"""Passes that change the form of strokes: direction, size, brush, gaps and edges."""
