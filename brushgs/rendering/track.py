"""A whole camera path -> directions of strokes in each view, without flips, spins or pops.

`project(lock="anchor")` chooses directions by one view, which is stable except for views along a stroke's
longest axis. If the path is known, directions are chosen over all of it at once, see `track_directions`.
Given the `Track`, every frame can be drawn alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import Order
from brushgs.rendering.canonical import Canonical
from brushgs.rendering.knots import Knots, knots_of, middle_and_reach
from brushgs.rendering.project import LOW_PASS, Directions, project
from brushgs.rendering.visibility import visible_areas
from brushgs.values.arrays import F32, F64, Array, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

NUM_LOOKS = 24  # small views along a path in which visible areas are measured
NUM_STILLS, STILL_SIDE = 12, 160  # small views in which directions are compared with those of stills
SURE = 0.05  # least disagreement, as share of the visible area, from which a stroke is reversed
TRACKED_COLUMNS = ("means", "quats", "scales", "opacities")  # columns that directions depend on


@dataclass(frozen=True, eq=False)
class Track:
    """Directions of strokes along a camera path.

    Attributes:
        turns: [K, N] int16, directions at the K knots of the path, in 2^-16 turns from +x towards +y.
        area_scales: [K, N] uint16 or None, see `Directions`; logarithm to base 2 in steps of 1 /
            `_core.AREA_SCALE_STEPS`.
        positions: [F] positions of the frames among the knots, 0 to K - 1.
    """

    turns: NDArray[np.int16]  # [K, N]
    area_scales: NDArray[np.uint16] | None  # [K, N]
    positions: F64  # [F]

    def __len__(self) -> int:
        """Number of frames of the path."""
        return len(self.positions)

    def directions(self, frame: int) -> Directions:
        """Directions of strokes in one frame, for `project` and `render`.

        Args:
            frame: index of the frame, 0 to F - 1.

        Raises:
            IndexError: if there is no such frame.
        """
        if not 0 <= frame < len(self):
            raise IndexError(f"directions: frame must be 0 to {len(self) - 1}, got {frame}")
        knot = min(int(self.positions[frame]), len(self.turns) - 1)
        after = min(knot + 1, len(self.turns) - 1)
        share = np.float32(self.positions[frame] - knot)
        step = self.turns[after] - self.turns[knot]  # wraps: steps are less than half a turn
        angles = (self.turns[knot] + share * step) * np.float32(2 * pi / 65536)
        angles -= np.float32(2 * pi) * (angles > pi)
        angles += np.float32(2 * pi) * (angles <= -pi)
        if self.area_scales is None:
            return Directions(angles)
        octaves = (1 - share) * self.area_scales[knot] + share * self.area_scales[after]
        return Directions(angles, np.exp2(octaves / np.float32(_core.AREA_SCALE_STEPS)))


def track(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    *,
    num_sigmas: float | F64 = 2.0,
    low_pass: float = LOW_PASS,
    fade: bool = False,
    order: Order = "soft",
    num_threads: int | None = None,
) -> Iterator[Boxes]:
    """Boxes of every view of a path, with directions chosen over the whole path.

    Args:
        gaussians: N Gaussians in world space.
        cameras: the views in order, all of one size. If the last equals the first the path is closed, and
            strokes return to their initial directions.
        num_sigmas: see `project`.
        low_pass: see `project`.
        fade: see `project`.
        order: see `project`.
        num_threads: see `project`.

    Raises:
        ValueError: if there is no camera, sizes differ, or an option is out of range.

    Example:
        >>> cameras = bg.orbit(gaussians, 12, width=160, height=120)
        >>> for camera, boxes in zip(cameras, bg.track(strokes, cameras)):
        ...     frame = bg.rasterize(boxes, "flat", width=camera.width, height=camera.height)
    """
    path = track_directions(gaussians, cameras, low_pass=low_pass, num_threads=num_threads)
    for frame, camera in enumerate(cameras):
        yield project(
            gaussians,
            camera,
            num_sigmas=num_sigmas,
            low_pass=low_pass,
            lock=path.directions(frame),
            fade=fade,
            order=order,
            num_threads=num_threads,
        )


def track_directions(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    *,
    fields: Canonical | None = None,
    low_pass: float = LOW_PASS,
    num_threads: int | None = None,
) -> Track:
    """Choose the directions of strokes over a whole camera path.

    The path is sampled at knots at most 1.5 degrees of view change apart (camera turn, or shift over the
    distance of the scene), between frames along screw motions, so the outcome hardly depends on the frame
    rate, as long as frames are mostly at most 3.5 degrees apart. Per stroke, dynamic programming finds the
    cheapest sequence of directions: a direction off the axes of the ellipse costs the growth of the box
    needed to cover it, the minor axis costs a little, and a turn is at most 5.2 degrees per knot. Weighted
    least squares then pulls directions toward the exact axes, more strongly for slender ellipses. Of the two
    orientations a stroke gets the one of `project(lock="anchor")` in most of its visible area, so that films
    and stills agree in part. With fields, deviating from them costs a little in every view, in proportion to
    the visible area: films and stills then agree except for 1 to 3 % of the visible paint. A closed path
    returns to its first directions: if the axis winds an odd number of half turns, the additional half turn
    is made where it costs least, at up to 7.2 degrees per knot. The box of a slender stroke that grows while
    it turns grows in area by at most 10 % per knot and 15 % per frame.

    Frames further apart are themselves the knots. Between them a direction may turn by 14 degrees at almost
    no cost, so no stroke flips or spins (15 degrees) up to 12.4 degrees per frame; in return up to 3 % of
    slender strokes lie off their axis at 10 degrees per frame. Beyond that, too few steps are left for a half
    turn: strokes turn by up to 29 degrees.

    Args:
        gaussians: N Gaussians in world space.
        cameras: the F views in order, all of one size; the path is closed if the last equals the first.
        fields: directions of the strokes in single frames; None if these use "anchor".
        low_pass: variance added to both axes, pixels squared, >= 0; see `project`.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if there is no camera or sizes differ.
    """
    cameras = checked_cameras(cameras)
    knots = knots_of(cameras, *middle_and_reach(gaussians))
    found = directions_along(
        knots,
        gaussians.columns(),
        cameras[0],
        toward=None if fields is None else wanted_along(knots, fields, gaussians, cameras[0], num_threads),
        low_pass=low_pass,
        num_threads=num_threads_or_default(num_threads),
    )
    return (
        found if fields is not None else pointing_as_stills(found, knots, gaussians, cameras[0], num_threads)
    )


@dataclass(frozen=True, eq=False)
class Toward:
    """Where strokes should point along a path.

    Attributes:
        targets: [K, N] int16, as `Track.turns`.
        pulls: [K, N] uint8, strength, 0 to 255.
    """

    targets: NDArray[np.int16]
    pulls: NDArray[np.uint8]


def wanted_along(
    knots: Knots, fields: Canonical, strokes: Gaussians, camera: Camera, num_threads: int | None
) -> Toward:
    """The directions of strokes in single frames, with strengths by their visible area.

    Args:
        knots: of the path; `camera` gives the picture size.
        fields: of the strokes.
        strokes: N strokes.
        camera: any of the path.
        num_threads: None takes the processors available to this process.
    """
    views = _views_of(knots, camera)
    looks = sampled(len(views), NUM_LOOKS)
    areas = np.stack([seen_areas(strokes, views[look], num_threads) for look in looks])
    shares = np.rint(255 * areas / np.maximum(areas.max(axis=0), 1e-9)).astype(np.uint8)
    nearest = np.abs(np.arange(len(views))[:, None] - np.array(looks)).argmin(axis=1)
    targets = np.zeros((len(views), len(strokes)), np.int16)
    for knot, view in enumerate(views):
        targets[knot] = np.rint(fields.arrows(strokes, view) * (65536 / (2 * pi))).astype(np.int32)
    return Toward(targets, shares[nearest])


def _views_of(knots: Knots, camera: Camera) -> list[Camera]:
    """The views at the knots of a path; `camera` gives the picture size."""
    columns = zip(knots.viewmats, knots.Ks, knots.nears, strict=True)
    return [replace(camera, viewmat=viewmat, K=K, near=float(near)) for viewmat, K, near in columns]


def pointing_as_stills(
    track: Track,
    knots: Knots,
    gaussians: Gaussians,
    camera: Camera,
    num_threads: int | None,
    rows: Rows | None = None,
) -> Track:
    """The track with strokes reversed that point opposite to stills in most of their visible area.

    Compared at knots, not at frames, so that the choice does not depend on the frame rate. `rows` are the
    rows of the tracked strokes; None for all.
    """
    found = Agreement(len(gaussians), num_threads)
    rows = np.arange(len(gaussians)) if rows is None else rows
    turns = np.zeros(len(gaussians))
    views = _views_of(knots, camera)
    for knot in sampled(len(views), NUM_STILLS):
        view = views[knot]
        turns[rows] = track.turns[knot] * (2 * pi / 65536)
        found.look(gaussians, view, turns)
    return replace(track, turns=track.turns + found.half_turns[rows])


def sampled(count: int, most: int) -> list[int]:
    """Indices of at most `most` of `count` views, evenly spaced."""
    found: list[int] = np.unique(np.linspace(0, count - 1, most).round().astype(int)).tolist()
    return found


def seen_areas(strokes: Gaussians, camera: Camera, num_threads: int | None) -> Array:
    """[N] visible area of each stroke in a view, pixels of a small picture."""
    return visible_areas(strokes, _small(camera), num_threads=num_threads)


def _small(camera: Camera) -> Camera:
    return camera.in_side(min(STILL_SIDE, max(camera.width, camera.height)))


class Agreement:
    """Agreement of the directions of strokes with those of stills, weighted by visible area."""

    def __init__(self, num_strokes: int, num_threads: int | None) -> None:
        self._agreement, self._seen = np.zeros(num_strokes), np.zeros(num_strokes)
        self._num_threads = num_threads

    def look(self, strokes: Gaussians, camera: Camera, angles: Array) -> None:
        """Add a view in which the strokes have these directions, radians."""
        view = _small(camera)
        areas = visible_areas(strokes, view, num_threads=self._num_threads)
        boxes = project(strokes, view, lock="anchor", num_threads=self._num_threads)
        self._agreement[boxes.ids] += areas[boxes.ids] * np.cos(angles[boxes.ids] - boxes.angles)
        self._seen += areas

    @property
    def half_turns(self) -> NDArray[np.int16]:
        """[N] half a turn (in units of `Track.turns`) for strokes to reverse, else 0."""
        return np.where(self._agreement < -SURE * self._seen, -32768, 0).astype(np.int16)


def checked_cameras(cameras: Sequence[Camera]) -> list[Camera]:
    """The cameras of a path.

    Raises:
        ValueError: if there is none, or sizes differ.
    """
    cameras = list(cameras)
    if not cameras:
        raise ValueError("track: cameras must hold at least one, got none")
    sizes = sorted({(camera.width, camera.height) for camera in cameras})
    if len(sizes) > 1:
        raise ValueError(
            f"track: cameras must have one size, got {sizes[0]} and {sizes[1]}; use Camera.resized"
        )
    return cameras


def directions_along(
    knots: Knots,
    columns: Mapping[str, Array],
    camera: Camera,
    *,
    carried: F32 | None = None,
    jumps: NDArray[np.uint8] | None = None,
    toward: Toward | None = None,
    low_pass: float,
    num_threads: int,
) -> Track:
    """`track_directions` along given knots.

    Args:
        knots: K knots of the path.
        columns: `TRACKED_COLUMNS` of strokes, others are ignored; [N, ...], or [K, N, ...] if they move.
        camera: gives the picture size of all views.
        carried: [K, N] rotation of each stroke's object in the picture by its own motion, -pi to pi radians;
            directions are relative to it.
        jumps: [K, N] whether the object jumps from the previous knot, so that its stroke may spin; at the
            first knot of a closed path, from the last.
        toward: where the strokes should point; None chooses the arrows of lines by the longest axes.
        low_pass: see `track_directions`.
        num_threads: >= 1.
    """
    tracked: dict[str, Any] = {name: columns[name] for name in TRACKED_COLUMNS}
    turns, area_scales = _core.track_directions(
        **tracked,
        carried=carried,
        jumps=jumps,
        targets=None if toward is None else toward.targets,
        pulls=None if toward is None else toward.pulls,
        **knots.core_arguments(camera.width, camera.height),
        low_pass=float(low_pass),
        num_threads=num_threads,
    )
    return Track(turns, area_scales, knots.positions)
