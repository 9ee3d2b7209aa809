"""Read camera files."""
