"""Stroke images and kernels: what one stroke covers, and its copies filtered for small sizes."""
