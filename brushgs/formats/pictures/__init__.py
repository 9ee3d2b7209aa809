"""Read and write pictures; write videos."""
