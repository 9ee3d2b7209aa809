"""Options of a film of a moving scene: part, speed, rate and looping."""

from typing import Annotated, ClassVar

from brushgs.options.moment import Moment, clip_time, moment_value
from brushgs.options.sequence import MAX_FPS
from brushgs.options.table import OF_FILMS, Options, in_files, option


class ClipConfig(Options, frozen=True):
    """Start, end, speed and looping of a film of a moving scene."""

    GROUP: ClassVar = "clip"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    ABOUT: ClassVar = "a film of a moving scene"
    # fmt: off
    start: Annotated[Moment | None, option("a moment, in seconds such as 0.4 or as a share such as 40%",
        default="that of the scene", metavar="TIME", read=clip_time, make=moment_value)] = None
    end: Annotated[Moment | None, option("a moment, in seconds such as 0.4 or as a share such as 40%, not "
        "before the start", default="that of the scene", metavar="TIME", read=clip_time, make=moment_value
    )] = None
    speed: Annotated[float, option("scene seconds per film second #slow #motion #fast", gt=0
    )] = 1.0
    fps: Annotated[float | None, in_files("frames per second, unless the camera path has its own; None: 30",
        gt=0, le=MAX_FPS)] = None
    loop: Annotated[bool, in_files("make the film loop: the scene runs forward and back"
    )] = False
    cross_fade: Annotated[float | None, option("with --loop: fade the end into the beginning over this many "
        "seconds of the scene", gt=0, unit="seconds", default="none: the scene runs back instead",
        metavar="SECONDS")] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cross_fade is not None and not self.loop:
            raise ValueError("cross-fade needs loop: it is how the end of a loop meets its beginning")
