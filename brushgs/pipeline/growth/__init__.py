"""How a painting comes into being: coarser strokes to begin with, and the order in which all are laid."""
