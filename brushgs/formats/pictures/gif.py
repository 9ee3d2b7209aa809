"""An animated GIF: one palette for all frames, found in a first pass over them and used in a second."""

import contextlib
import tempfile
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.pictures.gif_colors import ColorCounts
from brushgs.formats.pictures.libav import Film, VideoWriter, open_container, video_frame
from brushgs.formats.pictures.pixels import Pixels

# An ordered dither is fixed on the screen. Error diffusion is more accurate in one frame, but crawls.
_DITHER = "dither=bayer:bayer_scale=4"
_NUM_COLORS = 255  # and one for "as in the last frame"


def open_writer(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return _Gif(stack, film)


class _Gif:
    def __init__(self, stack: contextlib.ExitStack, film: Film) -> None:
        self._shape = film.size[1], film.size[0], 3
        self._rate, self._count, self._is_finished = film.rate, 0, False
        # Beside the video: memory or a small /tmp may have no room for all frames.
        self._spool = stack.enter_context(tempfile.TemporaryFile(dir=film.path.parent))  # noqa: SIM115
        self._colors = ColorCounts()
        self._container = open_container(stack, film, {"loop": "0" if film.loops else "-1"})

    def describe(self, text: str) -> None:
        """Nothing: libav writes no comment."""

    def add(self, pixels: Pixels) -> None:
        """Store a frame, and count its colours."""
        self._spool.write(pixels.tobytes())
        self._colors.add(pixels.astype(np.uint8, copy=False))
        self._count += 1

    def finish(self) -> None:
        """Find the palette and write all frames with it."""
        if self._is_finished:
            return
        self._is_finished = True
        height, width, _ = self._shape
        graph, frames = _palette_graph(width, height, self._rate, self._colors.palette(_NUM_COLORS))
        stream = self._container.add_stream("gif", rate=self._rate)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        self._spool.seek(0)
        for index in range(self._count):
            pixels = np.frombuffer(self._spool.read(height * width * 3), np.uint8).reshape(self._shape)
            frames.push(video_frame(pixels, index, self._rate))
            self._container.mux(stream.encode(graph.pull()))
        self._container.mux(stream.encode(None))
        self._container.close()


def _palette_graph(width: int, height: int, rate: Fraction, colors: NDArray[np.uint8]) -> tuple[Any, Any]:
    """Filters from RGB to palette colours: the graph, and its input for frames."""
    import av

    entries = np.full((256, 4), 255, np.uint8)
    entries[:, :3] = colors[0]
    entries[: len(colors), :3] = colors
    entries[_NUM_COLORS, 3] = 0  # transparent: unchanged since the last frame
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
