"""A scene larger than memory -> a scene of fewer Gaussians, from blocks of its rows, each seen once.

    rows -> cells (where, and how large) -> sums of moments by cell -> one Gaussian per cell

Cells are those of a grid that is the same for all blocks, and moments add up: in whatever blocks the rows
come, and in whatever order, the sums are the same but for rounding. So are the strokes that are made of them.
"""
