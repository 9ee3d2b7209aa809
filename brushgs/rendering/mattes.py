"""Mattes: coverage of pixels by stroke, brush, region or layer of paint."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.rendering.fragments import Fragments, Shares
from brushgs.rendering.marks import LaidCoat, Marks
from brushgs.values.arrays import F32, Array
from brushgs.values.layers import Matte

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat

LEAST = 0.5 / 255  # of a pixel: dropped ranks together cover less
SCENE = "scene"  # plain Gaussians
GROUND = "ground"
ELSEWHERE = "elsewhere"  # no region

Keys = tuple[NDArray[np.int32], Sequence[str] | Callable[[int], str]]  # [marks] keys, and their names


class MatteMaker:
    """Collects a matte, a band of rows at a time.

    Args:
        marks: of the view.
        keys: [marks] item of each mark, and the items' names.
        rest: item that takes the rest of each pixel's alpha; None for a matte of strokes alone.
        alpha: [H, W] of the picture, with `rest`.
    """

    def __init__(
        self, marks: Marks, keys: Keys, *, rest: str | None = None, alpha: Array | None = None
    ) -> None:
        self._marks, (self._keys, self._names) = marks, keys
        self._rest, self._alpha = rest, alpha
        self._found: list[Shares] = []

    def add(self, rows: slice, fragments: Fragments) -> None:
        """Add the fragments of the next band of rows."""
        self._found.append(fragments.shares(self._keys, LEAST, self._marks.num_threads))

    def result(self) -> Matte:
        """The matte of the whole picture."""
        is_used = np.zeros(int(self._keys.max(initial=0)) + 1, bool)
        for shares in self._found:
            is_used[shares.keys] = True
        used = np.flatnonzero(is_used)
        names = [self._names(key) if callable(self._names) else self._names[key] for key in used.tolist()]
        row_of = np.cumsum(is_used, dtype=np.int32) - np.int32(1)
        ranks = max(1, *(int(np.diff(shares.starts).max(initial=0)) for shares in self._found))
        rows, coverage = _ranked(self._found, row_of, ranks)
        if self._rest is not None:
            assert self._alpha is not None, "a rest is what is missing of an alpha"
            names, rows, coverage = _with_rest(names, rows, coverage, self._rest, self._alpha.ravel())
        shape = self._marks.camera.height, self._marks.camera.width, rows.shape[1]
        return Matte(tuple(names), rows.reshape(shape), coverage.reshape(shape))


def _ranked(found: Sequence[Shares], row_of: NDArray[np.int32], ranks: int) -> tuple[NDArray[np.int32], F32]:
    """[P, ranks] rows of names (-1 if unused) and their coverage."""
    num_pixels = sum(len(shares.starts) - 1 for shares in found)
    rows = np.full((num_pixels, ranks), -1, np.int32)
    coverage = np.zeros((num_pixels, ranks), np.float32)
    first = 0
    for shares in found:
        counts = np.diff(shares.starts)
        of_pixel = ranks * np.arange(first, first + len(counts)) - shares.starts[:-1]
        places = np.arange(len(shares.keys)) + np.repeat(of_pixel, counts)
        rows.reshape(-1)[places] = row_of[shares.keys]
        coverage.reshape(-1)[places] = shares.weights
        first += len(counts)
    return rows, coverage


def _with_rest(
    names: list[str], rows: NDArray[np.int32], coverage: F32, rest: str, alpha: Array
) -> tuple[list[str], NDArray[np.int32], F32]:
    """Ranks [P, K] with one more item that covers the rest of `alpha`."""
    left = np.maximum(alpha - coverage.sum(axis=1), 0).astype(np.float32)
    key = names.index(rest) if rest in names else len(names)
    names = [*names, rest] if key == len(names) else names
    rows = np.column_stack([rows, np.where(left > 0, key, -1).astype(np.int32)])
    coverage = np.column_stack([coverage, left])
    order = np.argsort(-coverage, axis=1, kind="stable")
    rows, coverage = np.take_along_axis(rows, order, axis=1), np.take_along_axis(coverage, order, axis=1)
    ranks = max(int(np.count_nonzero(coverage.max(axis=0, initial=0) >= LEAST)), 1)
    return names, np.ascontiguousarray(rows[:, :ranks]), np.ascontiguousarray(coverage[:, :ranks])


def coat_names(coats: "Iterable[Coat]") -> list[str]:
    """The name of each coat, including glazes; duplicates are numbered from 2."""
    names: list[str] = []
    for coat in coats:
        name, number = coat.name, 2
        while name in names:
            name, number = f"{coat.name}{number}", number + 1
        names.append(name)
    return names


def stroke_names(coats: "Sequence[Coat]") -> list[str]:
    """Matte names of all strokes of a painting, by stroke number, see `DeepSamples`."""
    names: list[str] = []
    for name, coat in zip(coat_names(coats), coats, strict=True):
        names += [_stroke_name(name, row) for row in range(len(coat.strokes))]
        names += [SCENE] * (0 if coat.plain is None else len(coat.plain))
    return names


def _stroke_name(coat: str, row: int) -> str:
    return f"{coat}_{row}"


def _names_of(marks: Marks) -> list[str]:
    return coat_names(laid.coat for laid in marks.all_laid)


def by_stroke(marks: Marks) -> Keys:
    """Keys by stroke: its coat and row."""
    names, firsts = _names_of(marks), marks.first_numbers
    scene = int(firsts[-1])

    def name(key: int) -> str:
        if key == scene:
            return SCENE
        coat = int(np.searchsorted(firsts, key, side="right")) - 1
        return _stroke_name(names[coat], key - int(firsts[coat]))

    return np.where(_is_plain(marks), scene, marks.numbers).astype(np.int32), name


def by_brush(marks: Marks) -> Keys:
    """Keys by brush."""
    names: list[str] = [SCENE]

    def of_coat(_: int, laid: LaidCoat) -> NDArray[np.int32]:
        textures = BrushSet.of(laid.coat.texture).textures
        keys = np.array([_key_in(names, texture.name) for texture in textures], np.int32)
        brushes = laid.boxes.brushes if laid.boxes.brushes is not None and len(textures) > 1 else None
        of_box = np.full(len(laid.boxes), keys[0]) if brushes is None else keys[brushes]
        return np.where(laid.is_plain, 0, of_box)

    return marks.each(of_coat, np.int32), names


def by_region(marks: Marks, region_names: Sequence[str]) -> Keys | None:
    """Keys by region; None if the scene has no regions."""
    columns = [(laid.coat.strokes.regions, laid) for laid in marks.laid]
    if all(regions is None for regions, _ in columns):
        return None

    def of_coat(_: int, laid: LaidCoat) -> NDArray[np.int32]:
        parts = (laid.coat.strokes, laid.coat.plain)
        regions = [
            np.zeros(len(part), np.uint8) if part.regions is None else part.regions
            for part in parts
            if part is not None
        ]
        return np.concatenate(regions)[laid.boxes.ids].astype(np.int32)

    def name(key: int) -> str:
        if key == 0:
            return ELSEWHERE
        return region_names[key - 1] if key <= len(region_names) else f"region {key}"

    return marks.each(of_coat, np.int32), name


def by_layer(marks: Marks) -> Keys:
    """Keys by coat."""
    names = [*_names_of(marks), SCENE]
    coats = np.asarray(marks.covering, np.int64)[marks.coats]
    return np.where(_is_plain(marks), len(names) - 1, coats).astype(np.int32), names


def rest_name(marks: Marks, *, is_opaque: bool) -> str | None:
    """Name of the item for uncovered alpha: the ground, else the glazes; None without either."""
    if is_opaque:
        return GROUND
    return next(
        (name for name, laid in zip(_names_of(marks), marks.all_laid, strict=True) if laid.tint is not None),
        None,
    )


def _is_plain(marks: Marks) -> NDArray[np.bool_]:
    return marks.each(lambda _, laid: laid.is_plain, np.bool_)


def _key_in(names: list[str], name: str) -> int:
    if name not in names:
        names.append(name)
    return names.index(name)
