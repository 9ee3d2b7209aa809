"""Choose the number of strokes for a scene in a view: estimated, or searched for a target."""
