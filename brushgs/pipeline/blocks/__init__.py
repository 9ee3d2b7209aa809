"""A scene larger than memory is read in blocks, each once, and merged to as many Gaussians as memory holds.

Whatever makes strokes goes on with these as with a scene. Which rows are merged depends on the memory that
may be used, and neither on the blocks nor on where they are read: see `brushgs.passes.reduce.block_cells`.
"""
