"""A scene larger than memory is read in blocks, each once, and merged to as many Gaussians as memory holds.

Strokes are then made of these as of a scene. Which rows are merged depends on the memory limit, not on the
blocks or on where they are read: see `brushgs.passes.reduce.block_cells`.
"""
