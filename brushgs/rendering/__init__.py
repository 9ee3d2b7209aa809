"""Gaussians and camera -> boxes; boxes and stroke texture -> frame; forward and backward."""
