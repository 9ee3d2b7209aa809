"""What is painted over a picture of a scene becomes marks in space, and marks become strokes."""
