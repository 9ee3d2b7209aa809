"""The strokes of a painted stage: few, large and quiet, small only at the edge of the shadow."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.backdrop import seen_by_any
from brushgs.passes.add.stage_map import (
    Layout,
    Manner,
    layout_of,
    map_colors,
    map_contrasts,
    map_directions,
    places_on,
)
from brushgs.passes.add.stage_surface import Spots, Surface, noise_of, spots_on
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import OKLAB
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.add.stage import Stage

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


def painted_stage(
    stage: "Stage", brushwork: Brushwork, cameras: Sequence[Camera], *, seed: int = 0
) -> Gaussians:
    """The strokes of a stage, all around, float64, without view-dependent color.

    Args:
        stage: table and wall; where its shadow lies at other times, strokes are fine too.
        brushwork: how strokes are painted.
        cameras: of the job, at least one; sizes of strokes refer to their pictures.
        seed: of the jitter.
    """
    g, *of_layers = np.random.default_rng([seed, 7]).spawn(3)
    usual = _sizes(stage, cameras)
    if brushwork.manner is not None:
        return _in_manner(brushwork.manner, stage, brushwork, cameras, usual, g)
    shadows = (stage.shadow, *stage.others) if brushwork.shadow else ()
    size, radius = float(brushwork.size), stage.place.radius
    spots = Spots.of(_core.lay_layers(stage.surface, usual, size, radius, shadows, noise_of(of_layers)))
    lab, frames = _colors(spots, stage, brushwork), _frames(spots, stage, cameras, g)
    return _strokes(stage, spots, frames, lab, (brushwork.aspect, *brushwork.jitter))


def size_beside(num_strokes: int) -> float:
    """The size of strokes on a stage whose subject has so many: the usual one for 6000."""
    return _core.size_beside(num_strokes)


def _strokes(
    stage: "Stage",
    spots: Spots,
    frames: F64,
    lab: F64,
    style: tuple[float, float, float],
    contrast: F64 | None = None,
    longer: F64 | None = None,
) -> Gaussians:
    """Strokes with an aspect and a jitter, times factors [n] on this jitter and on lengths."""
    made = _core.strokes_on(stage.place, spots, frames, lab, style, contrast, longer, OKLAB)
    means, quats, scales, opacities, sh = made
    means, quats, scales = (one.reshape(len(lab), -1) for one in (means, quats, scales))
    return Gaussians(means, quats, scales, opacities, sh.reshape(-1, 1, 3))


def _in_manner(
    manner: Manner,
    stage: "Stage",
    brushwork: Brushwork,
    cameras: Sequence[Camera],
    usual: F64,
    g: np.random.Generator,
) -> Gaussians:
    """The visible strokes of a stage in the manner of paintings, as large as the marks of these."""
    place, surface = stage.place, stage.surface
    height, width = manner.parts[0].stage.colors.shape[:2]
    layout = layout_of(surface, place, cameras, width / height)
    aspect = manner.aspect**manner.marks * brushwork.aspect ** (1 - manner.marks)
    reach = SEEN_REACH * np.sqrt(aspect) / _core.STROKE_SIGMAS
    sizes = _marked_sizes(manner, stage, cameras, usual * brushwork.size)

    def seen(spots: Spots) -> Mask:
        return seen_by_any(place.world(spots.points), reach * spots.sizes, cameras)

    probe_sizes = sizes * np.sqrt(_count(surface, sizes) / PROBES)
    probes = spots_on(surface, probe_sizes * np.sqrt(MARKED_OVERLAP), MARKED_OVERLAP, g.spawn(1)[0])
    share = float(seen(probes).mean())
    sizes = sizes * max(np.sqrt(share * _count(surface, sizes) / MOST_SEEN), 1.0)
    spots = spots_on(surface, sizes, MARKED_OVERLAP, g.spawn(1)[0])
    kept = seen(spots)
    spots = Spots(*(column[kept] for column in spots))
    lab = _colors(spots, stage, brushwork, layout)
    share = manner.color
    lightness, chroma = (
        (1 - share) * own + share * of_style
        for own, of_style in zip(brushwork.jitter, manner.jitter, strict=True)
    )
    broken = 1 - share + share * map_contrasts(manner, places_on(layout, surface, spots))
    frames = _frames(spots, stage, cameras, g)
    slope, (cos, sin) = surface.slope(spots.along), (np.cos(spots.around), np.sin(spots.around))
    around = np.stack([-sin, np.zeros(len(cos)), cos], axis=1)
    rise = np.stack([np.cos(slope) * cos, np.sin(slope), np.cos(slope) * sin], axis=1)
    along, stretch = map_directions(manner, layout, surface, spots, frames[:, :, 0], (around, rise))
    frames = np.stack([along, np.cross(frames[:, :, 2], along), frames[:, :, 2]], axis=2)
    return _strokes(stage, spots, frames, lab, (aspect, lightness, chroma), broken, stretch)


def _marked_sizes(manner: Manner, stage: "Stage", cameras: Sequence[Camera], usual: F64) -> F64:
    """[steps] size of strokes along the profile, moved toward the mark size of paintings, world units."""
    shorter = float(np.median([min(c.width, c.height) / c.width for c in cameras]))
    farther = np.hypot(1, stage.surface.rho / max(_distance(stage, cameras), 1e-300))
    marks = manner.size * shorter * stage.place.seen_width(cameras) * farther
    return np.asarray(usual ** (1 - manner.marks) * marks**manner.marks)


def _count(surface: Surface, sizes: F64) -> float:
    """Number of strokes of these sizes that cover a whole stage."""
    return float((2 * np.pi * surface.rho * np.gradient(surface.length) * MARKED_OVERLAP / sizes**2).sum())


def _distance(stage: "Stage", cameras: Sequence[Camera]) -> float:
    return float(np.median([np.linalg.norm(stage.place.local(c.position[None])[0]) for c in cameras]))


def _sizes(stage: "Stage", cameras: Sequence[Camera]) -> F64:
    """[steps] size of strokes along the profile, world units."""
    place, distance = stage.place, _distance(stage, cameras)
    return np.asarray(_core.stroke_sizes(stage.surface, place, distance, place.seen_width(cameras)))


def _colors(spots: Spots, stage: "Stage", brushwork: Brushwork, layout: Layout | None = None) -> F64:
    """[n, 3] OKLab of table and wall, in light and shadow; with a layout in the manner of paintings."""
    surface, ground = stage.surface, stage.ground
    lab = np.asarray(_core.surface_colors(surface, spots, stage.tones, ground)).reshape(-1, 3)
    if layout is not None and brushwork.manner is not None:
        lab = map_colors(brushwork.manner, places_on(layout, surface, spots), lab)
    if brushwork.shadow > 0:
        _core.shade_colors(spots, stage.shadow, brushwork.shadow, ground, lab)
    return lab


def _frames(spots: Spots, stage: "Stage", cameras: Sequence[Camera], g: np.random.Generator) -> F64:
    """[n, 3, 3] local axes of strokes in columns: along, across, off the surface toward the subject."""
    count, radius = _core.NUM_WAVES, stage.place.radius
    waves = np.stack([np.column_stack([g.normal(0, 1, (count, 3)), g.random(count)]) for _ in range(2)])
    frames = _core.stage_frames(stage.surface, spots, waves, radius, len(cameras) == 1)
    return np.asarray(frames).reshape(-1, 3, 3)
