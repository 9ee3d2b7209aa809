"""Files of guides: lines in space that strokes run along; see `formats.py`."""
