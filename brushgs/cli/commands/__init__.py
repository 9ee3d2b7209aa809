"""One module per command: `add_flags(parser)` defines it, `run(args)` runs it and returns an exit code.

None means success. At the top a module imports only the standard library, so that `--help` stays fast; the
rest is imported where it is used.
"""
