"""Many jobs from one file: `jobs` reads them, `check` judges them before the first runs, `run` runs each in
another process, `record` remembers which are finished.
"""
