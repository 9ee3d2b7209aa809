"""A path is painted in every configuration, and what moves is measured, by the protocol in the package."""

import hashlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

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
from brushgs.measure.stability.figures import Figures, Loop, Stability, Turning, Warp
from brushgs.measure.stability.painters import Comparison, ImagePainter, StrokePainter
from brushgs.measure.warp import View, ViewMatch, WarpError, match_views
from brushgs.options.choices import Filter
from brushgs.options.experiments import StabilityConfig
from brushgs.scene import Boxes, Camera, Frame

PLAIN = "plain"
NOTHING_COMPARED = (
    "no two frames of the path show the same surface, so no flicker could be measured; take smaller steps"
)
TURNED_AS = "off"  # the configuration whose strokes turn unlocked, and whose picture weighs pixels by it


def measure_stability(
    comparison: Comparison,
    config: StabilityConfig | None = None,
    *,
    advance: Callable[[], None] = lambda: None,
) -> Stability:
    """Paint a path in every configuration and measure how still it holds.

    Args:
        comparison: scene, strokes, path and stroke.
        config: gaps, and how much is compared.
        advance: called after each painted frame; `painted_frames` says how many there are.

    Raises:
        ValueError: if the path has fewer than two views, or views of more than one size.
    """
    config = config or StabilityConfig()
    check_cameras(comparison.cameras)
    plan = _Plan(len(comparison.cameras), is_closed(comparison.cameras), config)
    painters = comparison.painters(comparison.options.num_threads)
    tally = _Tally(list(painters))
    hashes = dict(_paint_all(comparison, painters, plan, tally, advance))
    equal = _drawn_again(comparison, plan, hashes)
    configurations = []
    for name, painter in painters.items():
        figures = _figures(painter, tally, plan)
        configurations.append(replace(figures, alone=len(plan.alone), alone_equal=equal[name]))
    if not tally.starts:
        warnings.warn(SceneWarning(NOTHING_COMPARED), stacklevel=2)
    return Stability(plan.num_frames, plan.is_closed, plan.stride, tuple(tally.starts), tuple(configurations))


def painted_frames(cameras: Sequence[Camera], config: StabilityConfig) -> int:
    """How many frames of a path are painted."""
    return len(_Plan(len(cameras), is_closed(cameras), config).painted)


def is_closed(cameras: Sequence[Camera]) -> bool:
    """Whether a path ends where it begins."""
    first, last = cameras[0], cameras[-1]
    return (
        len(cameras) > 2 and np.array_equal(first.viewmat, last.viewmat) and np.array_equal(first.K, last.K)
    )


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


