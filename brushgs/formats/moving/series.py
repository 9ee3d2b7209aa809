"""Which files are numbered like the moments of a moving scene: their names alone are looked at."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import gcd
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.registry import formats_of, suffixes_of

# Last words before the number. The first are said of nothing but moments; the second of other things that one
# finds numbered: parts of one scene, its levels of detail, versions, and states of training.
_OF_MOMENTS = {
    *("frame", "frames", "time", "times", "timestep", "timesteps", "timestamp", "moment", "moments"),
}
_OF_OTHERS = {
    *("tile", "tiles", "chunk", "part", "piece", "block", "cell", "region", "section", "segment", "submap"),
    *("room", "floor", "layer", "object", "obj", "cluster", "lod", "level", "degree", "sh"),
    *("v", "ver", "version", "iter", "iteration", "iterations", "step", "steps", "epoch", "checkpoint"),
}
_SUFFIXES = {suffix for suffix in suffixes_of(formats_of("scene")) if suffix != ".json"}
_MOST_DIGITS = 15  # of a number, so that it is exact
# Numbers count moments where at least half of those between the first and the last are there.
_LEAST_FILLED = 0.5
Kind = Literal["moments", "unsure", "others"]


@dataclass(frozen=True, eq=False)
class Series:
    """Files with one beginning and different numbers, in the order of these.

    Attributes:
        paths: [F] the files or folders.
        slots: [F] their places among the moments, ascending from 0. Places without a file are moments that
            are missing.
        kind: what the word before the number says that they are.
        is_regular: whether no number is missing: 3, 4, 5 or 10, 20, 30.
    """

    paths: tuple[Path, ...]
    slots: NDArray[np.int64]
    kind: Kind
    is_regular: bool

    @property
    def num_missing(self) -> int:
        """Moments without a file."""
        return int(self.slots[-1]) + 1 - len(self.slots)

    @property
    def span(self) -> str:
        """The first and the last file in words."""
        return f"{_shown(self.paths[0])} to {_shown(self.paths[-1])}"


def find_series(paths: Sequence[Path]) -> Series | None:
    """The series that two or more paths are, in any order; None if they are none.

    What differs is the name of the files, or where all have one name, that of a folder above them:
    frame_3/point_cloud.ply. Numbers by twos or tens count like 0, 1, 2. Where fewer than half of the numbers
    between the first and the last are there, they do not count moments, and only their order is taken.

    Raises:
        SceneError: if two files with a word for moments bear the same number.
    """
    if len(paths) < 2:
        return None
    found = [re.fullmatch(r"(.*?)([0-9]+(?:\.[0-9]+)?)", label) for label in _labels(paths)]
    matches = [match for match in found if match is not None and len(match[2]) <= _MOST_DIGITS]
    if len(matches) < len(paths) or len({match[1] for match in matches}) > 1:
        return None
    kind = _kind_of(matches[0][1])
    numbers = [match[2] for match in matches]
    order = sorted(range(len(paths)), key=lambda row: (float(numbers[row]), str(paths[row])))
    for row, after in pairwise(order):
        if float(numbers[row]) == float(numbers[after]):
            if kind != "moments":
                return None
            twice = f"bears the same number as {_shown(paths[after])}, so that one moment is there twice"
            is_one_folder = paths[row].parent == paths[after].parent
            pattern = f"by a pattern such as '{paths[row].parent / '*'}{_suffix(paths[row])}'"
            raise SceneError(
                paths[row], f"{twice}; name one {f'kind, {pattern}' if is_one_folder else 'folder'}"
            )
    slots, is_regular = _slots_of([numbers[row] for row in order])
    return Series(tuple(paths[row] for row in order), slots, kind, is_regular)


def _labels(paths: Sequence[Path]) -> list[str]:
    """What names the paths apart, without suffixes."""
    parts = [path.parts for path in paths]
    level = 1
    shortest = min(map(len, parts))
    while level < shortest and len({names[-level] for names in parts}) == 1:
        level += 1
    if not shortest:  # the current folder
        return [path.name for path in paths]
    return [_stem(names[-level]) if level == 1 else names[-level] for names in parts]


def _stem(name: str) -> str:
    """A name without the suffix of a scene."""
    stem, point, suffix = name.rpartition(".")
    if point and f".{suffix.lower()}" in _SUFFIXES:
        name = stem
    return name[: -len(".compressed")] if name.lower().endswith(".compressed") else name


def _suffix(path: Path) -> str:
    return path.name[len(_stem(path.name)) :]


def _kind_of(beginning: str) -> Kind:
    word = re.split("[^a-z]+", beginning.lower().rstrip("_-. "))[-1]
    return "moments" if word in _OF_MOMENTS else "others" if word in _OF_OTHERS else "unsure"


def _slots_of(numbers: Sequence[str]) -> tuple[NDArray[np.int64], bool]:
    """Places of ascending numbers, and whether none is missing."""
    places = np.arange(len(numbers))
    if any("." in number for number in numbers):
        return places, False
    values = [int(number) for number in numbers]
    stride = gcd(*(after - value for value, after in pairwise(values)))
    count = (values[-1] - values[0]) // stride + 1
    if len(values) < _LEAST_FILLED * count:
        return places, False
    return np.array([(value - values[0]) // stride for value in values]), len(values) == count


def _shown(path: Path) -> str:
    """The name that tells a path apart, for sentences; with its folder, as files in folders share names."""
    return path.name if any(c.isdigit() for c in path.name) else f"{path.parent.name}/{path.name}"
