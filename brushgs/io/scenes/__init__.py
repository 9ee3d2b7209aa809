"""Scene files become Gaussians, and Gaussians scene files: one file per format."""
