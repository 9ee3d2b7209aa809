"""Error, likeness and temporal measures, and the commands built on them: bench and stability."""
