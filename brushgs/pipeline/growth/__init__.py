"""Growth of a painting: coarser strokes first, and the order in which all are laid."""
