"""Frames become a video through PyAV: H.264 (.mp4), VP9 (.webm) or an animated GIF (.gif).

A video appears when it is complete. Equal frames give equal bytes on every machine: the encoders run in a
fixed number of threads, and nothing of the time of day is written.
"""

import contextlib
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import U8
from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.io.pictures.formats import VIDEO_SUFFIXES
from brushgs.io.pictures.gif_colors import ColorCounts
from brushgs.scene import Frame

# Encoders give other bytes for another number of threads, so it must not be that of the machine.
_NUM_THREADS = 4
# x264: 18 is taken for visually lossless. Its macroblock tree reads memory that nothing was written to: the
# bytes differed in 39 of 600 runs, and with MALLOC_PERTURB_. Without it files are 8 % larger, but repeat.
# VP9 counts its crf otherwise: 24 comes to about the same error.
_ENCODERS: dict[str, tuple[str, str, dict[str, str]]] = {
    ".mp4": ("mp4", "libx264", {"crf": "18", "preset": "medium", "x264-params": "no-mbtree=1"}),
    ".webm": (
        "webm",
        "libvpx-vp9",
        {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4", "row-mt": "1", "tile-columns": "2"},
    ),
}
# faststart: the index stands before the pictures, so that a browser plays what it has; bitexact: no random
# number and no version of the writer in the file.
_CONTAINERS = {".mp4": {"movflags": "+faststart", "fflags": "+bitexact"}, ".webm": {"fflags": "+bitexact"}}
# Left to itself the scaler converts by the matrix of standard television (BT.601), up to 16 levels away.
# Chroma is the mean of its 2 x 2 pixels.
_TO_BT709 = (
    "flags=area+accurate_rnd+full_chroma_inp+bitexact:in_range=full:out_range=tv:out_color_matrix=bt709"
)
_BT709 = 1  # primaries, transfer and matrix bear one number in H.264 and VP9
_TV_RANGE = 1  # 16 to 235
# A pattern that is fixed on the screen. Error diffusion is nearer in one frame, but crawls.
_DITHER = "dither=bayer:bayer_scale=4"
_GIF_COLORS = 255  # and one for "as in the last frame"
MAX_H264_SIDE = 16384  # x264 refuses more
MAX_GIF_FPS = 50  # the delay counts in hundredths of a second, and viewers take 1 for 10


class Film(Protocol):
    """A video that is being written."""

    def add(self, pixels: U8) -> None:
        """Take the next frame: uint8 [H, W, 3]."""

    def finish(self) -> None:
        """Write what is still held back; no frame follows. Once is enough."""


def check_rate(path: Path, fps: float) -> None:
    """Refuse a frame rate that the kind of video cannot hold.

    Raises:
        ValueError: if it is not in (0, 1000], or above 50 for a GIF.
    """
    most = MAX_GIF_FPS if path.suffix.lower() == ".gif" else 1000
    if not 0 < fps <= most:
        raise ValueError(f"fps must be above 0 and at most {most} for {path.suffix}, got {fps:g}")


def check_size(path: Path, width: int, height: int) -> None:
    """Refuse pictures that the kind of video cannot hold.

    Raises:
        ValueError: if a side is above 16384 pixels for H.264.
    """
    if path.suffix.lower() == ".mp4" and max(width, height) > MAX_H264_SIDE:
        raise ValueError(
            f"pictures in .mp4 must be at most {MAX_H264_SIDE} pixels wide and high, got {width}x{height}; "
            "take .webm or numbered frames"
        )


def padded_size(path: Path, width: int, height: int) -> tuple[int, int]:
    """Width and height of the pictures in a video of frames of this size.

    H.264 keeps one colour for each 2 x 2 pixels, so its sides are even: the last column or row of an odd
    side is repeated once. VP9 and GIF hold any size.
    """
    if path.suffix.lower() != ".mp4":
        return width, height
    return width + width % 2, height + height % 2


def save_video(
    frames: Iterable[Frame],
    path: str | Path,
    *,
    fps: float = 24.0,
    background: Sequence[float] = (1.0, 1.0, 1.0),
    loops: bool = False,
) -> None:
    """Write frames, such as those of `brushgs.render_sequence`, to a video: .mp4, .webm or .gif.

    The file appears when it is complete. Frames are taken one at a time.

    Args:
        frames: at least one, all of one size.
        path: the suffix decides, see `filming`.
        fps: frames a second, above 0.
        background: RGB behind the strokes, 0 to 1, display-encoded; videos have no transparency.
        loops: whether a GIF starts over at its end.

    Raises:
        ValueError: if there is no frame, sizes differ, or an option or the suffix is out of range.
        SceneError: if the file cannot be written.
    """
    path, left = Path(path), iter(frames)
    if path.suffix.lower() not in VIDEO_SUFFIXES:
        raise ValueError(f"save_video: path must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    first = next(left, None)
    if first is None:
        raise ValueError("save_video: frames must hold at least one, got none")
    height, width = first.alpha.shape
    with filming(path, width=width, height=height, fps=fps, loops=loops) as film:
        for frame in chain([first], left):
            if frame.alpha.shape != (height, width):
                size = f"{frame.alpha.shape[1]}x{frame.alpha.shape[0]}"
                raise ValueError(f"save_video: frames must have one size, got {width}x{height} and {size}")
            film.add(frame.bytes_over(background))


@contextmanager
def filming(path: str | Path, *, width: int, height: int, fps: float, loops: bool = False) -> Iterator[Film]:
    """Write a video; it takes its name when the block ends without an error, else nothing is left.

    .mp4 is H.264 at crf 18, .webm is VP9; both have 4:2:0 chroma, colours converted by BT.709 and tagged so.
    A GIF has one palette of 255 colours for all its frames, found when all are there, and an ordered dither,
    which holds still where the picture does.

    Args:
        path: the suffix decides.
        width: of the frames, pixels; see `padded_size`.
        height: of the frames, pixels.
        fps: frames a second, above 0; at most 50 for a GIF, whose delays are rounded to 1/100 s.
        loops: whether a GIF starts over at its end; the other formats leave that to the player.

    Raises:
        ValueError: if `fps` or the size is out of range.
        SceneError: if the file cannot be written.
    """
    path = Path(path)
    check_rate(path, fps)
    check_size(path, width, height)
    rate = Fraction(fps).limit_denominator(1001)
    with replacing(path) as temporary, _told_as_scene_error(path), contextlib.ExitStack() as stack:
        film: Film
        if path.suffix.lower() == ".gif":
            film = _Gif(stack, temporary, width, height, rate, loops)
        else:
            film = _Encoded(stack, temporary, width, height, rate)
        yield film
        film.finish()


@contextmanager
def _told_as_scene_error(path: Path) -> Iterator[None]:
    """What libav cannot write, told as any other file that cannot be written."""
    import av

    try:
        yield
    except av.FFmpegError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


class _Encoded:
    """H.264 or VP9."""

    def __init__(
        self, stack: contextlib.ExitStack, path: Path, width: int, height: int, rate: Fraction
    ) -> None:
        suffix = path.suffix.lower()
        container_format, codec, options = _ENCODERS[suffix]
        self._size = padded_size(path, width, height)
        self._container = _open(stack, path, container_format, _CONTAINERS[suffix])
        self._stream = stream = self._container.add_stream(codec, rate=rate, options=options)
        stream.width, stream.height = self._size
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.thread_count = _NUM_THREADS
        context.color_primaries = context.color_trc = context.colorspace = _BT709
        context.color_range = _TV_RANGE
        self._graph = _graph(*self._size, rate, ("scale", _TO_BT709), ("format", "yuv420p"))
        self._rate, self._count, self._is_finished = rate, 0, False

    def add(self, pixels: U8) -> None:
        """Convert, encode and write one frame."""
        width, height = self._size
        right, below = width - pixels.shape[1], height - pixels.shape[0]
        if right or below:
            pixels = np.pad(pixels, ((0, below), (0, right), (0, 0)), mode="edge")
        self._graph.push(_video_frame(pixels, self._count, self._rate))
        self._container.mux(self._stream.encode(self._graph.pull()))
        self._count += 1

    def finish(self) -> None:
        """Write the frames that the encoder still holds, and the index."""
        if self._is_finished:
            return
        self._is_finished = True
        self._container.mux(self._stream.encode(None))
        self._container.close()


class _Gif:
    """An animated GIF: a first look at all frames finds the palette, a second uses it."""

    def __init__(
        self, stack: contextlib.ExitStack, path: Path, width: int, height: int, rate: Fraction, loops: bool
    ) -> None:
        self._shape = height, width, 3
        self._rate, self._count, self._is_finished = rate, 0, False
        # Beside the video: there is room for frames there rather than in memory or on a small /tmp.
        self._spool = stack.enter_context(tempfile.TemporaryFile(dir=path.parent))  # noqa: SIM115
        self._colors = ColorCounts()
        self._container = _open(stack, path, "gif", {"loop": "0" if loops else "-1"})

    def add(self, pixels: U8) -> None:
        """Keep a frame, and its colours."""
        self._spool.write(pixels.tobytes())
        self._colors.add(pixels)
        self._count += 1

    def finish(self) -> None:
        """Find the palette, and write all frames with it."""
        if self._is_finished:
            return
        self._is_finished = True
        height, width, _ = self._shape
        graph, frames = _palette_graph(width, height, self._rate, self._colors.palette(_GIF_COLORS))
        stream = self._container.add_stream("gif", rate=self._rate)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        self._spool.seek(0)
        for index in range(self._count):
            pixels = np.frombuffer(self._spool.read(height * width * 3), np.uint8).reshape(self._shape)
            frames.push(_video_frame(pixels, index, self._rate))
            self._container.mux(stream.encode(graph.pull()))
        self._container.mux(stream.encode(None))
        self._container.close()


def _open(stack: contextlib.ExitStack, path: Path, container_format: str, options: dict[str, str]) -> Any:
    """A container that is closed with the stack."""
    import av

    container = av.open(str(path), "w", format=container_format, options=options)

    def close() -> None:
        # After an error the rest cannot be written either; that error is the one to tell.
        with contextlib.suppress(av.FFmpegError):
            container.close()

    stack.callback(close)
    return container


def _graph(width: int, height: int, rate: Fraction, *filters: tuple[str, str]) -> Any:
    """RGB frames through filters in a row."""
    import av

    graph = av.filter.Graph()
    last = graph.add_buffer(
        width=width, height=height, format=av.VideoFormat("rgb24"), time_base=1 / rate, name="frames"
    )
    for name, options in (*filters, ("buffersink", "")):
        following = graph.add(name, options)
        last.link_to(following)
        last = following
    graph.configure()
    return graph


def _palette_graph(width: int, height: int, rate: Fraction, colors: NDArray[np.uint8]) -> tuple[Any, Any]:
    """RGB frames to frames of palette colours: the graph, and the place where frames go in."""
    import av

    entries = np.full((256, 4), 255, np.uint8)
    entries[:, :3] = colors[0]
    entries[: len(colors), :3] = colors
    entries[_GIF_COLORS, 3] = 0  # transparent: what did not change since the last frame
    palette = av.VideoFrame.from_ndarray(entries.reshape(16, 16, 4), format="rgba").reformat(format="bgra")
    graph = av.filter.Graph()
    frames = graph.add_buffer(
        width=width, height=height, format=av.VideoFormat("rgb24"), time_base=1 / rate, name="frames"
    )
    palette_in = graph.add_buffer(template=palette, time_base=1 / rate, name="palette")
    use = graph.add("paletteuse", _DITHER)
    frames.link_to(use, 0, 0)
    palette_in.link_to(use, 0, 1)
    use.link_to(graph.add("buffersink"))
    graph.configure()
    palette.pts, palette.time_base = 0, 1 / rate
    palette_in.push(palette)
    palette_in.push(None)
    return graph, frames


def _video_frame(pixels: U8, index: int, rate: Fraction) -> Any:
    """uint8 [H, W, 3] as frame `index` of a video."""
    import av

    frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
    frame.pts, frame.time_base = index, 1 / rate
    return frame
