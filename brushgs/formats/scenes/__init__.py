"""Scene files become Gaussians and Gaussians scene files: one module per format, listed in `formats.py`."""
