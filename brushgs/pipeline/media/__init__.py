"""From strokes to coats of paint: one file for each medium, each a function of the strokes alone."""
