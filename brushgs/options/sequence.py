"""Options of a sequence: the camera path or the growth of a painting, and where frames are painted."""

from pathlib import Path
from typing import Annotated, ClassVar

from msgspec.structs import replace

from brushgs.options.table import OF_FILMS, Options, in_files, option

DEFAULT_FPS = 24.0  # the rate of film
MAX_FRAMES = 99_999  # over an hour of film; five digits
WORKERS_TIMEOUT = 60.0  # seconds that a Dask scheduler may have no worker: batch systems are slow to start
STANDING_SECONDS, STANDING_SHARE = (
    1.0,
    0.25,
)  # the finished painting is held at the end for the shorter of these; the second is a share of the time
FADE_SECONDS, MOST_FADE = 0.15, 0.1  # fade-in of a stroke, and its largest share of the growing time
MAX_FPS = 1000.0  # more is a typing error, and video formats count milliseconds at the finest


class PathConfig(Options, frozen=True):
    """The camera path: an orbit around the scene, or the views of a file. Give exactly one of `orbit` and
    `file`.

    An orbit is always a loop, even with `sway`. The views of a file are frames or, with `frames` or
    `seconds`, keyframes of a spline at constant speed. Open paths include both ends: `seconds` give
    `seconds * fps + 1` frames, so that doubling the fps keeps every frame. For an animated camera of a glTF
    or USD file, `frames`, `seconds` and `fps` sample its own motion. Loops do not repeat the first frame or
    an equal last view. A file may itself declare a loop.
    """

    GROUP: ClassVar = "path"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    ABOUT: ClassVar = "many frames along a camera path, in place of one picture"
    # fmt: off
    orbit: Annotated[int | None, option("one turn around the up axis in N frames, starting from the framed "
        "view #turn #turntable #rotate #spin #video", ge=3, le=MAX_FRAMES,
        unit="frames", default="one picture", example="120"
    )] = None
    sway: Annotated[float | None, option("with --orbit: not a turn, but a sway by this angle to each side "
        "and back, in N frames #swing #parallax #wiggle #loop", gt=0, le=90, unit="degrees",
        default="a full turn; for a scene made from one photograph as far as it has no holes",
        metavar="DEG")] = None
    file: Annotated[Path | None, option("camera file: {cameras}; each view is a frame or, with --frames or "
        "--seconds, a key view of a smooth path; animated cameras keep their own motion #trajectory #camera "
        "#animation", flag="--path", default="")] = None
    frames: Annotated[int | None, option("frames along the path", ge=2, le=MAX_FRAMES, default="one per view"
    )] = None
    seconds: Annotated[float | None, option("duration in place of --frames #duration #length", gt=0,
        default="frames over fps", metavar="S")] = None
    fps: Annotated[float | None, option("frames per second", gt=0, le=MAX_FPS,
        default="that of the path file, else 24, or 30 for a moving scene")] = None
    loop: Annotated[bool, option("close the path from the last view to the first; a moving scene runs "
        "forward and back")] = False
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.orbit is None) == (self.file is None):
            found = "neither" if self.file is None else "both"
            raise ValueError(f"a camera path must be either an orbit or a path from a file, got {found}")
        if self.sway is not None and self.orbit is None:
            raise ValueError("sway needs orbit, its number of frames")
        for name in ("frames", "seconds"):
            if self.orbit is not None and getattr(self, name) is not None:
                cure = "set fps to change its duration" if name == "seconds" else "omit frames"
                raise ValueError(f"{name} cannot be combined with orbit, which is a number of frames; {cure}")
        if self.frames is not None and self.seconds is not None:
            raise ValueError("frames cannot be combined with seconds, since fps relates them; omit one")


class GrowConfig(Options, frozen=True):
    """A film of a painting as it grows, seen by a fixed camera or along a path.

    It ends with the finished painting, held for one second or a quarter of the time, whichever is shorter. A
    longer path continues after that.

    `is_along_path`: whether the camera moves.
    """

    GROUP: ClassVar = "path"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    # fmt: off
    seconds: Annotated[float, option("video of this length in which the painting grows: ground, large "
        "strokes, small ones, lights; with --orbit or --path it grows as the camera moves, in this time or "
        "the film's, else the camera is fixed #timelapse #process #progress",
        flag="--grow", gt=0, unit="seconds", default="the finished painting", metavar="SECONDS")]
    fps: Annotated[float | None, in_files("frames per second of the video", gt=0, le=MAX_FPS)] = None
    is_along_path: bool = False
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2 <= self.num_frames <= MAX_FRAMES:
            raise ValueError(f"grow times fps must give 2 to {MAX_FRAMES} frames, got {self.num_frames}")

    @property
    def rate(self) -> float:
        """Frames per second."""
        return self.fps or DEFAULT_FPS

    @property
    def num_frames(self) -> int:
        """Total number of frames."""
        return round(min(self.seconds * self.rate, 2.0 * MAX_FRAMES))

    @property
    def num_growing(self) -> int:
        """Number of frames before the painting is finished; at least one, of the bare ground."""
        standing = round(min(STANDING_SECONDS, STANDING_SHARE * self.seconds) * self.rate)
        return max(self.num_frames - max(standing, 1), 1)

    @property
    def fade(self) -> float:
        """Fade-in time of a stroke, as a share of the growing time."""
        return min(FADE_SECONDS * self.rate / self.num_growing, MOST_FADE)

    def along(self, num_frames: int, fps: float) -> "GrowConfig":
        """The options for a path of `num_frames` frames; the painting is finished within the path."""
        return replace(self, seconds=min(self.seconds, num_frames / fps), fps=fps)

    def time(self, index: int) -> float:
        """The time of a frame: 0 is the bare ground, 1 the finished painting."""
        return min(index / self.num_growing, 1.0)


class SequenceConfig(Options, frozen=True):
    """Processes that paint the frames of a sequence, and which frames they paint."""

    GROUP: ClassVar = "path"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    # fmt: off
    jobs: Annotated[int, option("number of processes; one process uses all processors per frame; the frames "
        "do not depend on it #parallel #speed", ge=1)] = 1
    scheduler: Annotated[str | None, option("Dask scheduler whose workers paint, such as tcp://host:8786 "
        "(pip install 'dask[distributed]') #cluster", default="this machine", metavar="ADDRESS")] = None
    workers_timeout: Annotated[float, option("time to wait for a worker of the scheduler", gt=0,
        unit="seconds", metavar="SECONDS")] = WORKERS_TIMEOUT
    is_resumed: Annotated[bool, option("paint only missing numbered frames #continue",
        flag="--resume")] = False
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.jobs > 1 and self.scheduler is not None:
            raise ValueError("jobs cannot be combined with scheduler, whose workers paint; omit one")
