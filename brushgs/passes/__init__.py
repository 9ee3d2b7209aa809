"""Passes turn Gaussians into Gaussians, fewer and larger: the strokes in space."""
