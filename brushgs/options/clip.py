"""Options of a film of a moving scene: which part of it is shown, how fast, and whether it loops."""

from dataclasses import dataclass
from math import inf

from brushgs.options.choices import check_above_0
from brushgs.options.moment import Moment
from brushgs.options.sequence import check_fps


@dataclass(frozen=True)
class ClipConfig:
    """Which moments of a moving scene a film shows.

    Attributes:
        start: the first; None for that of the scene.
        end: the last, not before the first; None for that of the scene.
        speed: seconds of the scene in a second of the film, > 0.
        fps: frames a second where no camera path has its own, in (0, 1000]; None for 30.
        loop: whether the film can be repeated: the scene then runs there and back.
        cross_fade: seconds of the scene in which the end of a loop fades into its beginning, above 0, in
            place of running back; None for there and back.
    """

    start: Moment | None = None
    end: Moment | None = None
    speed: float = 1.0
    fps: float | None = None
    loop: bool = False
    cross_fade: float | None = None

    def __post_init__(self) -> None:
        check_above_0("speed", self.speed)
        check_fps(self.fps)
        if self.cross_fade is not None and not 0 < self.cross_fade < inf:
            raise ValueError(f"cross-fade must be above 0 seconds, got {self.cross_fade:g}")
        if self.cross_fade is not None and not self.loop:
            raise ValueError("cross-fade needs loop: it is how the end of a loop meets its beginning")
