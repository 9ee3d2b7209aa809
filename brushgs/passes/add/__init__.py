"""What is added to the strokes of a scene: accents, a backdrop or a stage, and lines."""
