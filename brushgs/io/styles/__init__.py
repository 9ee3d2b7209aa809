"""Style files: JSON that people can read and edit, see `format.py`; `read.py` reads them, `write.py` writes.

Colours are "#rrggbb", numbers plain; only arrays are base64. The offsets of a colour are relative to it: who
edits one colour moves all that is around it.
"""
