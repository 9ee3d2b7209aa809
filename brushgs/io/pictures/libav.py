"""What the video writers share: frames go through filters into an encoder, with libav (PyAV).

Equal frames give equal bytes on every machine: encoders run in a fixed number of threads, and no time of day
is written.
"""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from brushgs.arrays import U8

# Encoders give other bytes for another number of threads, so it must not depend on the machine.
_NUM_THREADS = 4
# By default the scaler converts by the matrix of standard television (BT.601), up to 16 levels away.
# Chroma is the mean of its 2 x 2 pixels.
_TO_BT709 = (
    "flags=area+accurate_rnd+full_chroma_inp+bitexact:in_range=full:out_range=tv:out_color_matrix=bt709"
)
_BT709 = 1  # primaries, transfer and matrix have the same number in H.264 and VP9
_TV_RANGE = 1  # 16 to 235


class VideoWriter(Protocol):
    """A video that is being written."""

    def add(self, pixels: U8) -> None:
        """Add the next frame: uint8 [H, W, 3]."""

    def finish(self) -> None:
        """Write what is still buffered; no frame may follow. Further calls do nothing."""


@dataclass(frozen=True)
class Codec:
    """How libav is to encode a video.

    Attributes:
        container: its name.
        container_options: for it.
        encoder: its name.
        encoder_options: for it.
    """

    container: str
    container_options: Mapping[str, str]
    encoder: str
    encoder_options: Mapping[str, str]


class EncodedVideo:
    """A video with 4:2:0 chroma, colours converted by BT.709 and tagged so.

    Args:
        stack: closes the file.
        path: the file.
        codec: how to encode.
        size: width and height of the video, pixels; smaller frames are padded at their right and lower edge.
        rate: frames a second.
    """

    def __init__(
        self, stack: contextlib.ExitStack, path: Path, codec: Codec, size: tuple[int, int], rate: Fraction
    ) -> None:
        self._size = size
        self._container = open_container(stack, path, codec.container, codec.container_options)
        self._stream = stream = self._container.add_stream(
            codec.encoder, rate=rate, options=dict(codec.encoder_options)
        )
        stream.width, stream.height = self._size
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.thread_count = _NUM_THREADS
        context.color_primaries = context.color_trc = context.colorspace = _BT709
        context.color_range = _TV_RANGE
        self._graph = filter_graph(*self._size, rate, ("scale", _TO_BT709), ("format", "yuv420p"))
        self._rate, self._count, self._is_finished = rate, 0, False

    def add(self, pixels: U8) -> None:
        """Convert, encode and write one frame, uint8 [H, W, 3]."""
        width, height = self._size
        right, below = width - pixels.shape[1], height - pixels.shape[0]
        if right or below:
            pixels = np.pad(pixels, ((0, below), (0, right), (0, 0)), mode="edge")
        self._graph.push(video_frame(pixels, self._count, self._rate))
        self._container.mux(self._stream.encode(self._graph.pull()))
        self._count += 1

    def finish(self) -> None:
        """Write the frames that the encoder has buffered, and the index."""
        if self._is_finished:
            return
        self._is_finished = True
        self._container.mux(self._stream.encode(None))
        self._container.close()


def open_container(
    stack: contextlib.ExitStack, path: Path, container_format: str, options: Mapping[str, str]
) -> Any:
    """A container that is closed with the stack."""
    import av

    container = av.open(str(path), "w", format=container_format, options=dict(options))

    def close() -> None:
        # After an error the rest cannot be written either; that error is the one to report.
        with contextlib.suppress(av.FFmpegError):
            container.close()

    stack.callback(close)
    return container


def filter_graph(width: int, height: int, rate: Fraction, *filters: tuple[str, str]) -> Any:
    """A chain of filters for RGB frames, given as pairs of name and options."""
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


def video_frame(pixels: U8, index: int, rate: Fraction) -> Any:
    """uint8 [H, W, 3] as frame `index` of a video."""
    import av

    frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
    frame.pts, frame.time_base = index, 1 / rate
    return frame
