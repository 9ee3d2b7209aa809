"""Options of a sequence: the path of the camera, or how a painting grows, and where frames are painted."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

from brushgs.options.choices import check_above_0

DEFAULT_FPS = 24.0  # of film
MAX_FRAMES = 99_999  # more than an hour of film; five digits number them
WORKERS_TIMEOUT = 60.0  # seconds that a Dask scheduler may have no worker: batch systems are slow to start
STANDING_SECONDS, STANDING_SHARE = 1.0, 0.25  # at the end of a painting that grows, the shorter of both
FADE_SECONDS, MOST_FADE = 0.15, 0.1  # in which one of its strokes comes; as a share of the time at most
MAX_FPS = 1000.0  # more is a typing error, and video formats count milliseconds at the finest


def check_fps(fps: float | None) -> None:
    """Raise ValueError for a rate that no video has; None, which nobody gave, passes."""
    if fps is not None and not 0 < fps <= MAX_FPS:
        raise ValueError(f"fps must be above 0 and at most {MAX_FPS:g}, got {fps:g}")


@dataclass(frozen=True)
class PathConfig:
    """The path of the camera: an orbit around the scene, or from a file. Exactly one of `orbit` and `file`.

    Attributes:
        orbit: frames of one turn around the scene's up axis, 3 to 99,999, starting at the framed view; always
            a loop.
        file: cameras in any format of `brushgs.io.cameras.formats`. Each view is a frame, unless `frames` or
            `seconds` is given: then views are the key views of a spline that is traversed at constant speed.
            An animated camera of a glTF or USD file is no spline: `frames`, `seconds` and `fps` choose the
            moments of its own motion.
        frames: frames along the spline, 2 to 99,999; the first and the last are the ends of an open path.
        seconds: in place of `frames`, a duration: `seconds` times `fps` frames, and one more if the path is
            open, so that both ends are frames and twice the fps keeps every frame.
        fps: frames per second of the video, in (0, 1000]; None for that of the file, else 24.
        loop: whether the path continues from the last view to the first. The first frame is not repeated at
            the end, nor is a last view that equals it. A camera path file may be a loop without this.
    """

    orbit: int | None = None
    file: Path | None = None
    frames: int | None = None
    seconds: float | None = None
    fps: float | None = None
    loop: bool = False

    def __post_init__(self) -> None:
        if (self.orbit is None) == (self.file is None):
            found = "neither" if self.file is None else "both"
            raise ValueError(f"a camera path must be either an orbit or a path from a file, got {found}")
        if self.orbit is not None and not 3 <= self.orbit <= MAX_FRAMES:
            raise ValueError(f"orbit must be 3 to {MAX_FRAMES} frames, got {self.orbit}")
        for name in ("frames", "seconds"):
            if self.orbit is not None and getattr(self, name) is not None:
                cure = "set fps to change its duration" if name == "seconds" else "omit frames"
                raise ValueError(f"{name} cannot be combined with orbit, which is a number of frames; {cure}")
        if self.frames is not None and self.seconds is not None:
            raise ValueError("frames cannot be combined with seconds, since fps relates them; omit one")
        if self.frames is not None and not 2 <= self.frames <= MAX_FRAMES:
            raise ValueError(f"frames must be 2 to {MAX_FRAMES}, got {self.frames}")
        check_above_0("seconds", self.seconds)
        check_fps(self.fps)


@dataclass(frozen=True)
class GrowConfig:
    """A painting that comes into being, seen by one camera that stands still.

    Attributes:
        seconds: duration, above 0. Its last part, a second or a quarter, shows the finished painting.
        fps: frames per second of the video, in (0, 1000]; None for 24.
    """

    seconds: float
    fps: float | None = None

    def __post_init__(self) -> None:
        if not 0 < self.seconds < inf:
            raise ValueError(f"grow must be above 0 seconds, got {self.seconds:g}")
        check_fps(self.fps)
        if not 2 <= self.num_frames <= MAX_FRAMES:
            raise ValueError(f"grow times fps must give 2 to {MAX_FRAMES} frames, got {self.num_frames}")

    @property
    def rate(self) -> float:
        """Frames per second."""
        return self.fps or DEFAULT_FPS

    @property
    def num_frames(self) -> int:
        """How many frames there are."""
        return round(min(self.seconds * self.rate, 2.0 * MAX_FRAMES))

    @property
    def num_growing(self) -> int:
        """How many of them show the painting unfinished, at least one: the bare ground."""
        standing = round(min(STANDING_SECONDS, STANDING_SHARE * self.seconds) * self.rate)
        return max(self.num_frames - max(standing, 1), 1)

    @property
    def fade(self) -> float:
        """The time in which a stroke comes, as a share of that in which the painting grows."""
        return min(FADE_SECONDS * self.rate / self.num_growing, MOST_FADE)

    def time(self, index: int) -> float:
        """The time of a frame: 0 is the bare ground, 1 the finished painting."""
        return min(index / self.num_growing, 1.0)


@dataclass(frozen=True)
class SequenceConfig:
    """Where the frames of a sequence are painted, and which of them.

    Attributes:
        jobs: processes of this machine that paint, >= 1.
        scheduler: address of a Dask scheduler whose workers paint, such as "tcp://host:8786"; None for this
            machine.
        workers_timeout: seconds to wait for a worker where the scheduler has none, > 0.
        is_resumed: whether existing frames of the same painting are kept and only missing ones painted.
    """

    jobs: int = 1
    scheduler: str | None = None
    workers_timeout: float = WORKERS_TIMEOUT
    is_resumed: bool = False

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise ValueError(f"jobs must be at least 1, got {self.jobs}")
        if not 0 < self.workers_timeout < inf:
            raise ValueError(f"workers-timeout must be above 0 seconds, got {self.workers_timeout:g}")
        if self.jobs > 1 and self.scheduler is not None:
            raise ValueError("jobs cannot be combined with scheduler, whose workers paint; omit one")
