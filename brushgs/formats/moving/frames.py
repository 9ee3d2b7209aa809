"""Read moving scenes stored as one file per moment, in any format of still scenes.

Files (or folders that are scenes) whose names differ only in a number are:

- moments, if the word before the number says so: frame_003.ply, time_00003.ply, timestep-3.spz; two are
  enough, and numbers may be missing;
- parts of one still scene, if it says that: tile_3.ply, chunk_3.ply, lod_3.ply, iteration_7000.ply;
- with any other word, or none (003.ply, dance_3.ply), moments if there are three or more, no number is
  missing, and the first two lie in one place and hold about as many Gaussians; otherwise parts.

A time in seconds (`--time 0.4`) makes all of these moments, `--time all` makes them parts. All other files
are parts of one scene.

Formats of still scenes store no time: the source gives the rate, by default `MOMENTS_PER_SECOND`. The first
moment is at 0, and the last is shown as long as the others. A missing number leaves a gap in time, filled
from the moments around it.
"""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, gcd
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import NoGaussiansError, SceneError, SceneWarning
from brushgs.formats.files import check_plain, is_dir
from brushgs.formats.moving.kept import EXACT, NO_ROWS, Kept, Moments, keep_rows
from brushgs.formats.registry import formats_of, suffixes_of
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.open_file import drop_brushes, find_parts, join_notes, open_file, warn_of_encoding
from brushgs.formats.scenes.rows import SceneFile
from brushgs.options.choices import MOMENTS_PER_SECOND
from brushgs.options.scene_source import SceneSource
from brushgs.values.arrays import F64
from brushgs.values.correspondence import are_in_one_place, have_same_rows
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.notes import LoadNotes

# Words before the number: those used for moments only, and those for other numbered files (parts of a scene,
# levels of detail, versions, training checkpoints).
_OF_MOMENTS = {
    *("frame", "frames", "time", "times", "timestep", "timesteps", "timestamp", "moment", "moments")
}
_OF_OTHERS = {
    *("tile", "tiles", "chunk", "part", "piece", "block", "cell", "region", "section", "segment", "submap"),
    *("room", "floor", "layer", "object", "obj", "cluster", "lod", "level", "degree", "sh"),
    *("v", "ver", "version", "iter", "iteration", "iterations", "step", "steps", "epoch", "checkpoint"),
}
_SUFFIXES = set(suffixes_of(formats_of("scene"))) - {".json"}
_MOST_DIGITS = 15  # of a number, so that it is exact as a float
# Numbers are used as times only if at least this share of the range from first to last exists.
_LEAST_FILLED = 0.5
Kind = Literal["moments", "unsure", "others"]


class Series(NamedTuple):
    """Files whose names share a prefix and differ in their number, sorted by number."""

    paths: tuple[Path, ...]  # [F] the files or folders
    # [F] index of the moment of each file, ascending from 0; indices without a file are missing moments
    slots: NDArray[np.int64]
    kind: Kind  # by the word before the number
    is_regular: bool  # whether no number is missing: 3, 4, 5 or 10, 20, 30

    @property
    def num_missing(self) -> int:
        """Number of moments without a file."""
        return int(self.slots[-1]) + 1 - len(self.slots)

    @property
    def span(self) -> str:
        """The first and the last file, for messages."""
        return f"{_shown(self.paths[0])} to {_shown(self.paths[-1])}"


