"""Scene files become Gaussians, and Gaussians scene files."""
