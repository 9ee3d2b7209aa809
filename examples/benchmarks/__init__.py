"""Benchmarks: `python -m examples.benchmarks.NAME` from a checkout. Tests do not run them."""
