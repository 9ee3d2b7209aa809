"""Options of a film of a moving scene: which part of it is shown, how fast, and whether it loops."""

from typing import Annotated, ClassVar

from brushgs.options.moment import Moment, clip_time, moment_value
from brushgs.options.sequence import MAX_FPS
from brushgs.options.table import OF_FILMS, Options, in_files, option


class ClipConfig(Options, frozen=True):
    """Which moments of a moving scene a film shows."""

    GROUP: ClassVar = "clip"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    ABOUT: ClassVar = "a film of a moving scene"
    # fmt: off
    start: Annotated[Moment | None, option("a moment, in seconds such as 0.4 or as a share such as 40%",
        default="that of the scene", metavar="TIME", read=clip_time, make=moment_value)] = None
    end: Annotated[Moment | None, option("a moment, in seconds such as 0.4 or as a share such as 40%, not "
        "before the start", default="that of the scene", metavar="TIME", read=clip_time, make=moment_value
    )] = None
    speed: Annotated[float, option("seconds of the scene in a second of the film #slow #motion #fast", gt=0
    )] = 1.0
    fps: Annotated[float | None, in_files("frames a second where no camera path has its own; None for 30",
        gt=0, le=MAX_FPS)] = None
    loop: Annotated[bool, in_files("whether the film can be repeated: the scene then runs there and back"
    )] = False
    cross_fade: Annotated[float | None, option("with --loop: the end fades into the beginning in so many "
        "seconds of the scene", gt=0, unit="seconds", default="it runs back instead",
        metavar="SECONDS")] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cross_fade is not None and not self.loop:
            raise ValueError("cross-fade needs loop: it is how the end of a loop meets its beginning")
