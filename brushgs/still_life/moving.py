"""The still life in motion: a pear is knocked over and rolls, a draft lifts the cloth, the lamp swings.

The motion is a formula of time. The pear rolls on its own outline without slipping, straight toward the
viewer, until it lies still. The cloth bends behind a line like paper: no length in it changes. The lamp
swings on its cord. Points far from the middle of its light, and resting bodies where the change would be
invisible, keep the light of the lamp at rest, so most of the scene is constant bit for bit, as in a recording
of a room. At time 0 it equals the still life.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.options.choices import CLIP_FPS
from brushgs.still_life import NUM_GAUSSIANS, still_life
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import Cast, blockers_of, cast_of, joined
from brushgs.still_life.light import (
    TO_LAMP,
    Blockers,
    ambient,
    baked,
    encode,
    lamp_light,
    lamp_visibility,
    matt_light,
)
from brushgs.still_life.surfaces import turn, unit
from brushgs.values.arrays import F64, Mask, Rows, smoothstep
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.quats import quat_products, quats_of, rotation_matrices

SECONDS = 4.0  # duration the motion was composed for; another duration plays it slower or faster
RATE = CLIP_FPS  # moments per second if rows do not correspond
DROPPED = 0.03  # share of the rows missing from such a moment

DOWN = np.array([0.0, 1.0, 0.0])
ROLL_WAY = unit(np.array([0.12, 0.0, -0.99]))  # toward the viewer, between apple and lemon
ROLL_AXIS = np.cross(-DOWN, ROLL_WAY)  # by the right hand: the top goes that way
ROLL = np.radians(114.0)  # until belly and neck both touch the cloth
ROLL_START, ROLL_END = 0.4, 2.2  # seconds

HINGE = np.array([-2.18, -1.84])  # (x, z) of a point of the line behind which the cloth is bent
BENT_WAY = unit(np.array([-0.35, -0.94]))  # (x, z), across that line: to the front left
BEND = 1.1  # radians at the edge, where the draft is strongest
BEND_LENGTH = 0.75  # from the line to the full bend, world units
WAVE, WAVE_LENGTH, WAVE_SECONDS = 0.28, 0.9, 0.7  # radians; the ripple that runs out to the edge
DRAUGHT_START, DRAUGHT_END = 0.6, 3.8  # seconds

SWING = np.radians(20.0)
SWING_SECONDS = 1.9  # period of the swing: a cord of 0.9 m
SWING_GROWS = 0.7  # seconds
POOL = np.array([-1.0, 0.0, -0.9])  # middle of the light of the lamp on the table
POOL_RADIUS, POOL_EDGE = 1.0, 1.3  # full strength within the first, falling to 0 over the second, world units

SEEN = 1.5 / 255  # visible change of a color
LOOKS = (0.09, 0.16, 0.27, 0.36, 0.48, 0.61, 0.85)  # shares of the duration for measuring changes


@dataclass(frozen=True, eq=False)
class _Stage:
    """Everything constant over time; rows are those of `gaussians`.

    Attributes:
        gaussians: the first moment.
        cast: the same rows, float64, without light.
        blockers: at the first moment.
        pear: rows.
        cloth: rows that the draft bends.
        pear_blockers: rows of `blockers`.
        pivot: [3] the point of the pear whose motion is `path`.
        path: [P, 3] turn in radians; distance and lift of the pivot, world units.
        pools: [n] weight of the lamp's swing at each point, 0 to 1.
        lit: rows whose light changes.
    """

    gaussians: Gaussians
    cast: Cast
    blockers: Blockers
    pear: Rows
    cloth: Rows
    pear_blockers: Rows
    pivot: F64
    path: F64
    pools: F64
    lit: Rows


def still_life_moving(
    num_gaussians: int = NUM_GAUSSIANS, seed: int = 0, *, seconds: float = SECONDS, has_rows: bool = True
) -> MovingScene:
    """Build the example scene in motion.

    Args:
        num_gaussians: approximate count, >= 1000, see `still_life`.
        seed: of all random choices.
        seconds: duration, > 0.
        has_rows: whether rows correspond. Otherwise there are 30 moments per second, of which `at` gives the
            nearest: each has its own order of rows, and lacks a different 3 % of them.

    Returns:
        A scene that equals `still_life` at time 0. If rows correspond it is a formula, and `resting` marks
        the rows that are equal at all times, about three quarters of them.

    Raises:
        ValueError: if `num_gaussians` is less than 1000, or `seconds` is not positive and finite.
    """
    if not 0 < seconds < np.inf:
        raise ValueError(f"still_life_moving: seconds must be > 0, got {seconds:g}")
    stage = _staged(num_gaussians, seed)
    if has_rows:
        resting = np.ones(len(stage.gaussians), bool)
        resting[_changing(stage)] = False
        return MovingScene(seconds, True, lambda time: _at(stage, time / seconds), resting=resting)
    times = np.arange(int(seconds * RATE + 1e-9) + 1) / RATE

    def sample(time: float) -> Gaussians:
        moment = int(np.abs(times - time).argmin())
        rng = np.random.default_rng((seed, moment))
        num = len(stage.gaussians)
        rows = rng.permutation(num)[: num - round(DROPPED * num)]
        return _at(stage, times[moment] / seconds).take(rows)

    return MovingScene(seconds, False, sample, times=times)


def _staged(num_gaussians: int, seed: int) -> _Stage:
    gaussians = still_life(num_gaussians, seed)
    rng = np.random.default_rng(seed)
    parts = list(bodies(num_gaussians, rng))
    names = np.array([body.name for body in parts])
    cast = joined([cast_of(body, number, rng) for number, body in enumerate(parts)])
    cast = cast.take(cast.opacities > 1 / 255)
    blockers = blockers_of(parts)
    points, own = cast.surface.points, names[cast.surface.bodies]
    pear = np.flatnonzero(own == "pear")
    pear_blockers = np.flatnonzero(names[blockers.bodies] == "pear")
    pivot = blockers.centers[pear_blockers[0]]
    is_flesh = cast.surface.gloss[pear] > 0  # the stalk bends
    from_axis = points - POOL
    from_axis -= (from_axis @ TO_LAMP)[:, None] * TO_LAMP
    stage = _Stage(
        gaussians=gaussians,
        cast=cast,
        blockers=blockers,
        pear=pear,
        cloth=np.flatnonzero((own == "cloth") & (_behind(points) > 0)),
        pear_blockers=pear_blockers,
        pivot=pivot,
        path=_rolling(points[pear[is_flesh]] - pivot),
        pools=1 - smoothstep((np.linalg.norm(from_axis, axis=1) - POOL_RADIUS) / POOL_EDGE),
        lit=np.arange(0),
    )
    return replace(stage, lit=_visibly_lit(stage))


def _at(stage: _Stage, share: float) -> Gaussians:
    """The Gaussians at a share of the duration, 0 to 1."""
    if share == 0:
        return stage.gaussians
    seconds = share * SECONDS
    cast, blockers = _placed(stage, seconds)
    rows = _changing(stage)
    cast = cast.take(rows)
    columns = {name: column.copy() for name, column in stage.gaussians.columns().items()}
    columns["means"][rows], columns["quats"][rows] = cast.means, cast.quats
    columns["sh"][rows] = baked(cast.surface, blockers, _to_lamp(stage.pools[rows], seconds))
    return replace(stage.gaussians, **columns)


def _changing(stage: _Stage) -> Rows:
    return np.unique(np.concatenate([stage.pear, stage.cloth, stage.lit]))


def _placed(stage: _Stage, seconds: float) -> tuple[Cast, Blockers]:
    """All rows and blockers at their positions."""
    surface = stage.cast.surface
    points, normals, means, quats = (
        column.copy() for column in (surface.points, surface.normals, stage.cast.means, stage.cast.quats)
    )
    angle, distance, lift = _roll(stage, seconds)
    rotation, place = turn(ROLL_AXIS, angle), stage.pivot + distance * ROLL_WAY - lift * DOWN

    def rolled(column: F64) -> F64:
        return np.asarray((column - stage.pivot) @ rotation.T + place)

    rows = stage.pear
    points[rows], means[rows], normals[rows] = (
        rolled(points[rows]),
        rolled(means[rows]),
        normals[rows] @ rotation.T,
    )
    quats[rows] = quat_products(quats_of(rotation[None]), quats[rows])
    centers = stage.blockers.centers.copy()
    centers[stage.pear_blockers] = rolled(centers[stage.pear_blockers])
    rows = stage.cloth
    means[rows], _ = _bent(means[rows], seconds)
    points[rows], turns = _bent(points[rows], seconds)
    normals[rows] = np.einsum("nij,nj->ni", rotation_matrices(turns), normals[rows])
    quats[rows] = quat_products(turns, quats[rows])
    surface = replace(surface, points=points, normals=normals)
    return replace(stage.cast, surface=surface, means=means, quats=quats), replace(
        stage.blockers, centers=centers
    )


def _rolling(points: F64) -> F64:
    """The path of a convex body that rolls over the plane below it without slipping.

    The plane is at the distance h(a) below the pivot, with h the support function of the body turned by a.
    The point of contact is at rest, so the pivot moves by h per radian along the plane, for any outline.

    Args:
        points: [n, 3] of the body, relative to the pivot.

    Returns:
        [P, 3] angle, radians; distance rolled and lift of the pivot since the first, world units.
    """
    angles = np.linspace(0, ROLL, 229)
    below = np.array([(points @ turn(ROLL_AXIS, angle).T[:, 1]).max() for angle in angles])
    steps = 0.5 * (below[1:] + below[:-1]) * np.diff(angles)
    return np.stack([angles, np.concatenate([[0], np.cumsum(steps)]), below - below[0]], axis=1)


def _roll(stage: _Stage, seconds: float) -> tuple[float, float, float]:
    """Turn, distance and lift of the pear."""
    share = np.clip((seconds - ROLL_START) / (ROLL_END - ROLL_START), 0, 1)
    angle = ROLL * share**3 * (10 + share * (6 * share - 15))  # no jerk at either end
    angles, distances, lifts = stage.path.T
    return float(angle), float(np.interp(angle, angles, distances)), float(np.interp(angle, angles, lifts))


def _behind(points: F64) -> F64:
    """[n] distance of points behind the line at which the cloth bends, world units."""
    return np.asarray((points[:, [0, 2]] - HINGE) @ BENT_WAY)


def _bent(points: F64, seconds: float) -> tuple[F64, F64]:
    """Points [n, 3] of the cloth bent by the draft, and the rotations [n, 4] there.

    The cloth turns by an angle a(s) at the distance s behind the line; its middle surface runs along the
    integral of (cos a, sin a), so that no length along it changes, and points above it turn with it.
    """
    wind = np.sin(np.pi * np.clip((seconds - DRAUGHT_START) / (DRAUGHT_END - DRAUGHT_START), 0, 1)) ** 2
    grid = np.linspace(0, 4 * BEND_LENGTH, 400)
    angles = BEND * smoothstep(grid / BEND_LENGTH)
    angles += (
        WAVE
        * smoothstep(2 * grid / BEND_LENGTH)
        * np.sin(2 * np.pi * (grid / WAVE_LENGTH - seconds / WAVE_SECONDS))
    )
    angles = wind * angles
    step = grid[1]
    back = step * np.cumsum(np.cos(angles) - 1) - 0.5 * step * (np.cos(angles) - 1)
    up = step * np.cumsum(np.sin(angles)) - 0.5 * step * np.sin(angles)
    behind = np.maximum(_behind(points), 0)
    angle, back, up = (np.interp(behind, grid, column) for column in (angles, back, up))
    height = -points[:, 1]
    along = back - np.sin(angle) * height
    moved = points.copy()
    moved[:, [0, 2]] += along[:, None] * BENT_WAY
    moved[:, 1] -= up + (np.cos(angle) - 1) * height
    axis = np.cross((BENT_WAY[0], 0, BENT_WAY[1]), (0, -1, 0))  # from outward to up
    turns = np.concatenate([np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None] * axis], axis=1)
    return moved, turns


def _to_lamp(pools: F64, seconds: float) -> F64:
    """[n, 3] unit directions to the lamp of points, with weights `pools` [n] of its swing."""
    grown = smoothstep(np.array(seconds / SWING_GROWS))
    angles = pools * SWING * grown * np.sin(2 * np.pi * seconds / SWING_SECONDS)
    x, y, z = TO_LAMP
    cos, sin = np.cos(angles), np.sin(angles)
    return np.stack([cos * x - sin * y, sin * x + cos * y, np.full(len(pools), z)], axis=1)


def _visibly_lit(stage: _Stage) -> Rows:
    """Rows whose light changes visibly at one of a few moments."""
    surface, blockers = stage.cast.surface, stage.blockers
    near = np.flatnonzero((stage.pools > 0) | _near_pear(stage))
    lamp = lamp_light(surface.take(near), blockers, TO_LAMP)
    first = encode(matt_light(surface.take(near), blockers, lamp))
    change = np.zeros(len(near))
    for share in LOOKS:
        cast, moved = _placed(stage, share * SECONDS)
        part = cast.surface.take(near)
        lamp = lamp_light(part, moved, _to_lamp(stage.pools[near], share * SECONDS))
        change = np.maximum(change, np.abs(encode(matt_light(part, moved, lamp)) - first).max(axis=1))
    return near[change > SEEN]


def _near_pear(stage: _Stage) -> Mask:
    """Rows whose shading by the pear changes as it rolls."""
    is_near = np.zeros(len(stage.gaussians), bool)
    surface, rows = stage.cast.surface, stage.pear_blockers
    first: tuple[F64, F64] | None = None
    for share in (0.0, *LOOKS):
        centers = _placed(stage, share * SECONDS)[1].centers[rows]
        pear = Blockers(
            centers, stage.blockers.radii[rows], stage.blockers.bodies[rows], stage.blockers.albedos[rows]
        )
        visible = lamp_visibility(surface.points, surface.bodies, pear)
        around = ambient(surface.points, surface.normals, surface.bodies, pear)[:, 0]
        if first is None:
            first = visible, around
        is_near |= (np.abs(visible - first[0]) > 0.01) | (np.abs(around / first[1] - 1) > 0.02)
    return is_near
