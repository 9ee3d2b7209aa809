"""Paint a path in every configuration and measure what moves, by the protocol of the package."""

import hashlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array
from brushgs.errors import SceneWarning
from brushgs.measure.box_events import (
    SPIN,
    Events,
    off_axis_share,
    orientation_events,
    worst_shortfall,
)
from brushgs.measure.stability.advice import advice
from brushgs.measure.stability.figures import Figures, Stability
from brushgs.measure.stability.painters import (
    PLAIN,
    Comparison,
    MakePainters,
    Painter,
    StrokePainter,
    all_painters,
    no_painters,
)
from brushgs.measure.stability.pair_errors import PaintedFrame, PairErrors
from brushgs.measure.stability.schedule import FrameSchedule
from brushgs.measure.warp import View
from brushgs.options.experiments import StabilityConfig
from brushgs.rendering.knots import is_closed
from brushgs.scene import Boxes, Camera, Frame

NOTHING_COMPARED = (
    "no two frames of the path show the same surface, so no flicker could be measured; take smaller steps"
)
UNLOCKED = "off"  # the configuration whose strokes turn without a lock, and whose paint weights the pixels


def measure_stability(
    comparison: Comparison,
    config: StabilityConfig | None = None,
    *,
    make_extra_painters: MakePainters = no_painters,
    advance: Callable[[], None] = lambda: None,
) -> Stability:
    """Paint a path in every configuration and measure how stable it is.

    Args:
        comparison: scene, strokes, path and stroke image.
        config: gaps, and how much is compared.
        make_extra_painters: adds configurations to those of the report, before `plain`.
        advance: called after each painted frame; see `num_painted_frames`.

    Raises:
        ValueError: if the path has fewer than two views, or views of more than one size.
    """
    config = config or StabilityConfig()
    check_cameras(comparison.cameras)
    schedule = _schedule(comparison, config)
    num_threads = comparison.options.num_threads
    painters = all_painters(comparison, num_threads, make_extra_painters)
    errors = PairErrors(list(painters))
    hashes = dict(_paint_all(comparison, painters, schedule, errors, advance))
    equal = _paint_again(comparison, all_painters(comparison, 1, make_extra_painters), schedule, hashes)
    figures = tuple(
        _figures(painter, errors, schedule, alone_equal=equal[name]) for name, painter in painters.items()
    )
    if not errors.starts:
        warnings.warn(SceneWarning(NOTHING_COMPARED), stacklevel=2)
    result = Stability(
        schedule.num_frames, schedule.is_closed, schedule.stride, tuple(errors.starts), figures
    )
    return replace(result, advice=advice(result))


def num_painted_frames(comparison: Comparison, config: StabilityConfig) -> int:
    """How many frames of the path are painted."""
    return len(_schedule(comparison, config).painted)


def check_cameras(cameras: Sequence[Camera]) -> None:
    """Refuse a path on which nothing can be compared.

    Raises:
        ValueError: if it has fewer than two views, or views of more than one size.
    """
    if len(cameras) < 2:
        raise ValueError(f"stability: the path must have at least 2 views to compare, got {len(cameras)}")
    sizes = {(camera.width, camera.height) for camera in cameras}
    if len(sizes) > 1:
        found = " and ".join(f"{width}x{height}" for width, height in sorted(sizes)[:2])
        raise ValueError(f"stability: all views must have one size, got {found}; use Camera.resized")


def _schedule(comparison: Comparison, config: StabilityConfig) -> FrameSchedule:
    closes = is_closed(comparison.strokes, comparison.cameras)
    return FrameSchedule(len(comparison.cameras), closes, config)


def _paint_all(
    comparison: Comparison,
    painters: dict[str, Painter],
    schedule: FrameSchedule,
    errors: PairErrors,
    advance: Callable[[], None],
) -> Iterator[tuple[int, dict[str, str]]]:
    """Paint the frames of the schedule in order and compare them; hashes of those that are painted again."""
    kept: dict[int, PaintedFrame] = {}
    unlocked = painters[UNLOCKED]
    assert isinstance(unlocked, StrokePainter)
    for index in schedule.painted:
        camera = comparison.cameras[index]
        frames = _paint_frame(comparison, painters, index)
        kept[index] = now = _painted_frame(comparison, frames, camera, unlocked.boxes(index))
        for gap, start in schedule.pairs_ending(index):
            weights = None
            if gap == 1:
                weights = _turning_share(kept[start].unlocked, now.unlocked, unlocked, camera)
            errors.add_pair(gap, start, kept[start], now, weights)
        if schedule.is_closed and index == schedule.num_frames - 1:
            errors.add_loop(kept[0], now)
        if index in schedule.alone:
            yield index, {name: _hash(frame) for name, frame in frames.items()}
        kept = {i: frame for i, frame in kept.items() if schedule.last_use[i] > index}
        advance()


