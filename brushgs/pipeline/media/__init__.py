"""From strokes to coats of paint: one file per medium, each a function of the strokes alone."""
