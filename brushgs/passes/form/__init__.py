"""Passes that change how strokes lie: direction, size, brush, gaps and edges."""
