"""The process that opens USD files: `python -m brushgs.io.usd.child KIND PATH FOLDER`, see `process`.

It writes arrays as FOLDER/NAME.npy and then FOLDER/header.json: a JSON object, with the only field "error"
where something is wrong with the file, in a clause as SceneError has it.
"""

import json
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from brushgs.io.usd.refused import RefusedError

_MEMORY = 2 << 30, 24  # bytes of address space, and as many more for each byte of the file


def main() -> None:
    """Read one file."""
    kind, path, folder = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    most = _MEMORY[0] + _MEMORY[1] * path.stat().st_size
    _bound_memory(most)
    from pxr import Tf

    try:
        header = import_module(f"brushgs.io.usd.{kind}").read(path, folder)
    except RefusedError as error:
        header = {"error": str(error)}
    except Tf.ErrorException:
        header = {"error": "is damaged, or no USD file; export it again"}
    except MemoryError:
        header = {"error": "needs too much memory; export only what is needed of it"}
    (folder / "header.json").write_text(json.dumps(header), encoding="utf-8")


def _bound_memory(most: int) -> None:
    """At most so many bytes of address space, and no core dump.

    Where no process can be bound (Windows), and where the system refuses this bound (macOS, or a lower one
    holds), time alone bounds what a file may cost.
    """
    try:
        import resource
    except ImportError:
        return
    for what, bound in ((resource.RLIMIT_AS, most), (resource.RLIMIT_CORE, 0)):
        with suppress(ValueError, OSError):
            resource.setrlimit(what, (bound, bound))


if __name__ == "__main__":
    main()
