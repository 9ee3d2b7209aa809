"""How many strokes a scene is worth in a view."""
