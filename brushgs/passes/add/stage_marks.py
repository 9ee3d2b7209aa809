"""The marks of a drawn stage: hatching or washes in the shadow, and the edge of the table in broken lines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_shadow import REACH, Shadow
from brushgs.passes.add.stage_surface import Surface, at_lengths
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

LEAST_LENGTH = 0.03  # minimum length of a mark, in radii, even for a close camera
ASIDE = 0.12  # standard deviation of positions, in lengths or spacings
THICKNESS = 0.01
CROSS_AT, CROSS_TURN = 0.55, np.radians(62.0)  # minimum shade of cross-hatching, and its angle
PASSES, LEAST = 3, 0.5  # lines along the edge of a table, and the share that is dropped
EDGE_SPREAD = 0.02  # of these lines, in radii of the table


@dataclass(frozen=True)
class Marking:
    """How marks fill a shadow.

    Attributes:
        length: of a mark, in widths of the picture.
        aspect: length over width.
        spacing: between lines of marks, in widths of a mark.
        lightest: minimum shade of marks, 0 to 1.
        is_crossed: whether the dark is hatched in a second direction.
        opacity: in full shade, 0 to 1; at `lightest` a third of it, unless marks are even.
        is_even: whether marks are as opaque in the light, where there are fewer instead.
    """

    length: float
    aspect: float
    spacing: float
    lightest: float = 0.12
    is_crossed: bool = False
    opacity: float = 1.0
    is_even: bool = False


HATCHING = Marking(length=0.075, aspect=51.0, spacing=3.4, is_crossed=True, is_even=True)  # in ink
WASH = Marking(length=0.08, aspect=2.2, spacing=0.5, opacity=0.7)  # in watercolour: marks run together
EDGE_LENGTH, EDGE_ASPECT = 0.09, 54.0  # of lines along the edge of a table: length and aspect as in `Marking`


def shadow_marks(
    place: Place, shadow: Shadow, cameras: Sequence[Camera], marking: Marking, *, seed: int = 0
) -> Gaussians:
    """Black marks on the level ground in the shadow of a subject, along the shadow; float64.

    Args:
        place: of the subject.
        shadow: of the subject.
        cameras: of the job, at least one; sizes of marks refer to their pictures.
        marking: how marks fill the shadow.
        seed: of the jitter.
    """
    g = np.random.default_rng([seed, 11])
    length = max(marking.length * place.seen_width(cameras), LEAST_LENGTH * place.radius)
    width = length / marking.aspect
    along = float(np.arctan2(-place.lamp[2], -place.lamp[0]))
    turns = [along] + [along + CROSS_TURN] * marking.is_crossed
    levels = [marking.lightest] + [CROSS_AT] * marking.is_crossed
    parts = [
        _rows_of_marks(place, shadow, turn, length, marking.spacing * width, least, g)
        for turn, least in zip(turns, levels, strict=True)
    ]
    points, shades, angles = (np.concatenate(column) for column in zip(*parts, strict=True))
    least = 1.0 if marking.is_even else 1 / 3
    opacities = marking.opacity * np.clip(least + shades, 0, 1)
    return _flat_marks(place, points, angles, length * (0.85 + 0.3 * g.random(len(points))), width, opacities)


def _rows_of_marks(
    place: Place,
    shadow: Shadow,
    turn: float,
    length: float,
    spacing: float,
    least: float,
    g: np.random.Generator,
) -> tuple[F64, F64, F64]:
    """[n, 3] local points of parallel rows of marks in a minimum shade; the shade there; their angles."""
    half = REACH * place.radius
    across, along = np.arange(-half, half, spacing), np.arange(-half, half, 0.8 * length)
    v, u = (grid.ravel() for grid in np.meshgrid(across, along, indexing="ij"))
    u = u + length * (g.random(len(across)).repeat(len(along)) + ASIDE * g.normal(0, 1, len(u)))
    v = v + spacing * ASIDE * g.normal(0, 1, len(v))
    cos, sin = np.cos(turn), np.sin(turn)
    points = np.stack([u * cos - v * sin, np.zeros(len(u)), u * sin + v * cos], axis=1)
    shade = shadow.at(points)[:, :2].max(axis=1)
    kept = shade >= least * (0.8 + 0.4 * g.random(len(shade)))
    return points[kept], shade[kept], turn + 0.04 * g.normal(0, 1, int(kept.sum()))


def table_edge(place: Place, surface: Surface, cameras: Sequence[Camera], *, seed: int = 0) -> Gaussians:
    """A few black broken lines along the edge of the table; float64.

    Args:
        place: of the subject.
        surface: of the table.
        cameras: of the job, at least one.
        seed: of random numbers.
    """
    g = np.random.default_rng([seed, 13])
    length = max(EDGE_LENGTH * place.seen_width(cameras), LEAST_LENGTH * place.radius)
    count = max(int(2 * np.pi * surface.table / (0.6 * length)), 8)
    around = (np.arange(count) / count + g.random((PASSES, 1))) * 2 * np.pi
    phases = 2 * np.pi * g.random((3, PASSES, 1))
    drift = np.sin(3 * around + phases[0]) + np.linspace(-1, 1, PASSES)[:, None]
    rho = surface.table * (1 + EDGE_SPREAD * drift)
    drawn = np.sin(5 * around + phases[1]) + np.sin(8 * around + phases[2]) > LEAST
    along, around = np.interp(rho[drawn], surface.rho[:-1], surface.length[:-1]), around[drawn]
    points = at_lengths(surface, along, around)
    size = length * np.exp(g.normal(0, 0.2, len(points)))
    opacities = np.ones(len(points))
    return _flat_marks(place, points, around + 0.5 * np.pi, size, length / EDGE_ASPECT, opacities)


def _flat_marks(
    place: Place, points: F64, angles: F64, lengths: F64, width: float, opacities: F64
) -> Gaussians:
    """Level marks at local points [n, 3], each along its angle from the right to away."""
    count = len(points)
    zero, one = np.zeros(count), np.ones(count)
    along = np.stack([np.cos(angles), zero, np.sin(angles)], axis=1)
    normal = np.stack([zero, one, zero], axis=1)
    frames = np.stack([along, np.cross(normal, along), normal], axis=2)
    scales = np.stack([lengths / 4, np.full(count, width / 4), np.full(count, THICKNESS * width)], axis=1)
    return Gaussians(
        place.world(points), place.quats(frames), scales, np.clip(opacities, 0, 1), np.zeros((count, 1, 3))
    )
