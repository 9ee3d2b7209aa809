"""Camera files become a list of `Camera`: one module per format, listed in `formats.py`."""
