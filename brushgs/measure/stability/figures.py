"""The figures of the temporal report, and their JSON."""

from dataclasses import asdict, dataclass
from math import degrees
from typing import Any

from brushgs.measure.box_events import Events
from brushgs.measure.marks import MarkFigures

# Version of the JSON; increases when a key changes its name or meaning. Version 2 removed the configuration
# `image` and replaced `left_out` of a stage by `skipped`. Version 3 added `animation`, `uiqm` and `ssim`, and
# changed the configurations of moving scenes.
SCHEMA = 3


@dataclass(frozen=True)
class Warp:
    """Flicker at one gap, each figure the mean over the pairs; step 4 of the protocol.

    Attributes:
        gap: frames between the two pictures of a pair.
        pairs: number of compared pairs.
        rmse: 0 to 1.
        worst_1pct: RMSE over the worst 1 % of the valid pixels, 0 to 1.
        valid_share: of the pixels, 0 to 1.
        excess: `rmse` minus that of the plain picture.
        excess_worst_1pct: `worst_1pct` minus that of the plain picture.
        marks: RMS of what the strokes add to the plain picture, 0 to 1.
        redrawn: share of these marks that does not move with the scene: 0 for none, 1 if each frame has new
            marks; None without marks.
    """

    gap: int
    pairs: int
    rmse: float
    worst_1pct: float
    valid_share: float
    excess: float
    excess_worst_1pct: float
    marks: float
    redrawn: float | None


@dataclass(frozen=True)
class Turning:
    """Flicker where unlocked strokes turn; step 5 of the protocol."""

    rmse: float
    excess: float


@dataclass(frozen=True)
class Loop:
    """The difference of the last picture of a closed path and the first, 0 to 1."""

    rmse: float
    largest: float


@dataclass(frozen=True)
class Seconds:
    """Wall-clock seconds per frame."""

    track: float
    project: float
    draw: float


@dataclass(frozen=True)
class Figures:
    """All figures of one configuration; None where a figure does not apply.

    Attributes:
        name: of the configuration, see step 2 of the protocol.
        what: the same in words.
        strokes: number of strokes, at most.
        lock: how directions are chosen.
        filter: how the stroke image is sampled.
        order: "depth" or "soft".
        num_sigmas: half extent of a box in standard deviations; the mean of several brushes.
        events: flips, spins, size pops and so on.
        off_axis_share: share of slender stroke-frames that are off both axes.
        shortfall: of the worst box, as a share of the reach of its ellipse; 0 or less if every box covers
            its ellipse.
        warps: one per gap at which a pair has valid pixels, ascending.
        turning: flicker where unlocked strokes turn.
        loop: None on an open path.
        alone: number of frames that were painted a second time, alone.
        alone_equal: how many of them were equal, byte for byte.
        seconds: per frame.
        errors: RMSE at gap 1 of each pair, in the order of the path.
        animation: flatness, coherence and continuity; step 8 of the protocol.
        uiqm: see `brushgs.measure.uiqm`, the mean over some frames; None for pictures that are too small.
        ssim: to the plain picture, the mean over the same frames.
    """

    name: str
    what: str
    strokes: int
    lock: str | None
    filter: str | None
    order: str | None
    num_sigmas: float | None
    events: Events | None
    off_axis_share: float | None
    shortfall: float | None
    warps: tuple[Warp, ...]
    turning: Turning | None
    loop: Loop | None
    alone: int
    alone_equal: int
    seconds: Seconds
    errors: tuple[float, ...]
    animation: MarkFigures | None
    uiqm: float | None
    ssim: float | None

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; angles in degrees."""
        value = asdict(self)
        if self.events is not None:
            value["events"]["largest_step_deg"] = degrees(value["events"].pop("largest_step"))
        if self.animation is not None:
            drift = value["animation"].pop("direction_drift")
            value["animation"]["direction_drift_deg"] = degrees(drift)
        return value


@dataclass(frozen=True)
class Stability:
    """The figures of all configurations.

    Attributes:
        num_frames: frames of the path; a closed one repeats its first.
        is_closed: whether it does.
        stride: from the first frame of a pair to that of the next.
        starts: number of the earlier frame of each pair at gap 1 that has valid pixels.
        configurations: one per configuration, in the order of the table.
        advice: one line: which lock is steadiest.
    """

    num_frames: int
    is_closed: bool
    stride: int
    starts: tuple[int, ...]
    configurations: tuple[Figures, ...]
    advice: str = ""

    def __getitem__(self, name: str) -> Figures:
        return next(figures for figures in self.configurations if figures.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "frames": self.num_frames,
            "closed": self.is_closed,
            "stride": self.stride,
            "starts": list(self.starts),
            "configurations": [figures.as_dict() for figures in self.configurations],
            "advice": self.advice,
        }
