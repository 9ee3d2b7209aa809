"""A scene that moves: Gaussians as a function of time, made when they are asked for."""

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

    A scene streams: `at` makes the Gaussians of one moment, and at most three moments are in memory at once.

    Attributes:
        duration: seconds, >= 0; times are 0 to it. Where `times` end before it, the last is shown until then.
        has_rows: whether row i is the same Gaussian at all times: then every moment has the same N rows.
        sample: the Gaussians of a time in range; `at` calls it.
        times: [F] seconds, ascending, of the moments that a file holds; None for a scene that is a formula,
            which has any moment.
        resting: [N] rows that are the same at all times; None where rows do not correspond, or it is not
            known.
        notes: what the files hold beside Gaussians; None for a scene that was made in memory.

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
        """The Gaussians of one moment; before the first and after the last those of the first and the last.

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
