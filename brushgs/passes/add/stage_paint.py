"""The strokes of a painted stage: few, large and quiet, small only at the edge of the shadow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.passes.add.backdrop import seen_by_any
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_map import Layout, Manner, layout_of, map_colors, map_contrasts, map_directions
from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_shadow import REACH, Shadow
from brushgs.passes.add.stage_surface import Spots, Surface, spots_on
from brushgs.passes.add.stage_tones import Tones
from brushgs.values.arrays import F64, Mask, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

# Size of strokes, the root of length times width, in widths of the picture: near the subject and far from it,
# by distance in its radii. They are 1.5 times as long, 0.19 to 0.4 of the width.
NEAR_SIZE, FAR_SIZE, FAR = 0.12, 0.26, 3.0
FINE = 0.55  # size of strokes in the shadow, relative to others at that distance
OVERLAP = 9.6  # strokes over each point
PLACE_JITTER, SIZE_JITTER = 0.35, 0.18  # in widths of a cell; standard deviation of the logarithm of sizes
LEAST_SIZE = 0.1  # minimum size of a stroke, in radii, even for a close camera
SIGMAS = 3.6  # size of a stroke in standard deviations
THICKNESS = 0.01
OPACITY = 0.95
SWAY, LOOSE = 0.9, 0.16  # of directions on the wall, radians: broad waves; and of every stroke
TABLE_SWAY = 0.16
SHADED = 0.08  # minimum shade or contact of fine strokes
DARKEST, CONTACT = 0.52, 0.30  # reduction of lightness by full shadow and full contact
COOLER = np.array([-0.003, -0.016])  # change of a and b in full shadow
REFLECTED = 0.5  # share of the color of near objects in their reflection
UPPER, FAR_TABLE, FRONT = 0.10, 0.04, 0.03  # darkening of the wall upward, of the table to back and front
LEVEL_UP_TO = 0.7  # share of the table's radius beyond which strokes turn along its edge
BLEND = (0.02, 0.6)  # slopes of the cove over which table blends into wall, radians
# In the manner of a painting: strokes over each point, maximum number of visible ones, and reach of one in
# standard deviations.
MARKED_OVERLAP, MOST_SEEN, SEEN_REACH = 6.0, 20_000, 3.0
PROBES = 2000  # sample positions for estimating the visible share of a stage


@dataclass(frozen=True)
class Brushwork:
    """How a stage is painted.

    Attributes:
        size: of strokes, 1 for the usual one.
        aspect: length over width, >= 1.
        jitter: standard deviations of OKLab lightness, and of a and b, from stroke to stroke.
        shadow: strength of shadow, contact and reflected color, 0 to 1.
        manner: of paintings; None for none.
    """

    size: float = 1.0
    aspect: float = 2.4
    jitter: tuple[float, float] = (0.008, 0.004)
    shadow: float = 0.6
    manner: Manner | None = None


def stage_strokes(
    place: Place,
    surface: Surface,
    shadows: Sequence[Shadow],
    tones: Tones,
    brushwork: Brushwork,
    cameras: Sequence[Camera],
    *,
    ground: Ground | None = None,
    seed: int = 0,
) -> Gaussians:
    """The strokes of a table and a wall, float64, without view-dependent color.

    Args:
        place: of the subject.
        surface: to paint on.
        shadows: of the subject, then at other times, where strokes are fine too.
        tones: of table and wall.
        brushwork: how strokes are painted.
        cameras: of the job, at least one; sizes of strokes refer to their pictures.
        ground: of the scene itself, or None.
        seed: of the jitter.
    """
    shadow = shadows[0]
    g, of_broad, of_fine = np.random.default_rng([seed, 7]).spawn(3)
    usual = _sizes(surface, place, cameras)
    if brushwork.manner is not None:
        return _in_manner(
            brushwork.manner, place, surface, (shadow, tones, ground), brushwork, cameras, usual, g
        )
    broad, broad_sizes = _laid(surface, usual * brushwork.size, of_broad)
    # Fine strokes keep the shape of the shadow, even if other strokes are large.
    fine_usual = usual * FINE * min(brushwork.size, 1.0)
    fine, fine_sizes = _laid(surface, fine_usual, of_fine, until=REACH * place.radius)
    kept = [~_is_shaded(broad, shadows, brushwork), _is_shaded(fine, shadows, brushwork)]
    spots = Spots(*(np.concatenate([a[kept[0]], b[kept[1]]]) for a, b in zip(broad, fine, strict=True)))
    sizes = np.concatenate([broad_sizes[kept[0]], fine_sizes[kept[1]]])
    sizes = sizes * np.exp(SIZE_JITTER * spots.noise[:, 0])
    lab = _colors(spots, surface, shadow, tones, brushwork, ground)
    lab += spots.noise[:, 1:4] * (brushwork.jitter[0], brushwork.jitter[1], brushwork.jitter[1])
    frames = _frames(spots, place, surface, len(cameras) == 1, g)
    root = np.sqrt(brushwork.aspect)
    scales = sizes[:, None] / SIGMAS * (root, 1 / root, THICKNESS)
    return _strokes(place, spots, frames, scales, lab)


def _strokes(place: Place, spots: Spots, frames: F64, scales: F64, lab: F64) -> Gaussians:
    return Gaussians(
        place.world(spots.points),
        place.quats(frames),
        scales,
        np.full(len(scales), OPACITY),
        ((np.clip(rgb_of_oklab(lab), 0, 1) - 0.5) / C0)[:, None],
    )


def _in_manner(
    manner: Manner,
    place: Place,
    surface: Surface,
    paint: tuple[Shadow, Tones, Ground | None],
    brushwork: Brushwork,
    cameras: Sequence[Camera],
    usual: F64,
    g: np.random.Generator,
) -> Gaussians:
    """The visible strokes of a stage in the manner of paintings, as large as the marks of these."""
    shadow, tones, ground = paint
    height, width = manner.parts[0].stage.colors.shape[:2]
    layout = layout_of(surface, place, cameras, width / height)
    root = np.sqrt(manner.aspect**manner.marks * brushwork.aspect ** (1 - manner.marks))
    sizes = _marked_sizes(manner, place, surface, brushwork, cameras, usual)

    def seen(spots: Spots, sizes: F64) -> Mask:
        return seen_by_any(place.world(spots.points), SEEN_REACH * root * sizes / SIGMAS, cameras)

    probe_sizes = sizes * np.sqrt(_count(surface, sizes) / PROBES)
    probes = _laid(surface, probe_sizes * np.sqrt(MARKED_OVERLAP), g.spawn(1)[0], MARKED_OVERLAP)
    share = float(seen(*probes).mean())
    sizes = sizes * max(np.sqrt(share * _count(surface, sizes) / MOST_SEEN), 1.0)
    spots, of_spots = _laid(surface, sizes, g.spawn(1)[0], MARKED_OVERLAP)
    kept = seen(spots, of_spots)
    spots, of_spots = Spots(*(column[kept] for column in spots)), of_spots[kept]
    of_spots = of_spots * np.exp(SIZE_JITTER * spots.noise[:, 0])
    lab = _colors(spots, surface, shadow, tones, brushwork, ground, layout)
    share = manner.color
    jitter = [
        (1 - share) * own + share * of_style
        for own, of_style in zip(brushwork.jitter, manner.jitter, strict=True)
    ]
    broken = 1 - share + share * map_contrasts(manner, layout, surface, spots)
    lab += spots.noise[:, 1:4] * (jitter[0], jitter[1], jitter[1]) * broken[:, None]
    frames = _frames(spots, place, surface, len(cameras) == 1, g)
    slope, (cos, sin) = surface.slope(spots.along), (np.cos(spots.around), np.sin(spots.around))
    around = np.stack([-sin, np.zeros(len(cos)), cos], axis=1)
    rise = np.stack([np.cos(slope) * cos, np.sin(slope), np.cos(slope) * sin], axis=1)
    along, stretch = map_directions(manner, layout, surface, spots, frames[:, :, 0], (around, rise))
    frames = np.stack([along, np.cross(frames[:, :, 2], along), frames[:, :, 2]], axis=2)
    ones = np.ones(len(spots.points))
    scales = of_spots[:, None] / SIGMAS * np.stack([root * stretch, ones / root, THICKNESS * ones], axis=1)
    return _strokes(place, spots, frames, scales, lab)


def _marked_sizes(
    manner: Manner,
    place: Place,
    surface: Surface,
    brushwork: Brushwork,
    cameras: Sequence[Camera],
    usual: F64,
) -> F64:
    """[STEPS] size of strokes along the profile, moved toward the mark size of paintings, world units."""
    distance = float(np.median([np.linalg.norm(place.local(c.position[None])[0]) for c in cameras]))
    shorter = float(np.median([min(c.width, c.height) / c.width for c in cameras]))
    marks = (
        manner.size * shorter * place.seen_width(cameras) * np.hypot(1, surface.rho / max(distance, 1e-300))
    )
    return np.asarray((usual * brushwork.size) ** (1 - manner.marks) * marks**manner.marks)


def _count(surface: Surface, sizes: F64) -> float:
    """Number of strokes of these sizes that cover a whole stage."""
    return float((2 * np.pi * surface.rho * np.gradient(surface.length) * MARKED_OVERLAP / sizes**2).sum())


def _sizes(surface: Surface, place: Place, cameras: Sequence[Camera]) -> F64:
    """[STEPS] size of strokes along the profile, world units."""
    distance = float(np.median([np.linalg.norm(place.local(c.position[None])[0]) for c in cameras]))
    away = np.clip((surface.rho - place.width) / (FAR * place.radius), 0, 1)
    share = NEAR_SIZE + (FAR_SIZE - NEAR_SIZE) * away
    sizes = share * place.seen_width(cameras) * np.hypot(1, surface.rho / max(distance, 1e-300))
    return np.asarray(np.maximum(sizes, LEAST_SIZE * place.radius))


def _laid(
    surface: Surface, sizes: F64, g: np.random.Generator, overlap: float = OVERLAP, *, until: float = np.inf
) -> tuple[Spots, F64]:
    """Places of strokes of these sizes, [STEPS] along the profile, and the size of each."""
    spots = spots_on(surface, sizes**2 / overlap, PLACE_JITTER, g, until=until)
    return spots, np.interp(spots.along, surface.length, sizes)


def _is_shaded(spots: Spots, shadows: Sequence[Shadow], brushwork: Brushwork) -> Mask:
    is_shaded = np.zeros(len(spots.points), bool)
    for shadow in shadows if brushwork.shadow else ():
        shade, contact, _ = shadow.at(spots.points)
        is_shaded |= np.maximum(shade, contact) > SHADED
    return is_shaded


def _colors(
    spots: Spots,
    surface: Surface,
    shadow: Shadow,
    tones: Tones,
    brushwork: Brushwork,
    ground: Ground | None,
    layout: Layout | None = None,
) -> F64:
    """[n, 3] OKLab of table and wall, in light and shadow; with a layout in the manner of paintings."""
    covered = np.zeros(len(spots.points)) if ground is None else ground.at(spots.points)[0]
    low, high = BLEND
    wall = smoothstep((surface.slope(spots.along) - low) / (high - low))[:, None]
    table = _table(spots.points, surface, tones, ground)
    lab = table + wall * (_wall(spots.points, surface, tones) - table)
    if layout is not None and brushwork.manner is not None:
        lab = map_colors(brushwork.manner, layout, surface, spots, lab)
    if brushwork.shadow == 0:
        return lab
    shade, contact, reflected = shadow.at(spots.points)
    share = brushwork.shadow * (1 - covered)  # the scene's own ground has its shadow already
    lab[:, 1:] += (share[:, None] * REFLECTED * reflected) + (share * shade)[:, None] * COOLER
    lab[:, 0] *= (1 - DARKEST * share * shade) * (1 - CONTACT * share * contact)
    return lab


def _table(points: F64, surface: Surface, tones: Tones, ground: Ground | None) -> F64:
    """[n, 3] OKLab of a table at local points: darker at the back and in front; near a ground like it."""
    right, _, away = points.T
    lab = np.tile(tones.table, (len(points), 1))
    far = np.clip(away / surface.wall, -1, 1)
    lab[:, 0] -= np.where(far > 0, FAR_TABLE, -FRONT) * far
    if ground is not None:
        near = np.clip(1.5 - np.hypot(right, away) / ground.extent, 0, 1)[:, None]
        lab += near * (ground.at(points)[1] - tones.table) * (1, 0.8, 0.8)
    return lab


def _wall(points: F64, surface: Surface, tones: Tones) -> F64:
    """[n, 3] OKLab of a wall at local points: darker upward, lighter to one side."""
    right, height, _ = points.T
    lab = np.tile(tones.wall, (len(points), 1))
    lab[:, 0] += tones.slope * np.clip(right / surface.wall, -1, 1)
    lab[:, 0] -= UPPER * np.clip(height / surface.wall, 0, 1)
    return lab


def _frames(spots: Spots, place: Place, surface: Surface, is_still: bool, g: np.random.Generator) -> F64:
    """[n, 3, 3] local axes of strokes in columns: along, across, off the surface toward the subject."""
    slope, (cos, sin) = surface.slope(spots.along), (np.cos(spots.around), np.sin(spots.around))
    zero = np.zeros(len(cos))
    normal = np.stack([-np.sin(slope) * cos, np.cos(slope), -np.sin(slope) * sin], axis=1)
    around = np.stack([-sin, zero, cos], axis=1)
    rho = np.hypot(*spots.points[:, [0, 2]].T)[:, None]
    seam = np.clip((rho / surface.table - LEVEL_UP_TO) / (1 - LEVEL_UP_TO), 0, 1)
    level = np.array([1.0, 0.0, 0.0]) if is_still else around
    base = (1 - seam) * level + seam * around * np.where(around[:, :1] < 0, -1, 1)
    base = base - (base * normal).sum(axis=1, keepdims=True) * normal
    base /= np.maximum(np.linalg.norm(base, axis=1, keepdims=True), 1e-9)
    is_table = (slope < BLEND[1])[:, None]
    across = np.cross(normal, base)
    at = spots.points / place.radius
    turn = np.where(is_table[:, 0], TABLE_SWAY * _waves(at, 0.8, g), SWAY * _waves(at, 0.35, g))
    turn = (turn + LOOSE * spots.noise[:, 4])[:, None]
    along = np.cos(turn) * base + np.sin(turn) * across
    return np.stack([along, np.cross(normal, along), normal], axis=2)


def _waves(points: F64, frequency: float, g: np.random.Generator, count: int = 6) -> F64:
    """[n] smooth noise of standard deviation 1 at points [n, 3]."""
    directions = g.normal(0, frequency, (count, 3))
    phases = g.uniform(0, 2 * np.pi, count)
    return np.asarray(np.sin(points @ directions.T + phases).sum(axis=1) / np.sqrt(0.5 * count))
