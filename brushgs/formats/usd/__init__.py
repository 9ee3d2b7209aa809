"""USD files, through the package usd-core: what reads them is a process of its own.

The libraries of USD crash on some damaged files, and know no bounds of time and memory. So `process` has
another process open the stage and write what is needed of it as plain arrays, see `child`.
"""
