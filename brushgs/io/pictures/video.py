"""Frames become a video: H.264 (.mp4), VP9 (.webm) or an animated GIF (.gif), see the table in `formats.py`.

A video appears when it is complete.
"""

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from importlib import import_module
from itertools import chain
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.io.formats import find_by_suffix
from brushgs.io.pictures.formats import VIDEO_FORMATS, VIDEO_SUFFIXES, VideoFormat
from brushgs.io.pictures.libav import VideoWriter
from brushgs.scene import Frame


def check_rate(path: Path, fps: float) -> None:
    """Refuse a frame rate that the video format cannot hold.

    Raises:
        ValueError: if it is not in (0, 1000], or above 50 for a GIF.
    """
    most = _format(path).max_fps
    if not 0 < fps <= most:
        raise ValueError(f"fps must be above 0 and at most {most} for {path.suffix}, got {fps:g}")


def check_size(path: Path, width: int, height: int) -> None:
    """Refuse frames that the video format cannot hold.

    Raises:
        ValueError: if a side is above 16384 pixels for H.264.
    """
    most = _format(path).max_side
    if most is not None and max(width, height) > most:
        without_limit = next(row.suffixes[0] for row in VIDEO_FORMATS if row.max_side is None)
        raise ValueError(
            f"pictures in {path.suffix} must be at most {most} pixels wide and high, got {width}x{height}; "
            f"use {without_limit} or numbered frames"
        )


def padded_size(path: Path, width: int, height: int) -> tuple[int, int]:
    """Width and height of the pictures in a video of frames of this size.

    H.264 keeps one colour for each 2 x 2 pixels, so its sides are even: the last column or row of an odd
    side is repeated once. VP9 and GIF hold any size.
    """
    if not _format(path).has_even_sides:
        return width, height
    return width + width % 2, height + height % 2


def save_video(
    frames: Iterable[Frame],
    path: str | Path,
    *,
    fps: float = 24.0,
    background: Sequence[float] | str = (1.0, 1.0, 1.0),
    loops: bool = False,
) -> None:
    """Write frames, such as those of `brushgs.render_sequence`, to a video: .mp4, .webm or .gif.

    The file appears when it is complete. Frames are taken one at a time.

    Args:
        frames: at least one, all of one size.
        path: the suffix decides the format, see `open_video`.
        fps: frames a second, above 0.
        background: colour behind the strokes, see `Frame.over`; videos have no transparency.
        loops: whether a GIF starts over at its end.

    Raises:
        ValueError: if there is no frame, sizes differ, or an option or the suffix is out of range.
        SceneError: if the file cannot be written.

    Example:
        >>> cameras = bg.orbit(gaussians, 12, width=160, height=120)
        >>> frames = bg.render_sequence(strokes, cameras, "flat")
        >>> bg.save_video(frames, "turn.mp4", fps=12, background="toned")
    """
    path, rest = Path(path), iter(frames)
    if path.suffix.lower() not in VIDEO_SUFFIXES:
        raise ValueError(f"save_video: path must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    first = next(rest, None)
    if first is None:
        raise ValueError("save_video: frames must hold at least one, got none")
    height, width = first.alpha.shape
    with open_video(path, width=width, height=height, fps=fps, loops=loops) as video:
        for frame in chain([first], rest):
            if frame.alpha.shape != (height, width):
                size = f"{frame.alpha.shape[1]}x{frame.alpha.shape[0]}"
                raise ValueError(f"save_video: frames must have one size, got {width}x{height} and {size}")
            video.add(frame.bytes_over(background))


@contextmanager
def open_video(
    path: str | Path, *, width: int, height: int, fps: float, loops: bool = False
) -> Iterator[VideoWriter]:
    """Write a video; it appears when the block ends without an error, else no file remains.

    .mp4 is H.264 at crf 18, .webm is VP9; both have 4:2:0 chroma, colours converted by BT.709 and tagged so.
    A GIF has one palette of 255 colours for all frames, found when all are there, and an ordered dither,
    which is still where the picture is.

    Args:
        path: the suffix decides the format.
        width: of the frames, pixels; see `padded_size`.
        height: of the frames, pixels.
        fps: frames a second, above 0; at most 50 for a GIF, whose delays are rounded to 1/100 s.
        loops: whether a GIF starts over at its end; players decide for the other formats.

    Raises:
        ValueError: if the suffix, `fps` or the size is out of range.
        SceneError: if the file cannot be written.
    """
    path = Path(path)
    check_rate(path, fps)
    check_size(path, width, height)
    module = import_module(f"brushgs.io.pictures.{_format(path).writer}")
    rate = Fraction(fps).limit_denominator(1001)
    with replacing(path) as temporary, _as_scene_error(path), contextlib.ExitStack() as stack:
        size = padded_size(path, width, height)
        writer: VideoWriter = module.open_writer(stack, temporary, size, rate, loops=loops)
        yield writer
        writer.finish()


def _format(path: Path) -> VideoFormat:
    """The format of a video by its suffix. Raises ValueError."""
    video_format = find_by_suffix(VIDEO_FORMATS, path)
    if video_format is None:
        raise ValueError(f"path of a video must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    return video_format


@contextmanager
def _as_scene_error(path: Path) -> Iterator[None]:
    """Errors of libav in writing as SceneErrors."""
    import av

    try:
        yield
    except av.FFmpegError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None
