"""Captures that surround who took them: a street, a garden, a room. They are seen from among their things.

From outside such a scene is a cloud of what no photograph showed. Where its pictures from outside are made of
paint that is large in them, small pictures from many places inside find one that is covered and sharp.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.cameras.framing import camera_axes, distance_ahead, frame_scene
from brushgs.core.threads import side_by_side
from brushgs.first_view.sample import thinned
from brushgs.first_view.usable import Judge, Shown
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

ROUGH_ROWS, MOST_ROWS = 6_000, 30_000  # of pictures that choose or rule out, and of those that decide
WIDTH, HEIGHT = 64, 36  # pixels
NUM_OUTSIDE = 4  # pictures around a scene that tell whether it is torn from outside
# Share of their paint that is fine, median: a truck on a plaza has 0.56, 12 other real scenes more; a kitchen
# seen from outside its cameras 0.38, nine made streets, gardens, woods and rooms 0.05 to 0.38.
TORN = 0.47
FIRM = 0.3  # opacity from which a Gaussian is a surface
SMALL = 2.0  # over the median size of firm Gaussians: what is larger is sky, haze or badly trained
MOST_POINTS = 5000  # of surfaces, for distances
MIN_POINTS = 500  # of a scene that can be walked in
FEWEST = 5000  # Gaussians of a capture of a place; what has fewer looks torn from wherever it is seen
MIDDLE = (0.05, 0.95)  # quantiles of the points, along level axes, between which one walks
GRID = np.linspace(-1.2, 1.2, 8)  # places along each level axis, half sizes of that
LIFTS = (0.4, 0.7, 1.1)  # of the eye above the ground, in units
TALL = 0.85  # quantile of heights above the ground that is the unit
UNIT = (0.12, 0.8)  # least and largest unit, over the half diagonal of where one walks
GROUND = 0.95  # quantile of the points of a cell, downward, that is its ground
CELL, MIN_CELL_POINTS = 1 / 6, 12  # half width of a cell over that half diagonal, and its fewest points
AIR = 0.15  # units between the eye and the nearest surface
CLOSE = 2.5  # units: nearer paint counts against a view
AROUND, ACROSS = 24, 7  # bins of directions around the eye, and from `BELOW` down to it above the horizon
BELOW = np.radians(35.0)
WINDOW = 2  # bins to each side of the middle that a picture shows
ELEVATIONS = {np.radians(3.0): 3, np.radians(12.0): 4}  # of views, and the middle bin of each
NEAR, FAR = 2.0, 12.0  # units below and from which what is seen counts half
SKY = 0.3  # what a direction above the horizon counts in which nothing is near
PER_EYE, NUM_PICTURES = 2, 256
NUM_REFINED = 12
# Radians to the side and up by which the better views are turned.
NEAR_BY = ((0.0, 0.0), (-0.15, 0.0), (0.15, 0.0), (0.0, 0.12), (0.0, -0.08))
APART, TURNED = 0.6, np.cos(np.radians(40.0))  # units, or cosine of the angle, by which two views differ
DEEP = 4.0  # far over near depths of a picture that is deep
MOST_STANDS = 8
TURNS = np.radians(np.arange(45, 360, 45))  # of the camera where it stands
STEP = 0.25  # of the distance to what is ahead
VARIED = 1.6  # steps that count as the unit by which other views differ in place
# Steps to the right, down and forward, and degrees by which the camera turns to the right of what it sees.
MOVES = (
    *((1.0, 0.0, 0.0, 15.0), (-1.0, 0.0, 0.0, -15.0), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 0.0)),
    *((0.5, 0.0, 0.0, -10.0), (-0.5, 0.0, 0.0, 10.0), (0.7, 0.0, 1.0, 20.0), (-0.7, 0.0, 1.0, -20.0)),
)
LEAST_FINE = 0.3  # fine share of the best picture from inside
# By how much it must be clearer than the ones from outside: 4 and more in a kitchen, a corridor, streets and
# gardens; a truck behind many floaters, which is better seen whole, has 1.4.
GAIN = 3.0
LEAST_STANDS = 3  # usable ones, that differ, of a scene that is seen from inside


@dataclass(frozen=True, eq=False)
class Stand:
    """A view from among the things of a scene.

    Attributes:
        eye: [3] world units.
        azimuth: radians, see `frame_scene`.
        elevation: radians, likewise.
        shown: what its picture shows.
        score: of the picture among others of the scene, higher is better.
    """

    eye: F64
    azimuth: float
    elevation: float
    shown: Shown
    score: float


@dataclass(frozen=True, eq=False)
class _Place:
    """Where one can walk in a scene, in level axes: right, down, forward.

    Attributes:
        points: [n, 3] centres of small firm Gaussians.
        center: [3] middle of where most of them are.
        half: [3] half sizes of that.
        unit: typical height of things above the ground.
    """

    points: F64
    center: F64
    half: F64
    unit: float


def inside_stand(gaussians: Gaussians, view: FirstView) -> Stand | None:
    """The view from among the things of a capture that is a cloud from outside; None for all other scenes.

    Where the gain is small, or hardly a place shows a usable picture, a scene stays as it is.

    Args:
        gaussians: N Gaussians.
        view: of the scene, from outside.
    """
    if len(gaussians) < FEWEST:
        return None
    outside = shown_outside(gaussians, view)
    if not outside or float(np.median([shown.fine for shown in outside])) >= TORN:
        return None
    stands = find_stands(gaussians, view)
    if len(stands) < LEAST_STANDS or stands[0].shown.fine < LEAST_FINE:
        return None
    # The front of a subject in surroundings is chosen, so that its best picture counts.
    clear = float(np.quantile([shown.clear for shown in outside], 1.0 if view.has_surroundings else 0.5))
    return stands[0] if stands[0].shown.clear >= GAIN * clear else None


def shown_outside(gaussians: Gaussians, view: FirstView) -> list[Shown]:
    """What pictures of a scene from around it show; none where nothing is visible.

    Args:
        gaussians: N Gaussians.
        view: of the scene, from outside.
    """
    judge = Judge(gaussians, ROUGH_ROWS)
    if not len(judge.scene):
        return []
    azimuths = 2 * np.pi * np.arange(NUM_OUTSIDE) / NUM_OUTSIDE
    cameras = [frame_scene(view, width=WIDTH, height=HEIGHT, azimuth=azimuth) for azimuth in azimuths]
    return [judge(camera) for camera in cameras]


def find_stands(gaussians: Gaussians, view: FirstView) -> list[Stand]:
    """Views from among the things of a scene, the best first; those that are not usable are left out.

    Args:
        gaussians: N Gaussians.
        view: of the scene; its `up` and `points` matter.

    Returns:
        At most `MOST_STANDS`, which differ in place or direction.
    """
    level = camera_axes(view.up, 0.0, 0.0)
    place = _place_of(gaussians, level)
    if place is None:
        return []
    rough = _judged(Judge(gaussians, ROUGH_ROWS), view, _promising(place, level), place.unit)
    best = _that_differ(rough, place.unit, NUM_REFINED)
    near = [
        (stand.eye, stand.azimuth + aside, stand.elevation + higher)
        for stand in best
        for aside, higher in NEAR_BY
    ]
    stands = _judged(Judge(gaussians, MOST_ROWS), view, near, place.unit)
    return _that_differ([stand for stand in stands if stand.shown.is_usable], place.unit, MOST_STANDS)


def other_stands(gaussians: Gaussians, view: FirstView) -> list[Stand]:
    """Usable views of a scene that is seen from inside, which differ from its first view, the best first.

    Args:
        gaussians: N Gaussians.
        view: of the scene, with an `eye`.
    """
    assert view.eye is not None, "the view is from outside"
    axes = camera_axes(view.up, view.azimuth, view.elevation)
    step = STEP * distance_ahead(view, axes)
    turned = [(view.eye, view.azimuth + turn, view.elevation) for turn in TURNS]
    moved = [
        (view.eye + step * (np.array(offset) @ axes), view.azimuth + np.radians(turn), view.elevation)
        for *offset, turn in MOVES
    ]
    found = [(stand.eye, stand.azimuth, stand.elevation) for stand in find_stands(gaussians, view)]
    ways = [(view.eye, view.azimuth, view.elevation), *turned, *moved, *found]
    first, *others = _judged(Judge(gaussians, MOST_ROWS), view, ways, step)
    usable = [replace(first, score=np.inf), *(stand for stand in others if stand.shown.is_usable)]
    return _that_differ(usable, VARIED * step, MOST_STANDS)[1:]


def _judged(
    judge: Judge, view: FirstView, ways: Sequence[tuple[F64, float, float]], unit: float
) -> list[Stand]:
    """Views from inside and what each shows."""

    def look(way: tuple[F64, float, float]) -> Shown:
        return judge(camera_at(view, *way), CLOSE * unit)

    seen = side_by_side(look, ways)
    sharpest = max((shown.detail for shown in seen), default=0.0)
    return [Stand(*way, shown, _score(shown, sharpest)) for way, shown in zip(ways, seen, strict=True)]


def _that_differ(stands: Sequence[Stand], unit: float, most: int) -> list[Stand]:
    """The best of some views, none of which is nearly the same as a better one."""
    chosen: list[Stand] = []
    for stand in sorted(stands, key=lambda stand: -stand.score):
        if len(chosen) < most and all(_differ(stand, other, unit) for other in chosen):
            chosen.append(stand)
    return chosen


def camera_at(view: FirstView, eye: F64, azimuth: float, elevation: float) -> Camera:
    """The small picture of a view from inside."""
    seen = replace(view, eye=eye, azimuth=azimuth, elevation=elevation)
    return frame_scene(seen, width=WIDTH, height=HEIGHT)


def _score(shown: Shown, sharpest: float) -> float:
    return float(
        shown.covered**4
        * shown.fine
        * np.sqrt(shown.detail / max(sharpest, 1e-9))
        * (1 - shown.close) ** 2
        * (1 - shown.veiled) ** 2
        * (0.5 + 0.5 * min(np.log(shown.spread) / np.log(DEEP), 1.0))
    )


def _differ(one: Stand, other: Stand, unit: float) -> bool:
    is_apart = float(np.linalg.norm(one.eye - other.eye)) > APART * unit
    return is_apart or bool(np.cos(one.azimuth - other.azimuth) < TURNED)


def _place_of(gaussians: Gaussians, level: F64) -> _Place | None:
    """Where one can walk; None where too little is firm, or all of it lies in one place."""
    sizes = np.sort(gaussians.scales, axis=1)[:, 1:].astype(np.float64).prod(axis=1)
    firm = gaussians.opacities > FIRM
    if np.count_nonzero(firm) < MIN_POINTS:
        return None
    rows = np.flatnonzero(firm & (sizes <= SMALL**2 * np.median(sizes[firm])))
    points = gaussians.means[rows[thinned(len(rows), MOST_POINTS)]].astype(np.float64) @ level.T
    low, high = np.quantile(points, MIDDLE, axis=0)
    half = 0.5 * (high - low)
    radius = float(np.hypot(half[0], half[2]))
    if len(points) < MIN_POINTS or not radius > 0:
        return None
    place = _Place(points, 0.5 * (low + high), half, radius)
    some = points[thinned(len(points), MIN_POINTS)]
    heights = [_ground(place, point[0], point[2]) - point[1] for point in some]
    unit = np.clip(np.quantile(heights, TALL), UNIT[0] * radius, UNIT[1] * radius)
    return replace(place, unit=float(unit))


def _ground(place: _Place, x: float, z: float) -> float:
    """The ground near a place, downward in level axes."""
    reach = CELL * float(np.hypot(place.half[0], place.half[2]))
    points = place.points
    downs = points[(np.abs(points[:, 0] - x) < reach) & (np.abs(points[:, 2] - z) < reach), 1]
    return float(np.quantile(downs if len(downs) >= MIN_CELL_POINTS else points[:, 1], GROUND))


def _promising(place: _Place, level: F64) -> list[tuple[F64, float, float]]:
    """Eye, azimuth and elevation of the views that see most surfaces at a good distance, by their points."""
    found = []
    for x in place.center[0] + GRID * place.half[0]:
        for z in place.center[2] + GRID * place.half[2]:
            ground = _ground(place, x, z)
            for lift in LIFTS:
                eye = np.array([x, ground - lift * place.unit, z])
                found += _directions(place, eye)
    found.sort(key=lambda view: -view[0])
    return [(eye @ level, azimuth, elevation) for _, eye, azimuth, elevation in found[:NUM_PICTURES]]


def _directions(place: _Place, eye: F64) -> list[tuple[float, F64, float, float]]:
    """Value, eye, azimuth and elevation of the best `PER_EYE` directions from an eye in level axes."""
    rays = place.points - eye
    distances = np.linalg.norm(rays, axis=1)
    if distances.min() < AIR * place.unit:
        return []
    values = _visible_values(rays, distances, place.unit)
    found = []
    for elevation, middle in ELEVATIONS.items():
        rows = values[:, middle - WINDOW : middle + WINDOW + 1].mean(axis=1)
        seen = sum(np.roll(rows, step) for step in range(-WINDOW, WINDOW + 1)) / (2 * WINDOW + 1)
        found += [(float(value), k, elevation) for k, value in enumerate(seen)]
    found.sort(key=lambda view: (-view[0], view[1:]))
    chosen: list[tuple[float, int, float]] = []
    for view in found:
        if all(
            min((view[1] - other[1]) % AROUND, (other[1] - view[1]) % AROUND) > WINDOW for other in chosen
        ):
            chosen.append(view)
    return [(value, eye, 2 * np.pi * k / AROUND, elevation) for value, k, elevation in chosen[:PER_EYE]]


def _visible_values(rays: F64, distances: F64, unit: float) -> F64:
    """[`AROUND`, `ACROSS`] how good a distance the nearest surface in each direction has, 0 to 1."""
    downward = np.arcsin(np.clip(rays[:, 1] / distances, -1, 1))
    across = np.floor((downward + BELOW) / (2 * BELOW) * ACROSS).astype(np.int64)
    # To the right of forward the camera is at an azimuth below 0.
    around = np.round(np.arctan2(-rays[:, 0], rays[:, 2]) / (2 * np.pi) * AROUND).astype(np.int64) % AROUND
    is_ahead = (across >= 0) & (across < ACROSS)
    nearest = np.full((AROUND, ACROSS), np.inf)
    np.minimum.at(nearest, (around[is_ahead], across[is_ahead]), distances[is_ahead] / unit)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        values = nearest**2 / (NEAR**2 + nearest**2) / (1 + (nearest / FAR) ** 2)
    sky = np.where(np.arange(ACROSS) < ACROSS // 2, SKY, 0.0)
    return np.asarray(np.where(np.isfinite(nearest), values, sky))
