"""Files become Gaussians, cameras and stroke images; Gaussians and frames become files."""
