"""Read and write scene files."""
