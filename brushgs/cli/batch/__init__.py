"""Many jobs from one file: `jobs` reads them, `check` judges them before the first runs, `run` runs each in a
process of its own, `done` remembers which are finished.
"""
