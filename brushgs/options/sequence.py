"""Where the camera goes along a path, and where its frames are painted."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

DEFAULT_FPS = 24.0  # of film
MAX_FRAMES = 99_999  # more than an hour of film; five digits number them
MAX_FPS = 1000.0  # more is a slip of the pen, and video formats count no finer than milliseconds


@dataclass(frozen=True)
class PathConfig:
    """Which way the camera goes: around the scene, or as a file says. Exactly one of `orbit` and `file`.

    Attributes:
        orbit: frames of one turn around the scene's up axis, 3 to 99,999, from the framed view on; always
            a loop.
        file: nerfstudio camera_path.json, transforms.json, cameras.json or a COLMAP sparse model. Each
            of its views is a frame, unless `frames` or `seconds` is given: then they are key views, and
            the path goes through them along a smooth curve at an even speed.
        frames: frames along that curve, 2 to 99,999; first and last frame are the ends of an open path.
        seconds: the same as a duration: `seconds` times `fps` frames, and one more where the path is
            open, so that both ends are frames and twice the fps keeps every frame.
        fps: frames a second of the video; None for what the file says, else 24.
        loop: whether the way goes on from the last view to the first. Neither the first frame is
            repeated nor, at the end, a last view that equals it. A camera path may say so itself.
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
                cure = "set fps to change how long it lasts" if name == "seconds" else "leave frames out"
                raise ValueError(
                    f"{name} must not stand beside orbit, which counts the frames itself; {cure}"
                )
        if self.frames is not None and self.seconds is not None:
            raise ValueError("frames must not stand beside seconds, which says it too; give one and fps")
        if self.frames is not None and not 2 <= self.frames <= MAX_FRAMES:
            raise ValueError(f"frames must be 2 to {MAX_FRAMES}, got {self.frames}")
        if self.seconds is not None and not 0 < self.seconds < inf:
            raise ValueError(f"seconds must be above 0, got {self.seconds:g}")
        if self.fps is not None and not 0 < self.fps <= MAX_FPS:
            raise ValueError(f"fps must be above 0 and at most {MAX_FPS:g}, got {self.fps:g}")


@dataclass(frozen=True)
class SequenceConfig:
    """Where the frames of a sequence are painted, and which.

    Attributes:
        jobs: processes of this machine, >= 1.
        scheduler: address of a Dask scheduler whose workers paint, such as "tcp://host:8786"; None for here.
        is_resumed: whether frames of the same painting that are there already are left as they are.
    """

    jobs: int = 1
    scheduler: str | None = None
    is_resumed: bool = False

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise ValueError(f"jobs must be at least 1, got {self.jobs}")
        if self.jobs > 1 and self.scheduler is not None:
            raise ValueError("jobs must not stand beside scheduler, whose workers paint; leave one out")
