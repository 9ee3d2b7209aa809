"""The number of strokes that a scene is worth in a view: estimated, or searched for a target."""
