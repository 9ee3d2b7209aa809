"""Captures that surround the photographer (a street, a garden, a room) are seen from inside.

From outside such a scene is a cloud of unphotographed parts. If pictures from outside consist of large
Gaussians, small pictures from many places inside are searched for one that is covered and sharp.
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

ROUGH_ROWS, MOST_ROWS = 6_000, 30_000  # for coarse pictures, and for decisive ones
WIDTH, HEIGHT = 64, 36  # pixels
NUM_OUTSIDE = 4  # pictures around a scene, to detect whether it is torn
# Median fine share: a truck on a plaza has 0.56, 12 other real scenes more; a kitchen from outside its
# cameras 0.38, nine synthetic streets, gardens, woods and rooms 0.05 to 0.38.
TORN = 0.47
FIRM = 0.3  # opacity from which a Gaussian is a surface
SMALL = 2.0  # over the median size of firm Gaussians; larger ones are sky, haze or badly trained
MOST_POINTS = 5000  # of surfaces, for distances
MIN_POINTS = 500  # least for a walkable scene
FEWEST = 5000  # least Gaussians of a place; smaller scenes look torn from everywhere
MIDDLE = (0.05, 0.95)  # quantiles of the points along level axes that bound the walkable area
GRID = np.linspace(-1.2, 1.2, 8)  # places along each level axis, in half sizes of that area
LIFTS = (0.4, 0.7, 1.1)  # of the eye above the ground, in units
TALL = 0.85  # the unit: this quantile of heights above the ground
UNIT = (0.12, 0.8)  # least and largest unit, over the half diagonal of the walkable area
GROUND = 0.95  # ground of a cell: this quantile of its points, downward
CELL, MIN_CELL_POINTS = 1 / 6, 12  # half width of a cell over that half diagonal, and its fewest points
AIR = 0.15  # units between the eye and the nearest surface
CLOSE = 2.5  # units: nearer paint lowers the score
AROUND, ACROSS = 24, 7  # bins of directions around the eye, and from `BELOW` down to it above the horizon
BELOW = np.radians(35.0)
WINDOW = 2  # bins to each side of the middle that a picture shows
ELEVATIONS = {np.radians(3.0): 3, np.radians(12.0): 4}  # of views, and the middle bin of each
NEAR, FAR = 2.0, 12.0  # units: outside these distances surfaces count half
SKY = 0.3  # value of a direction above the horizon without near surfaces
PER_EYE, NUM_PICTURES = 2, 256
NUM_REFINED = 12
# Turns of the better views, radians to the side and up.
NEAR_BY = ((0.0, 0.0), (-0.15, 0.0), (0.15, 0.0), (0.0, 0.12), (0.0, -0.08))
APART, TURNED = 0.6, np.cos(np.radians(40.0))  # units, or cosine of the angle, between distinct views
DEEP = 4.0  # far over near depths of a deep picture
MOST_STANDS = 8
TURNS = np.radians(np.arange(45, 360, 45))  # of the camera in place
STEP = 0.25  # of the distance ahead
VARIED = 1.6  # steps per unit, for the difference of other views
# Steps right, down and forward, and degrees of turn to the right.
MOVES = (
    *((1.0, 0.0, 0.0, 15.0), (-1.0, 0.0, 0.0, -15.0), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 0.0)),
    *((0.5, 0.0, 0.0, -10.0), (-0.5, 0.0, 0.0, 10.0), (0.7, 0.0, 1.0, 20.0), (-0.7, 0.0, 1.0, -20.0)),
)
LEAST_FINE = 0.3  # fine share of the best picture from inside
# Least clarity over that from outside: 4 and more in a kitchen, a corridor, streets and gardens; a truck
# behind many floaters, better seen whole, has 1.4.
GAIN = 3.0
LEAST_STANDS = 3  # usable, distinct stands of a scene seen from inside


@dataclass(frozen=True, eq=False)
class Stand:
    """A view from inside a scene.

    Attributes:
        eye: [3] world units.
        azimuth: radians, see `frame_scene`.
        elevation: radians, likewise.
        shown: measures of its picture.
        score: relative to other views of the scene, higher is better.
    """

    eye: F64
    azimuth: float
    elevation: float
    shown: Shown
    score: float


@dataclass(frozen=True, eq=False)
class _Place:
    """The walkable area of a scene, in level axes: right, down, forward.

    Attributes:
        points: [n, 3] centers of small firm Gaussians.
        center: [3] middle of the area.
        half: [3] half sizes of the area.
        unit: typical height of things above the ground.
    """

    points: F64
    center: F64
    half: F64
    unit: float


def inside_stand(gaussians: Gaussians, view: FirstView) -> Stand | None:
    """The view from inside a capture that looks torn from outside; None for all other scenes.

    Also None if the gain is small, or hardly any place gives a usable picture.

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
    # A subject in surroundings is seen from its front, so its best picture counts.
    clear = float(np.quantile([shown.clear for shown in outside], 1.0 if view.has_surroundings else 0.5))
    return stands[0] if stands[0].shown.clear >= GAIN * clear else None


def shown_outside(gaussians: Gaussians, view: FirstView) -> list[Shown]:
    """Measures of pictures around a scene; empty if nothing is visible.

    Args:
        gaussians: N Gaussians.
        view: of the scene, from outside.
    """
    judge = Judge(gaussians, ROUGH_ROWS)
    if not len(judge.scene):
        return []
    azimuths = 2 * np.pi * np.arange(NUM_OUTSIDE) / NUM_OUTSIDE
    cameras = [frame_scene(view, width=WIDTH, height=HEIGHT, azimuth=azimuth) for azimuth in azimuths]
    return side_by_side(judge, cameras)


def find_stands(gaussians: Gaussians, view: FirstView) -> list[Stand]:
    """Usable views from inside a scene, best first.

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
    """Further usable views of a scene seen from inside, distinct from its first view, best first.

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
    """Views from inside with their measures."""

    def look(way: tuple[F64, float, float]) -> Shown:
        return judge(camera_at(view, *way), CLOSE * unit)

    seen = side_by_side(look, ways)
    sharpest = max((shown.detail for shown in seen), default=0.0)
    return [Stand(*way, shown, _score(shown, sharpest)) for way, shown in zip(ways, seen, strict=True)]


def _that_differ(stands: Sequence[Stand], unit: float, most: int) -> list[Stand]:
    """The best views that differ from all better ones."""
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
    """The walkable area; None if too little is firm, or it has no extent."""
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
    """Eye, azimuth and elevation of views with most surface points at a good distance."""
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
    """[`AROUND`, `ACROSS`] rating of the distance to the nearest surface in each direction, 0 to 1."""
    downward = np.arcsin(np.clip(rays[:, 1] / distances, -1, 1))
    across = np.floor((downward + BELOW) / (2 * BELOW) * ACROSS).astype(np.int64)
    # Directions to the right of forward have a negative azimuth.
    around = np.round(np.arctan2(-rays[:, 0], rays[:, 2]) / (2 * np.pi) * AROUND).astype(np.int64) % AROUND
    is_ahead = (across >= 0) & (across < ACROSS)
    nearest = np.full((AROUND, ACROSS), np.inf)
    np.minimum.at(nearest, (around[is_ahead], across[is_ahead]), distances[is_ahead] / unit)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        values = nearest**2 / (NEAR**2 + nearest**2) / (1 + (nearest / FAR) ** 2)
    sky = np.where(np.arange(ACROSS) < ACROSS // 2, SKY, 0.0)
    return np.asarray(np.where(np.isfinite(nearest), values, sky))
