"""The strokes of a painted stage: few, large and quiet, small only at the edge of the shadow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.backdrop import seen_by_any
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_map import Layout, Manner, layout_of, map_colors, map_contrasts, map_directions
from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_shadow import REACH, Shadow
from brushgs.passes.add.stage_surface import Spots, Surface, spots_on
from brushgs.passes.add.stage_tones import Tones
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

FINE = 0.55  # size of strokes in the shadow, relative to others at that distance
OVERLAP = 9.6  # strokes over each point
PLACE_JITTER, SIZE_JITTER = 0.35, 0.18  # in widths of a cell; standard deviation of the logarithm of sizes
SIGMAS = 3.6  # size of a stroke in standard deviations
THICKNESS = 0.01
OPACITY = 0.95
SHADED = 0.08  # minimum shade or contact of fine strokes
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
    """[steps] size of strokes along the profile, moved toward the mark size of paintings, world units."""
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
    """[steps] size of strokes along the profile, world units."""
    distance = float(np.median([np.linalg.norm(place.local(c.position[None])[0]) for c in cameras]))
    seen_width = place.seen_width(cameras)
    found = _core.stroke_sizes(
        surface.rho, radius=place.radius, width=place.width, distance=distance, seen_width=seen_width
    )
    return np.asarray(found)


def _laid(
    surface: Surface, sizes: F64, g: np.random.Generator, overlap: float = OVERLAP, *, until: float = np.inf
) -> tuple[Spots, F64]:
    """Places of strokes of these sizes, [steps] along the profile, and the size of each."""
    spots = spots_on(surface, sizes**2 / overlap, PLACE_JITTER, g, until=until)
    return spots, np.interp(spots.along, surface.length, sizes)


def _is_shaded(spots: Spots, shadows: Sequence[Shadow], brushwork: Brushwork) -> Mask:
    is_shaded = np.zeros(len(spots.points), bool)
    for shadow in shadows if brushwork.shadow else ():
        is_shaded |= shadow.at(spots.points)[:, :2].max(axis=1) > SHADED
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
    covered, own = (None, None) if ground is None else ground.at(spots.points)
    lab = np.asarray(
        _core.surface_colors(
            spots.points,
            surface.slope(spots.along),
            table=tones.table.tolist(),
            wall=tones.wall.tolist(),
            slope=tones.slope,
            reach=surface.wall,
            ground_lab=own,
            ground_extent=0.0 if ground is None else ground.extent,
        )
    ).reshape(-1, 3)
    if layout is not None and brushwork.manner is not None:
        lab = map_colors(brushwork.manner, layout, surface, spots, lab)
    if brushwork.shadow > 0:
        # The scene's own ground has its shadow already.
        share = np.full(len(lab), brushwork.shadow) if covered is None else brushwork.shadow * (1 - covered)
        _core.shade_colors(shadow.at(spots.points), share, lab)
    return lab


def _frames(spots: Spots, place: Place, surface: Surface, is_still: bool, g: np.random.Generator) -> F64:
    """[n, 3, 3] local axes of strokes in columns: along, across, off the surface toward the subject."""
    found = _core.stage_frames(
        spots.points,
        surface.slope(spots.along),
        around=spots.around,
        turns=np.ascontiguousarray(spots.noise[:, 4]),
        waves=np.stack([_waves(frequency, g) for frequency in (0.8, 0.35)]),
        table=surface.table,
        radius=place.radius,
        is_still=is_still,
    )
    return np.asarray(found).reshape(-1, 3, 3)


def _waves(frequency: float, g: np.random.Generator) -> F64:
    """[NUM_WAVES, 4] directions and phases of waves, whose sum is smooth noise."""
    directions = g.normal(0, frequency, (_core.NUM_WAVES, 3))
    return np.column_stack([directions, g.uniform(0, 2 * np.pi, _core.NUM_WAVES)])
