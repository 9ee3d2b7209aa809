"""Many jobs from one file: `jobs` reads them, `check` validates all before the first runs, `run` runs them in
other processes, `record` stores which are finished.
"""
