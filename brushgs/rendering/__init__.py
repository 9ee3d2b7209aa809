"""Gaussians and a camera become boxes, boxes and a stroke texture become a frame; forward and backward."""
