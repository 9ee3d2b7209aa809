"""Reduce a moving scene to Gaussians at their reference moments, and animate the strokes made of them."""
