"""Paint of the page's brush -> marks of the scene, in a file that is written at each stroke.

Each state is a value, so that any can be undone. The file is whole at any time: a killed server loses nothing
but what was undone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import msgspec
import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.formats.marks import read_marks, write_marks
from brushgs.options.choices import color_code
from brushgs.options.table import Struct
from brushgs.outlets.studio.ribbon import Ribbon
from brushgs.outlets.studio.settings import CameraRequest, Json, Number, request_of
from brushgs.passes.marks.place import Below, erased_of_area, marks_of_paint
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import NO_TILE, Combs, Density, Marks, Overpaint

if TYPE_CHECKING:
    from brushgs.outlets.studio.session import Painted

MOST_POINTS = 2000  # of a stroke
MOST_SIDE = 4096  # px of the picture that is painted over
LEAST_SIZE, MOST_SIZE = 2.0, 400.0  # px, of the brush
MOST_STATES = 100  # that can be undone
HIDDEN = 1.05  # camera z of a mark over that of the surface before it, at which it is not seen
MORE, MOST_MORE = 2.0, 16.0  # factor of a stroke on the strokes per area there; limit of several
COMB_STEP = 0.5  # radii of a comb between two

Tool = Literal["paint", "smear", "erase", "bare", "dense", "comb"]
Unit = Annotated[float, msgspec.Meta(ge=0, le=1, description="a number of 0 to 1")]
Size = Annotated[float, msgspec.Meta(ge=LEAST_SIZE, le=MOST_SIZE, description="2 to 400 pixels")]


class StrokeRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A stroke of the page's brush: places in pixels of the camera, with pressure."""

    tool: Tool
    camera: CameraRequest
    points: Annotated[list[tuple[Number, Number, Unit]], msgspec.Meta(min_length=1, max_length=MOST_POINTS)]
    size: Size
    brush: str
    colors: Annotated[list[str], msgspec.Meta(min_length=1, max_length=MOST_POINTS)]
    opacity: Unit = 1.0


@dataclass(frozen=True, eq=False)
class HandStroke:
    """A stroke of the page's brush.

    Attributes:
        tool: what it does: paint; smear, paint in the colors that it passed over; erase marks; bare, take
            strokes of the scene away; dense, lay more of them; comb, turn them.
        camera: of the page.
        drawn: [n, 3] x and y, px, and pressure, 0 to 1.
        size: width of the brush at half pressure, px.
        brush: name of a built-in stroke image.
        colors: [n, 3] or [1, 3], 0 to 1.
        opacity: 0 to 1.
    """

    tool: Tool
    camera: Camera
    drawn: F64
    size: float
    brush: str
    colors: F64
    opacity: float


