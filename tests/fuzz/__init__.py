"""Untrusted files: every reader is fed damaged files until it fails, hangs, or allocates too much memory.

`python -m tests.fuzz READER --seconds 600` is the long run, `test_fuzz.py` the short one of the suite.
"""