class _Plan:
    """Which frames are painted, and how long each is kept."""

    def __init__(self, num_frames: int, is_loop: bool, config: StabilityConfig) -> None:
        self.num_frames, self.is_closed = num_frames, is_loop
        self.gaps = [gap for gap in config.gaps if gap < num_frames]
        self.stride = -(-(num_frames - 1) // config.pairs)
        self.last_use: dict[int, int] = {}  # frame -> the last one painted that it is compared with
        for gap in self.gaps:
            for start in self.starts(gap):
                for index in (start, start + gap):
                    self.last_use[index] = max(self.last_use.get(index, index), start + gap)
        if is_loop:
            self.last_use |= {0: num_frames - 1, num_frames - 1: num_frames - 1}
        self.painted = sorted(self.last_use)
        places = np.linspace(0, len(self.painted) - 1, min(config.alone, len(self.painted)))
        self.alone = sorted({self.painted[round(place)] for place in places})

    def starts(self, gap: int) -> range:
        """The earlier frames of the pairs at a gap."""
        return range(0, self.num_frames - gap, self.stride)

    def pairs_ending(self, index: int) -> Iterator[tuple[int, int]]:
        """Gap and earlier frame of each pair whose later frame this is."""
        for gap in self.gaps:
            if index - gap in self.starts(gap):
                yield gap, index - gap


@dataclass
class _Shot:
    """One frame in every configuration, on its ground, and what the plain picture says of depth."""

    pictures: dict[str, Array]  # [H, W, 3] by name
    view: View  # of the plain picture
    unlocked: Boxes


def _marks(match: ViewMatch, first: _Shot, second: _Shot, name: str) -> tuple[float, float]:
    """What strokes add to the plain picture over valid pixels: RMS, and the part that is redrawn."""
    before, now = (shot.pictures[name] - shot.pictures[PLAIN] for shot in (first, second))
    moved, here = match.moved(before).astype(np.float64), now.reshape(-1, 3)[match.pixels].astype(np.float64)
    power = float((moved**2 + here**2).sum())
    changed = float(((here - moved) ** 2).sum())
    return float(np.sqrt((here**2).mean())), float(np.sqrt(changed / power)) if power > 0 else 0.0


@dataclass
class _Tally:
    """What was found so far, by configuration."""

    names: list[str]
    errors: dict[str, dict[int, list[WarpError]]] = field(default_factory=dict)  # by gap
    marks: dict[str, dict[int, list[tuple[float, float]]]] = field(
        default_factory=dict
    )  # and the redrawn part
    turned: dict[str, float] = field(default_factory=dict)  # sum of weight x squared error
    turned_weight: float = 0.0
    starts: list[int] = field(default_factory=list)  # of the pairs at gap 1
    loops: dict[str, Loop] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.errors = {name: {} for name in self.names}
        self.marks = {name: {} for name in self.names}
        self.turned = dict.fromkeys(self.names, 0.0)

    def add_pair(self, gap: int, start: int, first: _Shot, second: _Shot, weights: Array | None) -> None:
        """Compare two frames, if they have anything in common; at gap 1 with weights [H, W], too."""
        match = match_views(first.view, second.view)
        if not len(match.pixels):
            return
        if gap == 1:
            self.starts.append(start)
        valid = weights.reshape(-1)[match.pixels].astype(np.float64) if weights is not None else None
        for name in self.names:
            error = match.error(first.pictures[name], second.pictures[name], keep_map=valid is not None)
            if valid is not None and error.squared_error is not None:
                self.turned[name] += float(valid @ error.squared_error.reshape(-1)[match.pixels])
            self.errors[name].setdefault(gap, []).append(replace(error, squared_error=None))
            self.marks[name].setdefault(gap, []).append(_marks(match, first, second, name))
        if valid is not None:
            self.turned_weight += float(valid.sum())

    def add_loop(self, first: _Shot, last: _Shot) -> None:
        """Compare the ends of a closed path."""
        for name in self.names:
            difference = last.pictures[name].astype(np.float64) - first.pictures[name]
            rmse = float(np.sqrt(np.mean(difference**2)))
            self.loops[name] = Loop(rmse, float(np.abs(difference).max()))

    def warps(self, name: str) -> tuple[Warp, ...]:
        """Means over the pairs of each gap."""
        return tuple(self._warp(name, gap) for gap in sorted(self.errors[name]))

    def _warp(self, name: str, gap: int) -> Warp:
        own, plain = (
            np.array([(e.rmse, e.worst_1pct, e.valid_share) for e in self.errors[which][gap]])
            for which in (name, PLAIN)
        )
        rmse, worst, share = own.mean(axis=0).tolist()
        excess, excess_worst, _ = (own - plain).mean(axis=0).tolist()
        marks, redrawn = np.mean(self.marks[name][gap], axis=0).tolist()
        return Warp(
            gap,
            len(own),
            rmse,
            worst,
            share,
            excess,
            excess_worst,
            marks,
            redrawn if marks > 0 else None,
        )

    def turning(self, name: str) -> Turning | None:
        """None where no stroke that turns was seen."""
        if not self.turned_weight > 0:
            return None
        rmse, plain = (float(np.sqrt(self.turned[which] / self.turned_weight)) for which in (name, PLAIN))
        return Turning(rmse, rmse - plain)


def _paint_all(
    comparison: Comparison,
    painters: dict[str, StrokePainter | ImagePainter],
    plan: _Plan,
    tally: _Tally,
    advance: Callable[[], None],
) -> Iterator[tuple[int, dict[str, str]]]:
    """Paint the frames of the plan in order and compare them; hashes of those that are drawn again later."""
    kept: dict[int, _Shot] = {}
    unlocked = painters[TURNED_AS]
    assert isinstance(unlocked, StrokePainter)
    for index in plan.painted:
        frames = _painted(comparison, painters, index)
        kept[index] = shot = _shot(comparison, frames, comparison.cameras[index], unlocked.boxes(index))
        for gap, start in plan.pairs_ending(index):
            weights = None
            if gap == 1:
                before = kept[start].unlocked
                weights = _turning_share(before, shot.unlocked, unlocked, comparison.cameras[index])
            tally.add_pair(gap, start, kept[start], shot, weights)
        if plan.is_closed and index == plan.num_frames - 1:
            tally.add_loop(kept[0], shot)
        if index in plan.alone:
            yield index, {name: _hash(frame) for name, frame in frames.items()}
        kept = {i: other for i, other in kept.items() if plan.last_use[i] > index}
        advance()


def _painted(
    comparison: Comparison, painters: dict[str, StrokePainter | ImagePainter], index: int
) -> dict[str, Frame]:
    """One frame in every configuration. The plain picture comes first: another one starts from it."""
    plain = painters[PLAIN].paint(index)
    seen = np.clip(plain.over(comparison.ground), 0, 1)
    frames = {name: painter.paint(index, seen) for name, painter in painters.items() if name != PLAIN}
    return frames | {PLAIN: plain}


def _shot(comparison: Comparison, frames: dict[str, Frame], camera: Camera, unlocked: Boxes) -> _Shot:
    pictures = {name: np.clip(frame.over(comparison.ground), 0, 1) for name, frame in frames.items()}
    plain = frames[PLAIN]
    assert plain.depth is not None
    return _Shot(pictures, View(pictures[PLAIN], plain.depth, plain.alpha, camera), unlocked)


def _turning_share(before: Boxes, now: Boxes, painter: StrokePainter, camera: Camera) -> Array:
    """[H, W] share of the paint of each pixel that is of strokes whose direction turns, 0 to 1."""
    _, i, j = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
    turn = now.angles[j].astype(np.float64) - before.angles[i]
    is_turning: NDArray[np.bool_] = np.zeros(len(now), np.bool_)
    is_turning[j] = np.abs(np.remainder(turn + np.pi, 2 * np.pi) - np.pi) > SPIN
    white = np.repeat(is_turning[:, None], 3, axis=1).astype(now.colors.dtype)
    return painter.draw(replace(now, colors=white), camera).rgb[..., 0]


def _drawn_again(comparison: Comparison, plan: _Plan, hashes: dict[int, dict[str, str]]) -> dict[str, int]:
    """How many frames of each configuration come out the same when each is drawn alone."""
    painters = comparison.painters(1)
    equal = dict.fromkeys(painters, 0)
    for index in reversed(plan.alone):
        for name, frame in _painted(comparison, painters, index).items():
            equal[name] += _hash(frame) == hashes[index][name]
    return equal


def _hash(frame: Frame) -> str:
    return hashlib.sha256(frame.rgb.tobytes() + frame.alpha.tobytes()).hexdigest()


def _figures(painter: StrokePainter | ImagePainter, tally: _Tally, plan: _Plan) -> Figures:
    """All figures of a configuration but for the frames that are drawn again."""
    name = painter.name
    strokes = painter if isinstance(painter, StrokePainter) and name != PLAIN else None
    return Figures(
        name=name,
        what=painter.what,
        strokes=len(painter.gaussians) if isinstance(painter, StrokePainter) else painter.num_strokes,
        lock=str(strokes.options.lock) if strokes else None,
        filter=_filter_of(painter),
        order=strokes.options.order if strokes else None,
        num_sigmas=painter.options.num_sigmas if isinstance(painter, StrokePainter) else None,
        events=_events(strokes) if strokes else None,
        off_axis_share=off_axis_share(*_beside_ellipses(strokes)) if strokes else None,
        shortfall=worst_shortfall(*_beside_ellipses(strokes)) if strokes else None,
        warps=tally.warps(name),
        turning=tally.turning(name),
        loop=tally.loops.get(name),
        alone=0,
        alone_equal=0,
        seconds=painter.clock.per_frame(plan.num_frames),
        errors=tuple(error.rmse for error in tally.errors[name].get(1, [])),
    )


def _filter_of(painter: StrokePainter | ImagePainter) -> Filter | None:
    """The texture filter; None for the plain picture, whose kernel is computed."""
    if isinstance(painter, ImagePainter):
        return painter.filter
    return painter.options.filter if painter.name != PLAIN else None


def _events(painter: StrokePainter) -> Events:
    boxes, ellipses = _beside_ellipses(painter)
    camera = painter.cameras[0]
    return orientation_events(boxes, width=camera.width, height=camera.height, ellipses=ellipses)


def _beside_ellipses(painter: StrokePainter) -> tuple[Iterator[Boxes], Iterator[Boxes]]:
    """The boxes of all frames, and the ellipses behind them: made again each time, so that none is held."""
    return painter.all_boxes(), painter.all_boxes("off")
