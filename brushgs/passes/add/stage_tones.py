"""The tones of a stage by counterchange: light behind dark parts of the subject, dark behind light parts.

Table and wall are two masses, one warm and one cool. Their lightness is chosen so that the silhouette of the
subject stands out in the views of the job.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.options.choices import StageTone
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_surface import Surface
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import OKLAB
from brushgs.values.gaussians import Gaussians

READS: float = _core.OUTLINE_READS  # OKLab lightness difference at which a silhouette stands out
SIDE: int = _core.OUTLINE_SIDE  # pixels, longer side of a view in which the outline is found
MOST_VIEWS = 3
RANGES: dict[StageTone, tuple[float, float]] = {"auto": (0.0, 1.0), "light": (0.6, 0.8), "dark": (0.3, 0.46)}


class Outline(NamedTuple):
    """Pixels of the outline of a subject: its lightness, and the part of the stage behind it.

    [n] OKLab lightness inside; [n] whether the table is behind; [n] horizontal position of the wall behind,
    -1 to 1.
    """

    lightness: F64
    is_table: Mask
    lateral: F64


class Tones(NamedTuple):
    """The colors of a stage, OKLab.

    Attributes:
        table: [3].
        wall: [3] in its middle.
        slope: change of the wall's lightness from its middle to the right.
        reads: share of the outline at which the lightness differs by at least `READS`.
    """

    table: F64
    wall: F64
    slope: float
    reads: float


def outline_of(
    subject: Gaussians, cameras: Sequence[Camera], place: Place, surface: Surface, ground: Ground | None
) -> Outline:
    """The outline of a subject in some of the views.

    Args:
        subject: the strokes on the stage, in their painted colors.
        cameras: at least one.
        place: of the subject.
        surface: the stage.
        ground: of the scene itself, or None; parts of the subject before it are not before the stage.
    """
    extent = 0.0 if ground is None else ground.extent
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    step = max(len(cameras) // MOST_VIEWS, 1)
    parts = []
    for camera in list(cameras)[::step][:MOST_VIEWS]:
        small = camera.in_side(SIDE)
        frame = render_with(subject, small, kernel, options)
        rgb, alpha = (np.ascontiguousarray(one, np.float64) for one in (frame.rgb, frame.alpha))
        found = _core.outline_in(rgb, alpha, small.viewmat, small.K, place, surface, extent, OKLAB)
        parts.append(found)
    lightness, is_table, lateral = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Outline(lightness, is_table.astype(bool), lateral)


def choose_tones(
    mean: F64,
    outline: Outline,
    choice: "StageTone | tuple[F64, F64]" = "auto",
    *,
    ground: F64 | None = None,
    values: float = 0.0,
) -> Tones:
    """Tones for a subject.

    Args:
        mean: [3] OKLab, its mean color.
        outline: of the subject.
        choice: "light" or "dark" walls, or OKLab of table and wall.
        ground: [3] OKLab of the scene's own ground, which is the color of the table.
        values: 0 to 1, how far the values of the picture are opened: table and wall are its largest masses.
    """
    if isinstance(choice, tuple):
        table, wall = choice
        return Tones(table, wall, 0.0, _core.tones_read(outline, float(table[0]), float(wall[0])))
    low, high = RANGES[choice]
    found = _core.choose_tones(outline, mean.tolist(), low, high, ground, values)
    return Tones(*found)
