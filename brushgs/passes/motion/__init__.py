"""A moving scene -> its Gaussians at their reference moments, and how the strokes made of them move."""
