"""The golden pictures: one table of what is painted, how, and onto what.

Feeds the test and `python -m tests.golden.regenerate`. The strokes are the Gaussians of a still life of few:
no clustering, whose outcome turns on the last bits of a sum (a scene of 12,000 moved by 1e-6, then grouped,
painted 5 % of the pixels otherwise).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.options.choices import Blend, Filter, Order
from brushgs.passes.motion.canonical import canonical
from brushgs.passes.motion.rows import follow_rows
from brushgs.rendering.light import Lamp
from brushgs.rendering.motion import StrokeMotion
from brushgs.rendering.project import project
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import Surface, paper
from brushgs.rendering.track_moving import MovingTrack, track_moving
from brushgs.rendering.underpaint import Underpaint
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from brushgs.values.boxes import Boxes
from brushgs.values.gaussians import Gaussians
from tests.scenes import still_life_of

FOLDER = Path(__file__).parent
WIDTH, HEIGHT = 128, 96
ORDERS: tuple[Order, Order] = ("depth", "soft")
WHITE = (1.0, 1.0, 1.0)
NUM_MOMENTS = 46  # of the film, 30 a second
NUM_STROKES, NUM_FINE_STROKES, NUM_LARGE_STROKES = 2400, 8000, 1000  # about
UNDERPAINT = Underpaint.for_sigmas(2)  # `num_sigmas` of every stroke image


@dataclass(frozen=True)
class Case:
    """One golden picture: `<name>.png` beside this file."""

    stroke: str
    filter: Filter
    boxes: Callable[[float], Boxes]  # num_sigmas -> float64 boxes
    background: tuple[float, float, float] | None = WHITE  # None: transparent
    underpaint: Underpaint | None = None
    streaks: float = 0.0
    lamp: Lamp | None = None  # that shines on the height of the paint
    blend: Blend = "cover"
    surface: Callable[[], Surface] | None = None  # what the strokes are laid on

    @property
    def texture(self) -> BrushSet:
        return BrushSet.open(self.stroke)


@lru_cache
def scene(num_strokes: int) -> Gaussians:
    return still_life_of(num_strokes).astype(np.float64)


def boxes_of(
    gaussians: Gaussians, num_sigmas: float, order: Order = "depth", relief: Relief | bool = False
) -> Boxes:
    camera = still_life_camera(width=WIDTH, height=HEIGHT)
    return project(gaussians, camera, num_sigmas=num_sigmas, order=order, underpaint=True, relief=relief)


def still_boxes(num: int, scale: float = 1.0, **options: Any) -> Callable[[float], Boxes]:
    """Makes boxes of the still life of so many strokes, larger by a factor."""
    return lambda num_sigmas: boxes_of(scene(num), scale * num_sigmas, **options)


still_life_boxes, soft_boxes = still_boxes(NUM_STROKES), still_boxes(NUM_STROKES, order="soft")
fine_boxes = still_boxes(NUM_FINE_STROKES)
# Few strokes, large enough to show streaks; and of thick paint.
large_boxes, large_soft_boxes = (still_boxes(NUM_LARGE_STROKES, 1.8, order=order) for order in ORDERS)
THICK = Relief(2.0, 8.0)
thick_boxes, thick_soft_boxes = (
    still_boxes(NUM_LARGE_STROKES, 1.8, order=order, relief=THICK) for order in ORDERS
)


@lru_cache
def film() -> tuple[Gaussians, StrokeMotion, MovingTrack]:
    """The still life in motion, each Gaussian a stroke, until the pear rolls and the cloth is lifted."""
    moving = still_life_moving(NUM_STROKES)
    times = np.arange(NUM_MOMENTS) / 30
    strokes = canonical(moving, times).gaussians
    assert strokes.ids is not None, "they are rows of the scene"
    motion = follow_rows(moving, times, strokes, strokes, strokes.ids.astype(np.intp))
    cameras = [still_life_camera(width=WIDTH, height=HEIGHT)] * NUM_MOMENTS
    return strokes, motion, track_moving(strokes, cameras, motion, np.arange(float(NUM_MOMENTS)), fps=30)


def moving_boxes(num_sigmas: float) -> Boxes:
    """The last frame of the film."""
    strokes, motion, track = film()
    return project(
        motion.pose(NUM_MOMENTS - 1).moved(strokes).astype(np.float64),
        still_life_camera(width=WIDTH, height=HEIGHT),
        num_sigmas=num_sigmas,
        lock=track.directions(NUM_MOMENTS - 1),
        order="soft",
        underpaint=True,
    )


def toned_paper() -> Surface:
    """A paper in a warm tone, rough enough for so small a picture."""
    return paper((0.80, 0.72, 0.58), height=HEIGHT, width=WIDTH, strength=6.0)


def wheel_boxes(num_sigmas: float) -> Boxes:
    """A wheel of strokes in all directions and colors, from large to far below a pixel."""
    turns = np.linspace(0, 2 * np.pi, 25)[:-1]
    rings = [(36, 14, 5), (22, 8, 4), (12, 4, 2.4), (6, 1.6, 0.8), (2.5, 0.5, 0.3)]  # radius, half extents
    columns: list[tuple[float, ...]] = []
    for depth, (radius, long, short) in enumerate(rings):
        for i, turn in enumerate(turns):
            x, y = 64.3 + 1.3 * radius * np.cos(turn), 47.6 + radius * np.sin(turn)
            rgb = 0.5 + 0.5 * np.cos(turn + depth + np.array([0, 2, 4]) * np.pi / 3)
            columns.append((x, y, long, short, turn + 0.4, 5 - depth + i / 100, *rgb, 0.35 + 0.6 * (i % 2)))
    table: NDArray[np.float64] = np.array(columns)
    table = table[np.argsort(table[:, 5], kind="stable")]
    centers, half_extents, colors = (np.ascontiguousarray(table[:, i:j]) for i, j in ((0, 2), (2, 4), (6, 9)))
    angles, depths, opacities = (np.ascontiguousarray(table[:, i]) for i in (4, 5, 9))
    ids = np.arange(len(table), dtype=np.int32)
    return Boxes(centers, half_extents, angles, depths, colors, opacities, ids)


def changed(made: Callable[[float], Boxes], **columns: Callable[[Boxes], Any]) -> Callable[[float], Boxes]:
    """Makes boxes with some columns exchanged, each a function of the boxes."""

    def boxes(num_sigmas: float) -> Boxes:
        before = made(num_sigmas)
        return replace(before, **{name: column(before) for name, column in columns.items()})

    return boxes


# Softness that reaches over much of a ring, and one stroke in 25 that reaches over all.
soft_wheel_boxes = changed(wheel_boxes, softness=lambda b: np.where(b.ids % 25 == 0, 10, 0.1))
# Thick paint, so that much of the ground is seen.
thick_wheel_boxes = changed(wheel_boxes, reliefs=lambda b: np.tile((2.0, 8.0), (len(b), 1)))
# Enlarged by half, underpaint from none to three rings behind its stroke.
set_back_wheel_boxes = changed(
    wheel_boxes, half_extents=lambda b: 1.5 * b.half_extents, setbacks=lambda b: b.ids % 7 * 0.5
)
large_boxes_of_three = changed(large_boxes, brushes=lambda b: (b.ids % 3).astype(np.uint8))
CASES = {
    "swirl_mip": Case("swirl", "mip", still_life_boxes),
    "swirl_bilinear": Case("swirl", "bilinear", still_life_boxes),
    "flat_mip": Case("flat", "mip", still_life_boxes),
    "dry_brush_mip": Case("dry_brush", "mip", still_life_boxes),
    "dry_brush_fine_mip": Case("dry_brush", "mip", fine_boxes),
    "dry_brush_fine_bilinear": Case("dry_brush", "bilinear", fine_boxes),
    "ink_mip": Case("ink", "mip", still_life_boxes),
    "palette_knife_nearest": Case("palette_knife", "nearest", still_life_boxes),
    "gaussian": Case("gaussian", "mip", still_life_boxes),
    "ellipse": Case("ellipse", "mip", still_life_boxes),
    "wheel_on_nothing": Case("filbert", "mip", wheel_boxes, background=None),
    "dry_brush_soft": Case("dry_brush", "mip", soft_boxes),
    "dry_brush_underpaint": Case("dry_brush", "mip", still_life_boxes, underpaint=UNDERPAINT),
    "dry_brush_underpaint_soft": Case("dry_brush", "mip", soft_boxes, underpaint=UNDERPAINT),
    "impasto_streaks": Case("impasto", "mip", large_boxes, streaks=0.5),
    "flat_underpaint_streaks_soft": Case(
        "flat", "bilinear", large_soft_boxes, underpaint=UNDERPAINT, streaks=0.4
    ),
    "wheel_underpaint": Case("filbert", "nearest", set_back_wheel_boxes, None, Underpaint(1.3), 0.5),
    "three_brushes": Case("filbert_2,dab,wash", "mip", large_boxes_of_three, streaks=0.2),
    "impasto_relief": Case("impasto", "mip", thick_boxes, lamp=Lamp()),
    "flat_relief_soft": Case(
        "flat", "bilinear", thick_soft_boxes, None, UNDERPAINT, 0.3, Lamp(elevation=0.7, strength=0.8)
    ),
    "wash_glaze_on_paper": Case("wash", "mip", wheel_boxes, blend="glaze", surface=toned_paper),
    "dry_brush_relief_on_paper": Case(
        "dry_brush", "mip", thick_wheel_boxes, lamp=Lamp(), surface=toned_paper
    ),
    "wheel_soft": Case("filbert", "bilinear", soft_wheel_boxes, background=None),
    "flat_moving": Case("flat", "mip", moving_boxes, underpaint=UNDERPAINT),
}
