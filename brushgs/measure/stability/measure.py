"""Paint a path in every configuration and measure its stability, by the protocol of the package."""

import hashlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import gcd

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneWarning
from brushgs.measure.box_events import (
    SPIN,
    Events,
    off_axis_share,
    orientation_events,
    worst_shortfall,
)
from brushgs.measure.flow import SceneFlow, displacements
from brushgs.measure.likeness import SSIM_SIDE, ssim
from brushgs.measure.marks import MarkFigures, MarkMeter
from brushgs.measure.stability.figures import Figures, Stability
from brushgs.measure.stability.painters import (
    PLAIN,
    Comparison,
    MakePainters,
    MarkPainter,
    Painter,
    StrokePainter,
    all_painters,
    no_painters,
)
from brushgs.measure.stability.pair_errors import PaintedFrame, PairErrors
from brushgs.measure.uiqm import uiqm
from brushgs.measure.warp import View
from brushgs.options.experiments import StabilityConfig
from brushgs.rendering.knots import is_closed
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.moving import MovingScene

# The schedule of a path: which frames are painted and compared, and how long each is kept.


NUM_JUDGED = 12  # frames for SSIM and UIQM: each takes longer than painting a frame


class FrameSchedule:
    """The frames of a path that a `StabilityConfig` needs.

    Args:
        num_frames: see below.
        is_closed: see below.
        config: gaps, and number of comparisons.
        beat: period of hand-made changes in frames, see `Hand.beat`; pairs begin at all of its phases.

    Attributes:
        num_frames: frames of the path; a closed one repeats its first.
        is_closed: whether it does.
        gaps: the gaps that fit on the path, ascending.
        stride: from the first frame of a pair to that of the next.
        last_use: frame -> the last frame that it is compared with.
        painted: the frames that are painted, ascending.
        alone: painted frames that are painted a second time, ascending.
        judged: painted frames whose similarity to the plain picture is measured, ascending.
    """

    def __init__(self, num_frames: int, is_closed: bool, config: StabilityConfig, beat: int = 1) -> None:
        self.num_frames, self.is_closed = num_frames, is_closed
        self.gaps = [gap for gap in config.gaps if gap < num_frames]
        self.stride = -(-(num_frames - 1) // config.pairs)
        while gcd(self.stride, beat) > 1:
            self.stride += 1
        self.last_use: dict[int, int] = {}
        for gap in self.gaps:
            for start in self.starts(gap):
                for index in (start, start + gap):
                    self.last_use[index] = max(self.last_use.get(index, index), start + gap)
        if is_closed:
            self.last_use |= {0: num_frames - 1, num_frames - 1: num_frames - 1}
        self.painted = sorted(self.last_use)
        self.alone = self._spread(config.alone)
        self.judged = self._spread(NUM_JUDGED)

    def _spread(self, num: int) -> list[int]:
        """At most `num` painted frames, evenly distributed."""
        places = np.linspace(0, len(self.painted) - 1, min(num, len(self.painted)))
        return sorted({self.painted[round(place)] for place in places})

    def starts(self, gap: int) -> range:
        """The earlier frames of the pairs at a gap."""
        return range(0, self.num_frames - gap, self.stride)

    def pairs_ending(self, index: int) -> Iterator[tuple[int, int]]:
        """Gap and earlier frame of each pair whose later frame is `index`."""
        for gap in self.gaps:
            if index - gap in self.starts(gap):
                yield gap, index - gap


NOTHING_COMPARED = (
    "no two frames of the path show the same surface, so no flicker could be measured; take smaller steps"
)
NO_FLOW = (
    "stability: rows of this scene do not correspond, and it has no moments from which the flow of its "
    "surface could be estimated; measure a scene whose rows do"
)
TWO_MOMENTS = "stability: a frame that fades into another shows two moments; omit --cross-fade"
UNLOCKED = "off"  # the configuration without a lock, whose paint weights the pixels


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
        config: gaps, and number of comparisons.
        make_extra_painters: adds configurations to those of the report, before `plain`.
        advance: called after each painted frame; see `num_painted_frames`.

    Raises:
        ValueError: if the path has fewer than two views, or views of more than one size; or if rows of a
            moving scene do not correspond, or it cross-fades between moments.
    """
    config = config or StabilityConfig()
    check_cameras(comparison.cameras)
    check_motion(comparison)
    schedule = _schedule(comparison, config)
    num_threads = comparison.options.num_threads
    painters = all_painters(comparison, num_threads, make_extra_painters)
    errors, looks = PairErrors(list(painters)), _Looks(painters, comparison.cameras[0])
    hashes = dict(_paint_all(comparison, painters, schedule, errors, looks, advance))
    equal = _paint_again(comparison, all_painters(comparison, 1, make_extra_painters), schedule, hashes)
    figures = tuple(
        _figures(painter, errors, looks, schedule, comparison.fps, alone_equal=equal[name])
        for name, painter in painters.items()
    )
    if not errors.starts:
        warnings.warn(SceneWarning(NOTHING_COMPARED), stacklevel=2)
    result = Stability(
        schedule.num_frames, schedule.is_closed, schedule.stride, tuple(errors.starts), figures
    )
    return replace(result, advice=advice(result))


def num_painted_frames(comparison: Comparison, config: StabilityConfig) -> int:
    """Number of painted frames of the path."""
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


def check_motion(comparison: Comparison) -> None:
    """Refuse a moving scene whose flow is not known.

    Raises:
        ValueError: if rows of its truth do not correspond, or a frame shows two moments.
    """
    moving, truth = comparison.moving, comparison.truth
    if moving is None:
        return
    if truth is None or (isinstance(truth, MovingScene) and not truth.has_rows):
        raise ValueError(NO_FLOW)
    if moving.film.shares.any():
        raise ValueError(TWO_MOMENTS)


def _schedule(comparison: Comparison, config: StabilityConfig) -> FrameSchedule:
    closes = comparison.moving is None and is_closed(comparison.strokes, comparison.cameras)
    beat = 1 if comparison.by_hand is None else comparison.by_hand[0].beat
    return FrameSchedule(len(comparison.cameras), closes, config, beat)


class _Looks:
    """Sums over single frames and steps between neighbors: marks, UIQM, SSIM."""

    def __init__(self, painters: dict[str, Painter], camera: Camera) -> None:
        size = {"width": camera.width, "height": camera.height}
        self._meters = {
            name: MarkMeter(**size, in_space=not isinstance(painter, MarkPainter))
            for name, painter in painters.items()
            if _lasts(painter) or isinstance(painter, MarkPainter)
        }
        self._is_large = min(size.values()) >= SSIM_SIDE
        self._judged: dict[str, list[tuple[float, float]]] = {name: [] for name in painters}

    def add_marks(
        self, painters: dict[str, Painter], index: int, plain: Array, flow: SceneFlow | None
    ) -> None:
        """Take the marks of a frame."""
        for name, meter in self._meters.items():
            painter = painters[name]
            if isinstance(painter, MarkPainter):
                meter.add(painter.marks(index, plain), flow)
            elif isinstance(painter, StrokePainter):
                meter.add(painter.boxes(index), flow)

    def judge(self, pictures: dict[str, Array]) -> None:
        """Take the pictures of a frame."""
        if self._is_large:
            for name, picture in pictures.items():
                self._judged[name].append((uiqm(picture), ssim(picture, pictures[PLAIN])))

    def marks(self, name: str, fps: float) -> MarkFigures | None:
        """The mark figures of a configuration; None if marks are not known."""
        return self._meters[name].figures(fps) if name in self._meters else None

    def judged(self, name: str) -> tuple[float, float] | tuple[None, None]:
        """Mean UIQM and SSIM of a configuration."""
        if not self._judged[name]:
            return None, None
        lively, alike = np.mean(self._judged[name], axis=0).tolist()
        return lively, alike


def _paint_all(
    comparison: Comparison,
    painters: dict[str, Painter],
    schedule: FrameSchedule,
    errors: PairErrors,
    looks: _Looks,
    advance: Callable[[], None],
) -> Iterator[tuple[int, dict[str, str]]]:
    """Paint the frames of the schedule in order and compare them; hashes of those that are painted again.

    The plain picture is drawn for every frame: marks are measured in each step.
    """
    kept: dict[int, PaintedFrame] = {}
    unlocked, plain_painter = painters[UNLOCKED], painters[PLAIN]
    assert isinstance(unlocked, StrokePainter)
    assert isinstance(plain_painter, StrokePainter)
    before: Array | None = None  # means of the plain scene in the frame before
    for index, camera in enumerate(comparison.cameras):
        scene = plain_painter.strokes_at(index)
        plain = plain_painter.paint(index)
        picture = _picture(comparison, plain)
        view = View(picture, _depth(plain), plain.alpha, camera)
        step = None
        if before is not None and comparison.moving is not None:
            means = comparison.earlier_means(index - 1, index, before)
            step = displacements(scene, means, camera, num_threads=comparison.options.num_threads)
        flow = SceneFlow(comparison.cameras[index - 1], view, step) if index else None
        looks.add_marks(painters, index, picture, flow)
        before = scene.means
        if index not in schedule.last_use:
            continue
        frames = _paint_frame(painters, index, plain, picture)
        kept[index] = now = _painted_frame(comparison, frames, view, unlocked.boxes(index), before)
        for gap, start in schedule.pairs_ending(index):
            weights, moved = None, step
            if gap == 1:
                weights = _turning_share(kept[start].unlocked, now.unlocked, unlocked, camera)
            elif (earlier := kept[start].means) is not None:
                threads = comparison.options.num_threads
                means = comparison.earlier_means(start, index, earlier)
                moved = displacements(scene, means, camera, num_threads=threads)
            errors.add_pair(gap, start, kept[start], now, weights, moved)
        if schedule.is_closed and index == schedule.num_frames - 1:
            errors.add_loop(kept[0], now)
        if index in schedule.judged:
            looks.judge(now.pictures)
        if index in schedule.alone:
            yield index, {name: _hash(frame) for name, frame in frames.items()}
        kept = {i: frame for i, frame in kept.items() if schedule.last_use[i] > index}
        advance()


def _picture(comparison: Comparison, frame: Frame) -> Array:
    return np.clip(frame.over(comparison.background), 0, 1)


def _depth(frame: Frame) -> Array:
    assert frame.depth is not None, "the plain picture has a depth"
    return frame.depth


def _paint_frame(painters: dict[str, Painter], index: int, plain: Frame, picture: Array) -> dict[str, Frame]:
    """One frame in every configuration; some start from the plain picture."""
    frames = {name: painter.paint(index, picture) for name, painter in painters.items() if name != PLAIN}
    return frames | {PLAIN: plain}


def _painted_frame(
    comparison: Comparison, frames: dict[str, Frame], view: View, unlocked: Boxes, means: Array
) -> PaintedFrame:
    pictures = {name: _picture(comparison, frame) for name, frame in frames.items()}
    return PaintedFrame(pictures, view, unlocked, None if comparison.moving is None else means)


def _turning_share(before: Boxes, now: Boxes, painter: StrokePainter, camera: Camera) -> Array:
    """[H, W] share of the paint of each pixel in strokes whose direction turns, 0 to 1."""
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
    """Number of frames of each configuration that are equal when painted alone, in reverse order."""
    equal = dict.fromkeys(painters, 0)
    plain_painter = painters[PLAIN]
    assert isinstance(plain_painter, StrokePainter)
    for index in reversed(schedule.alone):
        plain = plain_painter.paint(index)
        for name, frame in _paint_frame(painters, index, plain, _picture(comparison, plain)).items():
            equal[name] += _hash(frame) == hashes[index][name]
    return equal


def _hash(frame: Frame) -> str:
    return hashlib.sha256(frame.rgb.tobytes() + frame.alpha.tobytes()).hexdigest()


def _lasts(painter: Painter) -> bool:
    """Whether it paints strokes in space, which persist from frame to frame."""
    return isinstance(painter, StrokePainter) and painter.name != PLAIN


def _figures(
    painter: Painter,
    errors: PairErrors,
    looks: _Looks,
    schedule: FrameSchedule,
    fps: float,
    *,
    alone_equal: int,
) -> Figures:
    """All figures of a configuration."""
    name = painter.name
    lasting = painter if isinstance(painter, StrokePainter) and _lasts(painter) else None
    lively, alike = looks.judged(name)
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
        animation=looks.marks(name, fps),
        uiqm=lively,
        ssim=alike,
    )


def _events(painter: StrokePainter) -> Events:
    boxes, ellipses = _boxes_and_ellipses(painter)
    camera = painter.cameras[0]
    return orientation_events(boxes, width=camera.width, height=camera.height, ellipses=ellipses)


def _boxes_and_ellipses(painter: StrokePainter) -> tuple[Iterator[Boxes], Iterator[Boxes]]:
    """The boxes of all frames and those of their ellipses, projected again to save memory."""
    return painter.all_boxes(), painter.all_boxes("off")


# One line of advice on the lock for a path, from its figures.


LOCKS = "track", "anchor", "off"  # differ only in their lock; the first wins a tie
IS_DEFAULT = {LOCKS[0]: " (the default)"}  # of `render` along a path
COARSE = 0.01  # share of the painted area that turns or jumps in a frame: above it smaller steps are advised


def advice(result: Stability) -> str:
    """The steadiest lock and its lead: "for this path --lock track (the default) is steadiest: ...".

    Locks are compared by the share of the painted area in strokes that flip, spin or pop from frame to frame.
    """
    locks = [result[name] for name in LOCKS]
    if all(figures.events == locks[0].events for figures in locks):
        return "for this path every lock draws the same strokes: none of them has a direction to hold"
    best = min(locks, key=_unsteady)
    others = " and ".join(f"{_unsteady(other):.2%} with {other.name}" for other in locks if other is not best)
    name = f"{best.name}{IS_DEFAULT.get(best.name, '')}"
    line = (
        f"for this path --lock {name} is steadiest: {_unsteady(best):.2%} of the painted area turns or "
        f"jumps in a frame, {others}"
    )
    if best.warps:
        excess = max(0.0, 255 * best.warps[0].excess)
        line += f"; it flickers by {excess:.1f} of 255 more than the plain picture"
    if _unsteady(best) > COARSE:
        line += "; smaller steps of the camera (more frames) would be steadier"
    return line


def _unsteady(figures: Figures) -> float:
    """Share of the painted area in strokes that change abruptly from a frame to the next."""
    events = figures.events
    assert events is not None, "strokes in space have events"
    return events.flip_share + events.spin_share + events.pop_share
