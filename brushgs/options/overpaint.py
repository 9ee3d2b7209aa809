"""Paint laid over a scene by hand, from files of marks."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, ClassVar

from brushgs.options.table import Options, option


def _path(text: str) -> Path:
    if not text.strip():
        raise ValueError("must be a file of marks, got an empty name")
    return Path(text)


def _paths(given: "Path | str | Iterable[Path | str]") -> tuple[Path, ...]:
    return tuple(map(Path, [given] if isinstance(given, Path | str) else given))


Balls = tuple[tuple[float, ...], ...]  # rows of a `Density`: x, y, z, radius, factor of strokes per area


class OverpaintConfig(Options, frozen=True):
    """Files of marks, applied in order.

    Attributes:
        balls: further changes of stroke density, beside those in the files. Tuples, which compare by value:
            while they are equal, strokes need not be made again.
    """

    GROUP: ClassVar = "marks"
    ABOUT: ClassVar = "paint laid over the scene by hand"
    # fmt: off
    files: Annotated[tuple[Path, ...], option("marks that `brushgs adopt` made of paint over a picture: laid "
        "last, where the scene has what was painted over, in every view; repeatable, the later above "
        "#overpaint #retouch #highlight #hand #edit #erase", flag="--marks", default="none",
        metavar="FILE.marks", read=_path, make=_paths, action="append")] = ()
    continues: Annotated[bool, option("continue the marks: strokes like those painted over get colors, "
        "sizes and directions #learn #propagate #same #rest", flag="--continue")] = False
    # fmt: on
    balls: Balls = ()
