"""A film of a moving scene: which moment of it each frame shows."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from math import ceil

import numpy as np

from brushgs.options.choices import CLIP_FPS, MOMENTS_PER_SECOND
from brushgs.options.clip import ClipConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.sequence import MAX_FRAMES
from brushgs.values.arrays import F64, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

NUM_SAMPLED = 12  # moments of a clip that show how its rows move
FULL_SHARE = 0.5  # of the opacity of the fullest moment, enough to show how the scene looks
SAME_MOMENT = 1e-6  # seconds: closer moments are the same
ROUNDING = 1e-6  # of a frame: a smaller excess adds no frame


@dataclass(frozen=True, eq=False)
class Film:
    """The moment of a moving scene that each frame shows.

    Attributes:
        times: [F] seconds of the scene.
        others: [F] seconds of the scene that a frame cross-fades into.
        shares: [F] progress of the cross-fade, 0 to 1.
        fps: frames a second.
        is_loop: whether the frame after the last is the first again.
    """

    times: F64
    others: F64
    shares: F64
    fps: float
    is_loop: bool

    @property
    def moments(self) -> F64:
        """[T] all times that frames show, ascending, without duplicates."""
        return np.unique(np.concatenate([self.times, self.others[self.shares > 0]]))

    def moment(self, frame: int) -> tuple[float, float, float]:
        """A key that is equal for frames with the same content."""
        return float(self.times[frame]), float(self.others[frame]), float(self.shares[frame])

    def runs(self) -> "list[Run]":
        """Sequences without a jump in time: the whole film, or each pass of a loop that cross-fades.

        A pass begins in the frames in which the previous pass fades.
        """
        if not self.shares.any():
            return [Run(np.arange(len(self.times)), self.times, 0)]
        starts = [0, *(np.flatnonzero(np.diff(self.times) < 0) + 1), len(self.times)]
        turns = [np.arange(start, end) for start, end in pairwise(starts)]
        ends = [turn[self.shares[turn] > 0] for turn in turns]
        # A looping film begins where its last pass ends; any other may end while it fades.
        before = [ends[-1] if self.is_loop else ends[-1][:0], *ends[:-1]]
        after = [] if self.is_loop else [(ends[-1], turns[-1][:0])]
        runs = []
        for fading, turn in [*zip(before, turns, strict=True), *after]:
            times = np.concatenate([self.others[fading], self.times[turn]])
            if len(times):
                runs.append(Run(np.concatenate([fading, turn]), times, len(fading)))
        return runs


@dataclass(frozen=True, eq=False)
class Run:
    """Frames without a jump in time between them.

    Attributes:
        frames: [n] frame numbers: first the fading frames, then the others, ascending.
        times: [n] seconds of the scene.
        num_fading: number of leading frames that the previous pass cross-fades into.
    """

    frames: Rows
    times: F64
    num_fading: int


@dataclass(frozen=True, eq=False)
class Clip:
    """A moving scene, and which part of it is shown.

    Attributes:
        scene: the moving scene.
        config: see `ClipConfig`.
        source: its files; None for a scene in memory.
    """

    scene: MovingScene
    config: ClipConfig = field(default_factory=ClipConfig)
    source: SceneSource | None = None

    @property
    def name(self) -> str:
        """Of the scene, for messages."""
        return "the scene" if self.source is None else str(self.source)

    def film(self, *, fps: float | None = None, num_frames: int | None = None) -> Film:
        """The moment of each frame.

        Args:
            fps: frames a second, > 0; None for the rate of the options, or 30.
            num_frames: of a camera path, >= 1: if it is longer than the clip, the scene stops at its end, or
                repeats if it loops; None for as many as the clip has.

        Raises:
            ValueError: if the part of the scene is empty, or has too many frames.
        """
        first, last = self.ends()
        config = self.config
        rate = fps or config.fps or CLIP_FPS
        step, length = config.speed / rate, last - first
        fade = config.cross_fade or 0.0
        held = self._held(last)
        if not fade <= length / 2:
            raise ValueError(f"cross-fade must be at most half of the {length:g} s shown, got {fade:g} s")
        shown = length - fade
        if config.loop and not fade:
            shown = max(0.0, shown - held)  # it turns at the last moment without stopping
        steps = shown / step
        if steps > MAX_FRAMES:
            raise ValueError(
                f"{shown:g} s of the scene are {ceil(steps):,} frames at fps {rate:g} and speed "
                f"{config.speed:g}, and at most {MAX_FRAMES:,} can be painted; show less of it, --end"
            )
        if not config.loop:
            num = int(steps + ROUNDING) + 1
            if held:  # whole frames up to the end, which is no moment itself
                num = max(1, round(steps))
                step = length / num
            times = first + np.minimum(np.arange(num_frames or num) * step, length)
            return Film(times, times, np.zeros(len(times)), rate, is_loop=False)
        if not steps > 0:  # a single moment
            times = np.full(num_frames or 1, first)
            return Film(times, times, np.zeros(len(times)), rate, is_loop=True)
        whole = max(1, round(steps))
        if not fade:
            period = 2 * whole
            num = num_frames or period
            at = np.arange(num) % period
            times = first + np.minimum(np.minimum(at, period - at) * (shown / whole), length)
            return Film(times, times, np.zeros(num), rate, is_loop=num % period == 0)
        num = num_frames or whole
        times = np.asarray(first + fade + (np.arange(num) % whole) * (shown / whole), np.float64)
        shares = np.clip((times - (last - fade)) / fade, 0, 1)
        shares[shares < ROUNDING] = 0
        others = np.where(shares > 0, times - shown, times)
        return Film(times, others, shares, rate, is_loop=num % whole == 0)

    def _held(self, last: float) -> float:
        """Duration of the last moment in seconds, if all are shown; 0 if the clip ends with it."""
        duration, times = self.scene.duration, self.scene.times
        if times is None or not len(times) or last < duration or duration <= times[-1] * (1 + ROUNDING):
            return 0.0
        return float(duration - times[-1])

    def sampled(self) -> F64:
        """A few moments of the shown part, from first to last, without duplicates."""
        return np.unique(np.linspace(*self.ends(), NUM_SAMPLED))

    def moments(self) -> Iterator[Gaussians]:
        """The Gaussians of each sampled moment that is not empty, made on demand."""
        for time in self.sampled():
            gaussians = self.scene.at(float(time))
            if gaussians.opacities.any():
                yield gaussians

    def first_seen(self) -> Gaussians:
        """The Gaussians of the first sampled moment with at least half the opacity of the fullest.

        Raises:
            ValueError: if all are empty.
        """
        weights = [float(gaussians.opacities.sum(dtype=np.float64)) for gaussians in self.moments()]
        if not weights:
            raise ValueError(
                f"{self.name} shows nothing between its start and its end; show another part of it"
            )
        first = int(np.argmax(np.array(weights) >= FULL_SHARE * max(weights)))
        return next(islice(self.moments(), first, None))

    def file_times(self) -> F64 | None:
        """The moments in the files within the shown part, plus one on either side; None for a formula.

        [T] seconds, ascending.
        """
        times = self.scene.times
        if times is None or len(times) == 0:
            return None
        first, last = self.ends()
        start = np.searchsorted(times, first + SAME_MOMENT, side="right") - 1
        stop = np.searchsorted(times, last - SAME_MOMENT) + 1
        return np.asarray(times[max(int(start), 0) : int(stop)])

    def ends(self) -> tuple[float, float]:
        """The first and the last shown moment, seconds.

        Raises:
            ValueError: if the scene does not have them.
        """
        duration, config = self.scene.duration, self.config
        first = 0.0 if config.start is None else config.start.seconds(duration)
        last = duration if config.end is None else config.end.seconds(duration)
        for name, time in (("start", first), ("end", last)):
            if time > duration * (1 + ROUNDING):
                raise ValueError(f"{name} must be in the {duration:g} s of {self.name}, got {time:g} s")
        if last < first:
            raise ValueError(f"end must not be before start, got {last:g} s and {first:g} s")
        return min(first, duration), min(last, duration)


def as_files(scene: SceneFiles | Clip) -> SceneFiles | Clip:
    """The scene for writing strokes, one file per moment: a clip at the rate of its files, else 24.

    So there is one output file per input file, of the same duration. A rate in its options is kept.
    """
    if not isinstance(scene, Clip) or scene.config.fps is not None:
        return scene
    notes = scene.scene.notes
    rate = None if notes is None else notes.moments_per_second
    return replace(scene, config=replace(scene.config, fps=rate or MOMENTS_PER_SECOND))


def files_of(scene: SceneFiles | Clip) -> SceneFiles | None:
    """The files of a scene, or of a clip; None for a clip in memory."""
    return scene.source if isinstance(scene, Clip) else scene
