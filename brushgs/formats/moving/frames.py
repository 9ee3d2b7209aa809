"""Moving scenes as files, one a moment, of any format of still scenes.

Which files are moments. Files (or folders that are scenes) whose names differ in a number alone are:

- moments, if the word before the number says so: frame_003.ply, time_00003.ply, timestep-3.spz; two are
  enough, and numbers may be missing;
- parts of one scene at rest, if it says that: tile_3.ply, chunk_3.ply, lod_3.ply, iteration_7000.ply;
- with any other word, or none (003.ply, dance_3.ply), moments if there are three or more with no number
  missing, and the first two lie in one place and hold about as many Gaussians; else parts. Who says which
  moment is meant (`--time 0.4`) says that they are moments. `--time all` says that they are parts.

Everything else is parts of one scene. No format of still scenes says when it is: the source tells how many
moments a second has, else it is `MOMENTS_PER_SECOND`. The first is at 0, and the last is shown for as long as
any other. Those whose numbers are missing take their time all the same: what is seen then is made of the
moments around it.
"""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, gcd
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import NoGaussiansError, SceneError, SceneWarning
from brushgs.formats.files import check_plain, is_dir
from brushgs.formats.moving.kept import NO_ROWS, Kept, Moments, keep_rows
from brushgs.formats.registry import formats_of, suffixes_of
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.open_file import (
    drop_unnamed_brushes,
    find_parts,
    join_notes,
    open_file,
    warn_of_other_encoding,
)
from brushgs.formats.scenes.rows import SceneFile
from brushgs.options.choices import MOMENTS_PER_SECOND
from brushgs.options.scene_source import SceneSource
from brushgs.values.arrays import F64
from brushgs.values.correspondence import are_in_one_place, have_same_rows
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.notes import LoadNotes

# Last words before the number. The first are said of nothing but moments; the second of other things that one
# finds numbered: parts of one scene, its levels of detail, versions, and states of training.
_OF_MOMENTS = {
    *("frame", "frames", "time", "times", "timestep", "timesteps", "timestamp", "moment", "moments")
}
_OF_OTHERS = {
    *("tile", "tiles", "chunk", "part", "piece", "block", "cell", "region", "section", "segment", "submap"),
    *("room", "floor", "layer", "object", "obj", "cluster", "lod", "level", "degree", "sh"),
    *("v", "ver", "version", "iter", "iteration", "iterations", "step", "steps", "epoch", "checkpoint"),
}
_SUFFIXES = set(suffixes_of(formats_of("scene"))) - {".json"}
_MOST_DIGITS = 15  # of a number, so that it is exact
# Numbers count moments where at least half of those between the first and the last are there.
_LEAST_FILLED = 0.5
Kind = Literal["moments", "unsure", "others"]


@dataclass(frozen=True, eq=False)
class Series:
    """Files with one beginning and different numbers, in the order of these."""

    paths: tuple[Path, ...]  # [F] the files or folders
    # [F] their places among the moments, ascending from 0. Places without a file are moments that are
    # missing.
    slots: NDArray[np.int64]
    kind: Kind  # what the word before the number says that they are
    is_regular: bool  # whether no number is missing: 3, 4, 5 or 10, 20, 30

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

    Raises SceneError if two files with a word for moments bear the same number.
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
    """What names the paths apart, without suffixes."""
    parts = [path.parts for path in paths]
    shortest = min(map(len, parts))
    if not shortest:  # the current folder
        return [path.name for path in paths]
    is_apart = (level for level in range(1, shortest) if len({names[-level] for names in parts}) > 1)
    level = next(is_apart, shortest)
    return [_stem(names[-level]) if level == 1 else names[-level] for names in parts]


def _stem(name: str) -> str:
    """A name without the suffix of a scene."""
    stem, point, suffix = name.rpartition(".")
    if point and f".{suffix.lower()}" in _SUFFIXES:
        name = stem
    return name[: -len(".compressed")] if name.lower().endswith(".compressed") else name


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


