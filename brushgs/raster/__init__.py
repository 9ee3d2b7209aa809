"""Boxes and a stroke texture become a frame."""
