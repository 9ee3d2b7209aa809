"""Turn paint over a picture of a scene into marks in space, and marks into strokes."""