_FEWEST_UNSURE = 3  # files that are moments though their names do not say so
_NUM_HEADERS = 64  # of which the number of rows is asked
_EXACT = 1e-6  # of a moment: nearer than this to one, it is that one


@dataclass(frozen=True, eq=False)
class Frames:
    """Files of moments, of which at most two are in memory."""

    series: Series  # the files
    lod: int | None = None  # level of detail; None for the default of the format
    encoding: Encoding = STANDARD  # what numbers of formats without a fixed encoding mean
    rate: float = MOMENTS_PER_SECOND  # moments a second, > 0; those whose numbers are missing count
    _told: set[str] = field(default_factory=set, repr=False)

    @cached_property
    def _moments(self) -> Moments:
        return Moments(self._read)

    @property
    def paths(self) -> tuple[Path, ...]:
        """[F] the files, in order of time."""
        return self.series.paths

    @cached_property
    def times(self) -> F64:
        """[F] seconds, ascending from 0."""
        return self.series.slots / self.rate

    @property
    def duration(self) -> float:
        """Seconds, in which the last moment is shown as long as any other."""
        return (int(self.series.slots[-1]) + 1) / self.rate

    def position(self, time: float) -> float:
        """Where a time lies among the files, 0 to F - 1; that of a file where it is one."""
        position = float(np.interp(time, self.times, np.arange(len(self.times))))
        nearest = round(position)
        return float(nearest) if abs(position - nearest) < _EXACT else position

    def nearest(self, time: float) -> int:
        """The file whose moment is nearest; of two the earlier."""
        return int(np.argmin(np.round(np.abs(self.series.slots - time * self.rate), 6)))

    def file(self, index: int) -> SceneFile | None:
        """The header of one moment; None for one without Gaussians.

        Raises SceneError if it is not there, is no scene, or is damaged.
        """
        try:
            return open_file(self.paths[index], self.lod)
        except NoGaussiansError:
            return None

    @cached_property
    def has_rows(self) -> bool:
        """Whether rows correspond, from a few moments: the first two, the middle, and the last two.

        The numbers of rows in up to 64 headers must be equal, and rows must be like themselves in most of the
        three pairs, see `have_same_rows`: a firework that bursts between two moments is unlike itself there,
        but what was trained moment by moment is so everywhere. Moments that cannot be read, or are without
        Gaussians, are passed over here.
        """
        last = len(self.paths) - 1
        if len({self._count(index) for index in _spread(last + 1)} - {None, 0}) > 1:
            return False
        found = [self._correspond(start, start + 1) for start in sorted({0, last // 2, last - 1})]
        return found.count(True) > found.count(False)

    def sample(self, time: float) -> Gaussians:
        """The Gaussians of one moment: of a file, or between two if rows correspond, else of the nearer.

        Where rows correspond, every moment has all of them, see `Moments.at`.
        """
        if not self.has_rows:
            return self.moment(self.nearest(time))
        position = self.position(time)
        for index in {int(position), ceil(position)}:
            self._check_count(index)
        return self._moments.at(position, self._head[0])

    def moment(self, index: int) -> Gaussians:
        """What can be drawn of the moment of a file."""
        return self._moments[index].without_broken()

    def notes(self) -> LoadNotes:
        """What the first moment that has Gaussians says beside them; it stands for all."""
        file = self._head[1]
        notes = join_notes([file], rows_dropped=0, sh_degree_used=SH_TERMS[file.num_terms])
        what = f"{len(self.paths):,} moments at {self.rate:g} a second, {file.format}"
        return replace(notes, format=what, moments_per_second=self.rate)

    def scene(self) -> MovingScene:
        """The clip as a moving scene."""
        notes = self.notes()
        return MovingScene(self.duration, self.has_rows, self.sample, times=self.times, notes=notes)

    @cached_property
    def _head(self) -> tuple[int, SceneFile]:
        """The first moment with Gaussians, and its header.

        Raises SceneError if there is none, or one before it cannot be read.
        """
        for index in range(len(self.paths)):
            if file := self.file(index):
                return index, file
        raise SceneError(self.paths[0], "and all moments after it hold no Gaussians; export them again")

    def _check_count(self, index: int) -> None:
        """Refuse a moment that has other rows than those that were compared."""
        count, head = len(self._moments[index].gaussians), self._head[1]
        if count not in (0, head.num_rows):
            what = f"holds {count:,} Gaussians and {head.path.name} {head.num_rows:,}"
            cure = "though rows correspond in the moments that were compared; export it again or remove it"
            raise SceneError(self.paths[index], f"{what}, {cure}")

    def _count(self, index: int) -> int | None:
        """Rows of a moment as its header says; None if it cannot be read."""
        try:
            file = self.file(index)
        except SceneError:
            return None
        return 0 if file is None else file.num_rows

    def _correspond(self, before: int, after: int) -> bool | None:
        """Whether the rows of two moments correspond; None if one cannot be read or has none."""
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
                warn_of_other_encoding(file.path, columns)
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
        """Drop brushes of strokes that are rows of another set than that of the first moment."""
        drop_unnamed_brushes(file, columns)
        head = self._head[1]
        if columns.brushes is not None and file.brushes != head.brushes:
            columns.brushes = None
            if self._is_first("brushes"):
                message = f"the brushes of its strokes are dropped, as those of {head.path.name} are others"
                warnings.warn(SceneWarning(f"{file.path}: {message}"), stacklevel=2)

    def _is_first(self, fault: str) -> bool:
        """Whether something is said for the first time: not of each of 100,000 files."""
        is_first = fault not in self._told
        self._told.add(fault)
        return is_first

    def __getstate__(self) -> dict[str, Any]:
        """For pickle, since scenes cross processes: without open files and what is in memory."""
        return {name: value for name, value in vars(self).items() if name not in ("_moments", "_head")}


def open_frames(source: SceneSource) -> MovingScene | None:
    """The moving scene that files or a folder hold, one a moment; None if they are no moments.

    Its rows correspond if they do in three pairs of moments, see `Frames.has_rows`. Which rows rest is not
    known, as all moments would have to be read.

    Raises SceneError if a folder holds no scene, the first moment is no scene or is damaged, or two files are
    of one moment.
    """
    clip = find_frames(source)
    return None if clip is None else clip.scene()


def find_frames(source: SceneSource, encoding: Encoding = STANDARD) -> Frames | None:
    """As `open_frames`, without looking at rows. Names decide, and where these do not the first two files."""
    if source.time is not None and source.time.is_all:
        return None
    series = find_series(find_parts(source.paths))
    if series is None or (series.kind == "others" and source.time is None):
        return None
    for path in source.paths if len(source.paths) > 1 else ():
        # Typed, so that each should be there, before hours of work; what a folder lists was asked.
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
    """Whether files whose names leave it open seem to be moments; a SceneWarning says so."""
    series = clip.series
    if len(series.paths) < _FEWEST_UNSURE or not series.is_regular:
        return False
    try:
        first, second = (clip.moment(index) for index in (0, 1))
    except SceneError:  # which the reader of still scenes says too
        return False
    if not len(first) or not len(second) or not are_in_one_place(first, second):
        return False
    what = f"{series.span} lie in one place and are taken for moments of a moving scene"
    warnings.warn(SceneWarning(f"{what}; if they are parts of one scene, add --time all"), stacklevel=2)
    return True


def _spread(count: int) -> Sequence[int]:
    """Up to 64 of so many moments, from the first to the last."""
    return [int(index) for index in np.unique(np.linspace(0, count - 1, min(count, _NUM_HEADERS)).round())]