def read_stroke(value: Json, brushes: Sequence[str]) -> HandStroke:
    """A stroke of the request of a page. Raises ValueError, with a sentence that names the field."""
    asked = request_of(value, StrokeRequest)
    camera = asked.camera.camera("camera")
    if max(camera.width, camera.height) > MOST_SIDE:
        raise ValueError(f"camera must be at most {MOST_SIDE} pixels a side; make the window smaller")
    if asked.brush not in brushes:
        raise ValueError(f"brush must be one that the page offers, got {asked.brush[:60]!r}; reload the page")
    if len(asked.colors) not in (1, len(asked.points)):
        raise ValueError(f"colors must be one, or one for each of {len(asked.points)} points")
    colors = []
    for text in asked.colors:
        if not (text.startswith("#") and color_code(text)):
            raise ValueError(f"colors must be #rrggbb, got {text[:60]!r}")
        colors.append([int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    drawn = np.array(asked.points)
    if (np.abs(drawn[:, :2]) > 4 * MOST_SIDE).any():
        raise ValueError("points must lie near the picture")
    return HandStroke(asked.tool, camera, drawn, asked.size, asked.brush, np.array(colors), asked.opacity)


@dataclass
class Overpainting:
    """What is painted over a scene by hand, and its file. For one thread at a time.

    Attributes:
        reserve: a new name for the file, of which an empty file is made.
        path: of the file; None before the first stroke.
        below_files: of marks that lie below, and are not changed.
    """

    reserve: Callable[[], Path]
    path: Path | None = None
    below_files: tuple[Path, ...] = ()
    _states: list[Overpaint] = field(default_factory=lambda: [Overpaint()])
    _at: int = 0
    _written: tuple[int, int] | None = None
    _last: Path | None = None  # the file, while there is nothing to be in it
    _below: tuple[Gaussians, Camera, Below] | None = None

    @classmethod
    def of_files(cls, files: Sequence[Path], reserve: Callable[[], Path]) -> "Overpainting":
        """Goes on with the last of some files of marks. Raises SceneError if it cannot be read."""
        if not files:
            return cls(reserve)
        *others, path = files
        made = cls(reserve, path, tuple(others), [read_marks(path)])
        made._written = _stamp(path)
        return made

    @property
    def current(self) -> Overpaint:
        """What is painted over now."""
        return self._states[self._at]

    @property
    def files(self) -> tuple[Path, ...]:
        """All files of marks, the one that is written last."""
        return self.below_files if self.path is None else (*self.below_files, self.path)

    @property
    def facts(self) -> dict[str, object]:
        """What the page shows, for JSON."""
        marks = self.current.marks
        return {
            "file": None if self.path is None else self.path.name,
            "folder": None if self.path is None else str(self.path.resolve().parent),
            "marks": 0 if marks is None else len(marks),
            "undo": self._at,
            "redo": len(self._states) - 1 - self._at,
        }

    def add(self, stroke: HandStroke, painted: "Painted") -> bool:
        """Do what a stroke means, and write the file; False if it meets nothing.

        Raises:
            ValueError: if there would be too many marks, or the scene moves.
            SceneError: if the file cannot be written, or another program changed it.
        """
        if painted.prepared.moving is not None:
            raise ValueError("a clip cannot be painted over; open one moment of it, `brushgs view --time`")
        changed = changed_by(stroke, self.current, self._surface(stroke.camera, painted.prepared.whole_scene))
        if changed is None:
            return False
        self._keep(changed)
        self._states = [*self._states[: self._at + 1], changed][-MOST_STATES:]
        self._at = len(self._states) - 1
        return True

    def step(self, by: int) -> bool:
        """Undo (-1) or redo (1), and write the file; False if there is nothing to. Raises as `add` does."""
        at = self._at + by
        if not 0 <= at < len(self._states):
            return False
        self._keep(self._states[at])
        self._at = at
        return True

    def _surface(self, camera: Camera, scene: Gaussians) -> Below:
        if self._below is None or self._below[0] is not scene or not _is_same(self._below[1], camera):
            self._below = scene, camera, Below.in_view(camera, scene)
        return self._below[2]

    def _free(self) -> Path:
        """The name of the file before all was undone, if nobody took it; else a new one."""
        return self._last if self._last is not None and not self._last.exists() else self.reserve()

    def _keep(self, overpaint: Overpaint) -> None:
        """Write a state into the file; without anything in it there is none."""
        if self.path is not None and self._written is not None and _stamp(self.path) != self._written:
            fact = "was changed by another program since it was opened here"
            raise SceneError(self.path, f"{fact}; move it away, or open it with `brushgs view --marks`")
        if is_empty(overpaint):
            if self.path is not None:
                self.path.unlink(missing_ok=True)
            self._last, self.path, self._written = self.path, None, None
            return
        path = self.path or self._free()
        try:
            write_marks(overpaint, path)
        except BaseException:
            if self.path is None:
                path.unlink(missing_ok=True)
            raise
        self.path, self._written = path, _stamp(path)


def is_empty(overpaint: Overpaint) -> bool:
    """Whether there is nothing in it."""
    parts = (overpaint.marks, overpaint.erased, overpaint.combs, overpaint.density)
    return not any(part is not None and len(part) for part in parts)


def changed_by(stroke: HandStroke, before: Overpaint, below: Below) -> Overpaint | None:
    """What is painted over a scene after a stroke; None if it meets nothing.

    Args:
        stroke: of the hand.
        before: what was painted over.
        below: the scene in the view of the stroke.
    """
    ribbon = Ribbon.of(stroke.drawn, stroke.size)
    width, height = stroke.camera.width, stroke.camera.height
    if stroke.tool in ("paint", "smear"):
        texture = StrokeTexture.open(stroke.brush)
        paint = ribbon.paint(texture, stroke.colors, stroke.opacity, width, height)
        paint[~below.is_solid] = 0  # there is nothing that it could stay on
        marks = marks_of_paint(paint, below)
        return None if marks is None else Overpaint.joined([before, Overpaint(marks)])
    if stroke.tool == "erase":
        marks = None if before.marks is None else without(before.marks, ribbon.area(width, height), below)
        return None if marks is before.marks else replace(before, marks=marks)
    if stroke.tool == "bare":
        erased = erased_of_area(ribbon.area(width, height), below)
        return None if erased is None else Overpaint.joined([before, Overpaint(erased=erased)])
    if stroke.tool == "dense":
        dense = denser(ribbon.area(width, height), before.density, below)
        return None if dense is None else Overpaint.joined([before, Overpaint(density=dense)])
    combs = combs_of(ribbon, below)
    return None if combs is None else Overpaint.joined([before, Overpaint(combs=combs)])


def denser(area: Mask, before: Density | None, below: Below) -> Density | None:
    """Balls on the surface under an area [H, W] with more strokes than before; None without a surface.

    Each has `MORE` times the factor of the ball around its center that had most.
    """
    patches = erased_of_area(area, below)
    if patches is None:
        return None
    factors = np.ones(len(patches))
    if before is not None:
        away = np.linalg.norm(patches.means[:, None] - before.means, axis=2)
        factors = np.where(away <= before.radii, before.factors, 1.0).max(axis=1, initial=1.0)
    return Density(patches.means, patches.radii, np.minimum(MORE * factors, MOST_MORE))


def combs_of(ribbon: Ribbon, below: Below) -> Combs | None:
    """Combs along a line on the surface; None where there is none."""
    half = float(ribbon.halves.mean())
    step = max(float(np.linalg.norm(ribbon.points[1] - ribbon.points[0])), 1e-6)
    every = max(int(COMB_STEP * half / step), 1)
    points = ribbon.points[::every]
    columns, rows = np.floor(points).astype(int).T
    height, width = below.is_solid.shape
    inside = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height)
    inside[inside] = below.is_solid[rows[inside], columns[inside]]
    if inside.sum() < 2:
        return None
    z = np.exp(below.log_depth[rows[inside], columns[inside]])
    x, y = points[inside].T
    means = below.points(x, y, z)
    directions = np.gradient(means, axis=0)
    lengths = np.linalg.norm(directions, axis=1)
    keep = lengths > 1e-9 * np.abs(means).max(initial=1.0)
    if not keep.any():
        return None
    radii = z * half / float(below.camera.K[0, 0])
    directions = directions[keep] / lengths[keep, None]
    return Combs(means[keep], radii[keep], directions, np.ones(int(keep.sum())))


def without(marks: Marks, area: Mask, below: Below) -> Marks | None:
    """Marks without the paint that is seen in an area; the same object if there is none.

    Args:
        marks: over the scene.
        area: [H, W] of the view.
        below: the scene in that view; marks on surfaces that are hidden there stay.
    """
    images, keep, met = list(marks.images), np.ones(len(marks), bool), False
    for row in range(len(marks)):
        tile = int(marks.tiles[row])
        high, wide = (1, 1) if tile == NO_TILE else images[tile].shape[:2]
        gone = _seen_in(marks, row, (high, wide), area, below)
        if not gone.any():
            continue
        met = True
        if tile == NO_TILE:
            keep[row] = False
            continue
        image = images[tile].copy()
        image[gone, 3] = 0
        images[tile], keep[row] = image, bool((image[..., 3] > 1).any())
    if not met:
        return marks
    if not keep.any():
        return None
    used, tiles = np.unique(marks.tiles[keep], return_inverse=True)
    if used[0] == NO_TILE:
        used, tiles = used[1:], tiles - 1
    kept = replace(marks, images=tuple(images)).take(keep)
    return replace(kept, tiles=tiles, images=tuple(images[tile] for tile in used))


def _seen_in(marks: Marks, row: int, shape: tuple[int, int], area: Mask, below: Below) -> Mask:
    """[h, w] which texels of a mark are seen in an area."""
    camera, (high, wide) = below.camera, shape
    direction, normal = marks.directions[row], marks.normals[row]
    found = np.zeros(shape, bool)
    if (camera.position - marks.means[row]) @ normal <= 0 or _is_hidden(marks, row, below):
        return found
    s = ((np.arange(wide) + 0.5) / wide - 0.5) * marks.lengths[row]
    t = ((np.arange(high) + 0.5) / high - 0.5) * marks.widths[row]
    across = np.cross(direction, normal)
    points = marks.means[row] + s[None, :, None] * direction + t[:, None, None] * across
    rows, columns, _, inside = _pixels_of(points, camera)
    found[inside] = area[rows[inside], columns[inside]]
    return found


def _is_hidden(marks: Marks, row: int, below: Below) -> bool:
    """Whether a surface lies before the middle of a mark; a mark is flat, and the surface below it is not."""
    y, x, z, inside = _pixels_of(marks.means[row], below.camera)
    if not inside:
        return False
    surface = np.exp(below.log_depth[y, x])
    return bool(z > HIDDEN * surface + max(marks.lengths[row], marks.widths[row]))


def _pixels_of(points: F64, camera: Camera) -> tuple[Rows, Rows, F64, Mask]:
    """Rows, columns and camera z of points [..., 3], and whether they lie in the picture."""
    x, y, z = np.moveaxis(points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3], -1, 0)
    K, near = camera.K, np.maximum(z, camera.near)
    columns = np.floor(np.clip(K[0, 0] * x / near + K[0, 2], -1, camera.width)).astype(int)
    rows = np.floor(np.clip(K[1, 1] * y / near + K[1, 2], -1, camera.height)).astype(int)
    inside = (z > camera.near) & (columns >= 0) & (rows >= 0)
    return rows, columns, z, inside & (columns < camera.width) & (rows < camera.height)


def _is_same(one: Camera, other: Camera) -> bool:
    same_size = (one.width, one.height) == (other.width, other.height)
    return same_size and np.array_equal(one.viewmat, other.viewmat) and np.array_equal(one.K, other.K)


def _stamp(path: Path) -> tuple[int, int] | None:
    """What changes when a file is written; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
