"""A moving scene: Gaussians as a function of time, made on demand."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from brushgs.values.arrays import F64, Mask
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.notes import LoadNotes


@dataclass(frozen=True, eq=False)
class MovingScene:
    """Gaussians over time.

    Scenes are streamed: `at` makes the Gaussians of one moment, and at most three moments are in memory.

    Attributes:
        duration: seconds, >= 0; times are 0 to `duration`. If `times` end earlier, the last moment is held.
        has_rows: whether row i is the same Gaussian at all times; then every moment has the same N rows.
        sample: makes the Gaussians of a time in range, for `at`.
        times: [F] seconds, ascending: sample times of the file; None for a continuous scene (a formula).
        resting: [N] mask of rows that never change; None if unknown or rows do not correspond.
        notes: what the files hold beside Gaussians; None for a scene made in memory.

    Raises:
        ValueError: if the duration is negative or not finite.
    """

    duration: float
    has_rows: bool
    sample: Callable[[float], Gaussians] = field(repr=False)
    times: F64 | None = None
    resting: Mask | None = None
    notes: "LoadNotes | None" = None

    def __post_init__(self) -> None:
        if not 0 <= self.duration < inf:
            raise ValueError(f"MovingScene: duration must be 0 or more seconds, got {self.duration:g}")

    def __repr__(self) -> str:
        facts = [f"{self.duration:.4g} s"]
        facts += ["any moment"] if self.times is None else [f"{len(self.times):,} moments"]
        facts += ["rows correspond"] if self.has_rows else []
        if self.resting is not None and len(self.resting):
            facts += [f"{self.resting.mean():.0%} of {len(self.resting):,} rest"]
        return f"MovingScene({', '.join(facts)})"

    def at(self, time: float) -> Gaussians:
        """The Gaussians of one moment; times are clamped to 0 to `duration`.

        Args:
            time: seconds.

        Raises:
            ValueError: if it is not a number.
            SceneError: if a file of it cannot be read.

        Example:
            >>> from brushgs.still_life.moving import still_life_moving
            >>> scene = still_life_moving(2000, seconds=2)
            >>> scene
            MovingScene(2 s, any moment, rows correspond, ...)
            >>> scene.at(0.5)
            Gaussians(..., SH 3)
        """
        if time != time:  # NaN
            raise ValueError("MovingScene: time must be a number of seconds, got nan")
        return self.sample(min(max(float(time), 0.0), self.duration))
