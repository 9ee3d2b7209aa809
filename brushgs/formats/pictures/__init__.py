"""Pictures are read and written, videos written; the formats are listed in `formats.py`."""
