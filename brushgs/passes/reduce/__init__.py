"""Fewer Gaussians: cleaning, pruning, clustering and merging, also block by block."""
