"""Files from strangers: every reader is fed damaged files until it fails, hangs, or asks for too much memory.

`python -m tests.fuzz READER --seconds 600` is the long run, `test_fuzz.py` the short one of the suite.
"""
