"""Stroke images and kernels: the coverage of one stroke, and its filtered copies for small sizes."""