def _paint_frame(comparison: Comparison, painters: dict[str, Painter], index: int) -> dict[str, Frame]:
    """One frame in every configuration; the plain picture first, because the others may start from it."""
    plain_painter = painters[PLAIN]
    assert isinstance(plain_painter, StrokePainter)
    plain = plain_painter.paint(index)
    picture = np.clip(plain.over(comparison.background), 0, 1)
    frames = {name: painter.paint(index, picture) for name, painter in painters.items() if name != PLAIN}
    return frames | {PLAIN: plain}


def _painted_frame(
    comparison: Comparison, frames: dict[str, Frame], camera: Camera, unlocked: Boxes
) -> PaintedFrame:
    pictures = {name: np.clip(frame.over(comparison.background), 0, 1) for name, frame in frames.items()}
    plain = frames[PLAIN]
    assert plain.depth is not None
    return PaintedFrame(pictures, View(pictures[PLAIN], plain.depth, plain.alpha, camera), unlocked)


def _turning_share(before: Boxes, now: Boxes, painter: StrokePainter, camera: Camera) -> Array:
    """[H, W] share of the paint of each pixel that belongs to strokes whose direction turns, 0 to 1."""
    _, i, j = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
    turn = now.angles[j].astype(np.float64) - before.angles[i]
    is_turning: NDArray[np.bool_] = np.zeros(len(now), np.bool_)
    is_turning[j] = np.abs(np.remainder(turn + np.pi, 2 * np.pi) - np.pi) > SPIN
    white = np.repeat(is_turning[:, None], 3, axis=1).astype(now.colors.dtype)
    return painter.draw(replace(now, colors=white), camera).rgb[..., 0]


def _paint_again(
    comparison: Comparison,
    painters: dict[str, Painter],
    schedule: FrameSchedule,
    hashes: dict[int, dict[str, str]],
) -> dict[str, int]:
    """How many frames of each configuration come out the same when painted alone, in reverse order."""
    equal = dict.fromkeys(painters, 0)
    for index in reversed(schedule.alone):
        for name, frame in _paint_frame(comparison, painters, index).items():
            equal[name] += _hash(frame) == hashes[index][name]
    return equal


def _hash(frame: Frame) -> str:
    return hashlib.sha256(frame.rgb.tobytes() + frame.alpha.tobytes()).hexdigest()


def _figures(painter: Painter, errors: PairErrors, schedule: FrameSchedule, *, alone_equal: int) -> Figures:
    """All figures of a configuration."""
    name = painter.name
    # Only strokes in space last from frame to frame.
    lasting = painter if isinstance(painter, StrokePainter) and name != PLAIN else None
    return Figures(
        name=name,
        what=painter.what,
        strokes=painter.num_strokes,
        lock=str(lasting.options.lock) if lasting else None,
        filter=lasting.options.filter if lasting else None,
        order=lasting.options.order if lasting else None,
        num_sigmas=float(np.mean(painter.options.num_sigmas)) if isinstance(painter, StrokePainter) else None,
        events=_events(lasting) if lasting else None,
        off_axis_share=off_axis_share(*_boxes_and_ellipses(lasting)) if lasting else None,
        shortfall=worst_shortfall(*_boxes_and_ellipses(lasting)) if lasting else None,
        warps=errors.warps(name),
        turning=errors.turning(name),
        loop=errors.loop(name),
        alone=len(schedule.alone),
        alone_equal=alone_equal,
        seconds=painter.timer.per_frame(schedule.num_frames),
        errors=errors.rmse_at_gap_1(name),
    )


def _events(painter: StrokePainter) -> Events:
    boxes, ellipses = _boxes_and_ellipses(painter)
    camera = painter.cameras[0]
    return orientation_events(boxes, width=camera.width, height=camera.height, ellipses=ellipses)


def _boxes_and_ellipses(painter: StrokePainter) -> tuple[Iterator[Boxes], Iterator[Boxes]]:
    """The boxes of all frames and those of their ellipses, projected anew so that none is held in memory."""
    return painter.all_boxes(), painter.all_boxes("off")
