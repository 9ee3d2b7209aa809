"""Prints which of the trained scenes that tables are measured on are here.

    python -m examples.benchmarks.scenes

They belong to others, so they are no part of the repository; examples/measured/scenes.md tells of each.
"""

import os
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

FOLDER = Path(os.environ.get("BRUSHGS_SCENES") or Path(__file__).resolve().parents[3] / "shared" / "scenes")
CURE = "see examples/measured/scenes.md; BRUSHGS_SCENES may name another folder"
PAGE = Path(__file__).resolve().parents[1] / "measured" / "scenes.md"


def known() -> list[str]:
    """The files that the page tells of, as they are named in `FOLDER`."""
    return re.findall(r"^\| `([^`]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def present(names: Iterable[str], files: Mapping[str, str | None]) -> list[str]:
    """The scenes that are here; of each other one a sentence on stderr says that it is left out.

    Args:
        names: of scenes, in order.
        files: the file of each in `FOLDER`; None for the example scene, which is always here.

    Raises:
        SystemExit: if none is here.
    """
    found = []
    for name in names:
        file = files[name]
        if file is None or (FOLDER / file).exists():
            found.append(name)
        else:
            print(f"{name} is left out: {FOLDER / file} is missing, {CURE}", file=sys.stderr)
    return found or sys.exit("none of the scenes is here")


def main() -> None:
    """Say which scenes are here."""
    files = known()
    found = present(files, dict(zip(files, files, strict=True)))
    print(*(f"{FOLDER / file} is here" for file in found), sep="\n")


if __name__ == "__main__":
    main()