def find_series(paths: Sequence[Path]) -> Series | None:
    """The series that two or more paths form, in any order; None if they form none.

    The number is in the file names or, if these are equal, in the name of a folder above them:
    frame_3/point_cloud.ply. Numbers in steps of two or ten count like 0, 1, 2. If fewer than half of the
    numbers between the first and the last exist, or any has a decimal point, only their order is used.

    Raises SceneError if two files with a word for moments have the same number.
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
            suffix = paths[row].name[len(_stem(paths[row].name)) :]
            cure = f"name one kind, by a pattern such as '{paths[row].parent / '*'}{suffix}'"
            is_one_folder = paths[row].parent == paths[after].parent
            raise SceneError(paths[row], f"{twice}; {cure if is_one_folder else 'name one folder'}")
    slots, is_regular = _slots_of([numbers[row] for row in order])
    return Series(tuple(paths[row] for row in order), slots, kind, is_regular)


def _labels(paths: Sequence[Path]) -> list[str]:
    """The part of each path that differs, without scene suffixes."""
    parts = [path.parts for path in paths]
    shortest = min(map(len, parts))
    if not shortest:  # the current folder
        return [path.name for path in paths]
    is_apart = (level for level in range(1, shortest) if len({names[-level] for names in parts}) > 1)
    level = next(is_apart, shortest)
    return [_stem(names[-level]) if level == 1 else names[-level] for names in parts]


def _stem(name: str) -> str:
    """A name without its scene suffix."""
    stem, point, suffix = name.rpartition(".")
    if point and f".{suffix.lower()}" in _SUFFIXES:
        name = stem
    return name[: -len(".compressed")] if name.lower().endswith(".compressed") else name


def _kind_of(beginning: str) -> Kind:
    word = re.split("[^a-z]+", beginning.lower().rstrip("_-. "))[-1]
    return "moments" if word in _OF_MOMENTS else "others" if word in _OF_OTHERS else "unsure"


def _slots_of(numbers: Sequence[str]) -> tuple[NDArray[np.int64], bool]:
    """Moment index of each of the ascending numbers, and whether none is missing."""
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
    """The name of a path for messages; with its folder if the name itself has no number."""
    return path.name if any(c.isdigit() for c in path.name) else f"{path.parent.name}/{path.name}"


_FEWEST_UNSURE = 3  # files needed to be taken for moments if their names do not say so
_NUM_HEADERS = 64  # headers whose number of rows is compared


@dataclass(frozen=True, eq=False)
class Frames:
    """A clip of one file per moment, of which at most two are in memory."""

    series: Series  # the files
    lod: int | None = None  # level of detail; None for the default of the format
    encoding: Encoding = STANDARD  # of formats without a fixed encoding
    rate: float = MOMENTS_PER_SECOND  # moments per second, > 0, missing moments included
    _told: set[str] = field(default_factory=set, repr=False)

    @cached_property
    def _moments(self) -> Moments:
        return Moments(self._read)

    @cached_property
    def times(self) -> F64:
        """[F] sample times in seconds, ascending from 0."""
        return self.series.slots / self.rate

    @property
    def duration(self) -> float:
        """Seconds; the last moment is shown as long as the others."""
        return (int(self.series.slots[-1]) + 1) / self.rate

    def position(self, time: float) -> float:
        """Fractional file index of a time, 0 to F - 1; an integer within `EXACT` of a file."""
        position = float(np.interp(time, self.times, np.arange(len(self.times))))
        nearest = round(position)
        return float(nearest) if abs(position - nearest) < EXACT else position

    def nearest(self, time: float) -> int:
        """Index of the file nearest in time; the earlier of two equally near."""
        return int(np.argmin(np.round(np.abs(self.series.slots - time * self.rate), 6)))

    def file(self, index: int) -> SceneFile | None:
        """The header of one moment; None if it holds no Gaussians.

        Raises SceneError if the file is missing, no scene, or damaged.
        """
        try:
            return open_file(self.series.paths[index], self.lod)
        except NoGaussiansError:
            return None

    @cached_property
    def has_rows(self) -> bool:
        """Whether rows correspond over time, judged from three pairs: the first, middle and last two moments.

        The numbers of rows in up to 64 headers must be equal, and rows must match in most of the three pairs,
        see `have_same_rows`: a scene may change abruptly in one pair (a firework bursts), but moments trained
        independently match in none. Moments that cannot be read, or hold no Gaussians, are skipped here.
        """
        last = len(self.series.paths) - 1
        some = np.unique(np.linspace(0, last, min(last + 1, _NUM_HEADERS)).round().astype(int)).tolist()
        if len({self._count(index) for index in some} - {None, 0}) > 1:
            return False
        found = [self._correspond(start, start + 1) for start in sorted({0, last // 2, last - 1})]
        return found.count(True) > found.count(False)

    def sample(self, time: float) -> Gaussians:
        """The Gaussians at a time in seconds: interpolated if rows correspond, else of the nearest file.

        If rows correspond, every moment has all of them, see `Moments.at`.
        """
        if not self.has_rows:
            return self.moment(self.nearest(time))
        position = self.position(time)
        for index in {int(position), ceil(position)}:
            self._check_count(index)
        return self._moments.at(position, self._head[0])

    def moment(self, index: int) -> Gaussians:
        """The drawable Gaussians of one file."""
        return self._moments[index].without_broken()

    def notes(self) -> LoadNotes:
        """The notes of the first moment with Gaussians, used for the whole clip."""
        file = self._head[1]
        notes = join_notes([file], rows_dropped=0, sh_degree_used=SH_TERMS[file.num_terms])
        what = f"{len(self.series.paths):,} moments at {self.rate:g} a second, {file.format}"
        return replace(notes, format=what, moments_per_second=self.rate)

    def scene(self) -> MovingScene:
        """The clip as a moving scene."""
        notes = self.notes()
        return MovingScene(self.duration, self.has_rows, self.sample, times=self.times, notes=notes)

    @cached_property
    def _head(self) -> tuple[int, SceneFile]:
        """Index and header of the first moment with Gaussians.

        Raises SceneError if there is none, or one before it cannot be read.
        """
        for index in range(len(self.series.paths)):
            if file := self.file(index):
                return index, file
        fact = "and all moments after it hold no Gaussians"
        raise SceneError(self.series.paths[0], f"{fact}; export them again")

    def _check_count(self, index: int) -> None:
        """Refuse a moment whose number of rows differs from that of the first."""
        count, head = len(self._moments[index].gaussians), self._head[1]
        if count not in (0, head.num_rows):
            what = f"holds {count:,} Gaussians and {head.path.name} {head.num_rows:,}"
            cure = "though rows correspond in the moments that were compared; export it again or remove it"
            raise SceneError(self.series.paths[index], f"{what}, {cure}")

    def _count(self, index: int) -> int | None:
        """Number of rows in the header of a moment; None if it cannot be read."""
        try:
            file = self.file(index)
        except SceneError:
            return None
        return 0 if file is None else file.num_rows

    def _correspond(self, before: int, after: int) -> bool | None:
        """Whether the rows of two moments correspond; None if one cannot be read or is empty."""
        try:
            first, second = (self._moments[index].gaussians for index in (before, after))
        except SceneError:
            return None
        return have_same_rows(first, second) if len(first) and len(second) else None

    def _read(self, index: int) -> Kept:
        file = self.file(index)
        if file is None:
            return NO_ROWS
        if file.has_fixed_encoding and not self.encoding.is_standard:
            raise SceneError(file.path, f"is a {file.format}, whose encoding is fixed; omit the encoding")
        antialiased = file.training == "antialiased"
        columns, dropped = file.read_columns(self.encoding)
        if not dropped.num_rows:
            if self.encoding.is_standard and not file.has_fixed_encoding and self._is_first("encoding"):
                warn_of_encoding(file.path, columns)
            self._check_brushes(file, columns)
            return Kept(columns.gaussians(antialiased=antialiased))
        del columns
        if self._is_first("rows") or dropped.num_rows == file.num_rows:
            dropped.report(file.path, file.num_rows)
        columns, _ = file.read_columns(is_raw=True)
        self._check_brushes(file, columns)
        encoding = STANDARD if file.has_fixed_encoding else self.encoding
        return keep_rows(columns, encoding, antialiased=antialiased)[0]

    def _check_brushes(self, file: SceneFile, columns: Columns) -> None:
        """Drop the brushes of strokes if they refer to another set than those of the first moment."""
        drop_brushes(file, columns)
        head = self._head[1]
        if columns.brushes is not None and file.stored.brushes != head.stored.brushes:
            columns.brushes = None
            if self._is_first("brushes"):
                message = f"the brushes of its strokes are dropped, as those of {head.path.name} are others"
                warnings.warn(SceneWarning(f"{file.path}: {message}"), stacklevel=2)

    def _is_first(self, fault: str) -> bool:
        """Whether a fault is reported for the first time, so that it is not repeated for 100,000 files."""
        is_first = fault not in self._told
        self._told.add(fault)
        return is_first

    def __getstate__(self) -> dict[str, Any]:
        """Pickle without cached moments and headers: scenes are sent to other processes."""
        return {name: value for name, value in vars(self).items() if name not in ("_moments", "_head")}


def open_frames(source: SceneSource) -> MovingScene | None:
    """Open a moving scene stored as one file per moment, listed or in a folder; None if they are no moments.

    Whether rows correspond is judged from three pairs of moments, see `Frames.has_rows`. Which rows rest is
    unknown, as that would need all moments.

    Raises SceneError if a folder holds no scene, the first moment is no scene or is damaged, or two files
    have the same number.
    """
    return clip.scene() if (clip := find_frames(source)) else None


def find_frames(source: SceneSource, encoding: Encoding = STANDARD) -> Frames | None:
    """As `open_frames`, but without comparing rows: decides by names, or else by the first two files."""
    if source.time is not None and source.time.is_all:
        return None
    series = find_series(find_parts(source.paths))
    if series is None or (series.kind == "others" and source.time is None):
        return None
    for path in source.paths if len(source.paths) > 1 else ():
        # Paths that a user listed must exist before hours of work start; those of a folder listing do.
        if not is_dir(path):
            check_plain(path, "scene file")
    clip = Frames(series, source.lod, encoding, source.moments_per_second or MOMENTS_PER_SECOND)
    if series.kind == "unsure" and source.time is None and not _looks_like_moments(clip):
        return None
    if series.num_missing:
        after = series.paths[int(np.argmax(np.diff(series.slots) > 1))].name
        what = f"{series.num_missing:,} of {int(series.slots[-1]) + 1:,} moments are missing by their numbers"
        message = f"{what}, first after {after}; what is seen then is made of the moments around it"
        warnings.warn(SceneWarning(f"{series.paths[0].parent}: {message}"), stacklevel=2)
    return clip


def _looks_like_moments(clip: Frames) -> bool:
    """Whether files with undecided names look like moments; if so, a SceneWarning reports it."""
    series = clip.series
    if len(series.paths) < _FEWEST_UNSURE or not series.is_regular:
        return False
    try:
        first, second = (clip.moment(index) for index in (0, 1))
    except SceneError:  # the reader of still scenes reports it too
        return False
    if not len(first) or not len(second) or not are_in_one_place(first, second):
        return False
    what = f"{series.span} lie in one place and are taken for moments of a moving scene"
    warnings.warn(SceneWarning(f"{what}; if they are parts of one scene, add --time all"), stacklevel=2)
    return True
