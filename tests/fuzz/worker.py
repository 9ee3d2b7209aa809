"""The process that reads damaged files: `python -m tests.fuzz.worker`, started by `run.py`.

It may crash, hang or take too much memory: its folder holds what it was reading, and its progress is in a few
bytes shared with the process that watches it.
"""

import struct
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

STATE = struct.Struct("<QQdQ")  # inputs done, inputs begun, seconds (monotonic) of the begin, worst memory
# Beside all of `brushgs.formats`: the modules that use what a file holds.
_USERS = ("brushgs.brushes.texture", "brushgs.pipeline.background")


def main() -> None:
    """Arguments: module:reader (or reader+reader), folder, engine, seed, most inputs of each, seconds."""
    module, _, names = sys.argv[1].partition(":")
    folder, engine = Path(sys.argv[2]), sys.argv[3]
    seed, max_inputs, seconds = int(sys.argv[4]), int(sys.argv[5]), float(sys.argv[6])
    if engine == "atheris":
        import atheris

        with atheris.instrument_imports(include=["brushgs"]):  # before anything else imports them
            from brushgs import formats

            modules = walk_packages(formats.__path__, "brushgs.formats.")
            for name in (*_USERS, *(module.name for module in modules)):
                import_module(name)
    from tests.fuzz.reading import Worker

    for number, name in enumerate(names.split("+")):
        worker = Worker(import_module(module).READERS[name], folder, seed + number)
        if engine == "atheris":
            worker.run_atheris(max_inputs, seconds)
        else:
            worker.warm_up()
            worker.run(max_inputs, seconds)


if __name__ == "__main__":
    main()
