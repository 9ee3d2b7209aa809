"""One module per command: `add_flags(parser)` defines it, `run(args)` runs it and returns an exit code.

None means success. Modules import only the standard library and option classes at the top, so that `--help`
stays fast; the rest is imported on use.
"""
