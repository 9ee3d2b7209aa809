"""The tones of a stage by counterchange: light behind dark parts of the subject, dark behind light parts.

Table and wall are two masses, one warm and one cool. Their lightness is chosen so that the silhouette of the
subject stands out in the views of the job.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import StageTone
from brushgs.passes.add.ground_maps import blurred
from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_surface import Surface
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians

SIDE, MOST_VIEWS = 160, 3  # pixels, longer side of a view in which the outline is found; views
BLUR, NEARLY = 1.5, 0.8  # pixels, blur of an outline, and share of the subject around its pixels
READS = 0.15  # OKLab lightness difference at which a silhouette stands out
LIGHTNESS = np.arange(0.30, 0.80, 0.04)  # candidates for table and wall
SLOPES = np.array(
    [-0.14, -0.07, 0.0, 0.07, 0.14]
)  # change of the wall's lightness from its middle to the right
RANGES: dict[StageTone, tuple[float, float]] = {"auto": (0.0, 1.0), "light": (0.6, 0.8), "dark": (0.3, 0.46)}
# Costs, in shares of an outline that stands out: of a wall away from middle tones, of a slope, of an unusual
# difference between table and wall.
AWAY, SLOPED, TOO_NEAR, TOO_FAR = 0.4, 0.4, 1.0, 0.8
APART, OPENED = (0.06, 0.16), 0.12  # and more if the values of the picture are opened
COMPLEMENT, CHROMA = 0.6, (0.018, 0.045)  # of the subject's color in the wall; minimum and maximum chroma
WARM, COOL = np.array([0.010, 0.030]), np.array([-0.005, -0.022])  # a and b of the table instead
OF_SUBJECT = 0.2  # of the subject's color in the table


class Outline(NamedTuple):
    """Pixels of the outline of a subject: its lightness, and the part of the stage behind it.

    [n] OKLab lightness inside; [n] whether the table is behind; [n] horizontal position of the wall behind,
    -1 to 1.
    """

    lightness: F64
    is_table: Mask
    lateral: F64


@dataclass(frozen=True, eq=False)
class Tones:
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
    subject: Gaussians, cameras: Sequence[Camera], place: Place, surface: Surface, *, own: float = 0.0
) -> Outline:
    """The outline of a subject in some of the views.

    Args:
        subject: the strokes on the stage, in their painted colors.
        cameras: at least one.
        place: of the subject.
        surface: the stage.
        own: radius of the scene's own ground; parts of the subject before it are not before the stage.
    """
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    step = max(len(cameras) // MOST_VIEWS, 1)
    parts = []
    for camera in list(cameras)[::step][:MOST_VIEWS]:
        small = camera.in_side(SIDE)
        frame = render_with(subject, small, kernel, options)
        parts.append(_outline_in(frame.rgb, frame.alpha, small, place, surface, own))
    return Outline(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _outline_in(
    rgb: Array, alpha: Array, camera: Camera, place: Place, surface: Surface, own: float
) -> Outline:
    mask = (alpha > 0.5).astype(np.float64)
    inside = blurred(mask * alpha, BLUR)
    near = blurred(mask, BLUR)
    rows, columns = np.nonzero((mask > 0) & (near < NEARLY) & _off_border(mask.shape))
    shown = np.stack([blurred(mask * rgb[..., k], BLUR)[rows, columns] for k in range(3)], axis=1)
    lightness = oklab_of(np.clip(shown / inside[rows, columns][:, None], 0, 1))[:, 0]
    x = (columns + 0.5 - camera.K[0, 2]) / camera.K[0, 0]
    y = (rows + 0.5 - camera.K[1, 2]) / camera.K[1, 1]
    rays = np.stack([x, y, np.ones(len(x))], axis=1) @ camera.viewmat[:3, :3] @ place.axes.T
    eye = place.local(camera.position[None])[0]
    down = -rays[:, 1]
    reach = np.where(down > 1e-9, eye[1] / np.where(down > 1e-9, down, 1.0), np.inf)
    far = np.minimum(reach, 1e6 * place.radius)[:, None]
    hits = np.hypot(*(eye + far * rays)[:, [0, 2]].T)
    is_table = np.isfinite(reach) & (reach > 0) & (hits < 1.15 * surface.table)
    level = rays[:, [0, 2]] / np.maximum(np.linalg.norm(rays[:, [0, 2]], axis=1), 1e-12)[:, None]
    kept = ~is_table | (hits > own)
    lateral = (eye[0] + level[:, 0] * surface.wall) / surface.wall
    return Outline(lightness[kept], is_table[kept], lateral[kept])


def _off_border(shape: tuple[int, ...]) -> Mask:
    """Pixels far enough from the border of the picture."""
    inner = np.zeros(shape, bool)
    inner[3:-3, 3:-3] = True
    return inner


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
        reads = _reads(outline, table[:1], wall[:1], np.zeros(1))
        return Tones(table, wall, 0.0, float(reads.item()))
    table_ab, wall_ab = _hues(mean)
    if ground is not None:
        table_ab = ground[1:]
    low, high = RANGES[choice]
    walls = LIGHTNESS[(low <= LIGHTNESS) & (high >= LIGHTNESS)]
    tables = LIGHTNESS if ground is None else np.array([ground[0]])
    reads = _reads(outline, tables, walls, SLOPES)
    apart = np.abs(tables[:, None] - walls)[..., None]
    away = np.abs(walls - 0.52) + np.abs(tables - 0.5)[:, None]
    cost = AWAY * away[..., None] + SLOPED * np.abs(SLOPES)
    if ground is None:
        least, most = (bound + values * OPENED for bound in APART)
        cost = cost + TOO_NEAR * np.maximum(least - apart, 0) + TOO_FAR * np.maximum(apart - most, 0)
    best = np.unravel_index((reads - cost).argmax(), reads.shape)
    table, wall = np.array([tables[best[0]], *table_ab]), np.array([walls[best[1]], *wall_ab])
    return Tones(table, wall, float(SLOPES[best[2]]), float(reads[best]))


def _reads(outline: Outline, tables: F64, walls: F64, slopes: F64) -> F64:
    """[tables, walls, slopes] share of the outline that stands out."""
    on_table = outline.is_table
    count = max(len(outline.lightness), 1)
    below = np.abs(outline.lightness[on_table] - tables[:, None]) >= READS
    behind = walls[:, None, None] + slopes[:, None] * outline.lateral[~on_table]
    above = np.abs(outline.lightness[~on_table] - behind) >= READS
    return np.asarray((below.sum(axis=1)[:, None, None] + above.sum(axis=2)) / count)


def _hues(mean: F64) -> tuple[F64, F64]:
    """[2] a and b of table and wall for a subject of this mean color: one warm, one cool."""
    chroma = float(np.hypot(*mean[1:]))
    least, most = CHROMA
    opposite = -mean[1:] / chroma if chroma > 1e-3 else COOL / np.hypot(*COOL)
    wall = opposite * min(max(COMPLEMENT * chroma, least), most)
    is_warm = wall @ (WARM - COOL) > 0
    return OF_SUBJECT * mean[1:] + (COOL if is_warm else WARM), wall
