"""A frame on a background becomes an AVIF: AV1 of 8 or 10 bits, one chroma sample for four pixels.

Display-encoded, by libav: its encoder takes no transparency and no finer chroma.
"""

import contextlib
import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

from brushgs.core.signals import defer_stop
from brushgs.formats.files import replacing
from brushgs.formats.pictures.encoding import Encoding
from brushgs.formats.pictures.libav import EncodedVideo, Encoder, Film, as_scene_error
from brushgs.formats.pictures.oiio import Background
from brushgs.formats.pictures.pixels import video_pixels
from brushgs.values.frame import Frame

MIN_SIDE = 16  # the encoder refuses smaller pictures
_PIXELS = {8: "yuv420p", 10: "yuv420p10le"}
# crf: the error of a JPEG of quality 95, in a third of its bytes; lp: threads, fixed as those of videos are.
_OPTIONS = {"crf": "16", "preset": "6", "svtav1-params": "lp=1"}


def write(frame: Frame, path: str | Path, background: Background, *, bits: int = 8) -> None:
    """See `write_frame`."""
    if background is None:
        raise ValueError(f"write_frame: an AVIF holds no transparency, got {str(path)!r}; give a background")
    height, width = frame.alpha.shape
    if min(height, width) < MIN_SIDE:
        size = f"{width}x{height}"
        raise ValueError(f"an AVIF must be at least {MIN_SIDE} pixels wide and high, got {size}; use .png")
    if bits > 8 and (height % 2 or width % 2):
        raise ValueError(f"an AVIF of {bits} bits must have even sides, got {width}x{height}; use 8 bits")
    os.environ.setdefault("SVT_LOG", "1")  # errors only: it describes itself on the terminal
    encoder = Encoder("libsvtav1", _PIXELS[bits], _OPTIONS)
    with (
        defer_stop(),
        replacing(path) as temporary,
        as_scene_error(Path(path)),
        _scheduling_kept(),
        contextlib.ExitStack() as stack,
    ):
        film = Film(temporary, "avif", (width, height), Fraction(1), Encoding(bits, has_alpha=False))
        writer = EncodedVideo(stack, film, encoder)
        writer.add(video_pixels(frame, background, bits))
        writer.finish()


@contextlib.contextmanager
def _scheduling_kept() -> Iterator[None]:
    """Undo what SVT-AV1 does where the user is root: it makes the thread that calls it a real-time one.

    Threads and processes that this one begins later would be so, too, and all others would wait for them.
    """
    if not hasattr(os, "sched_getscheduler"):  # macOS and Windows, where it does not
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        if before != (os.sched_getscheduler(0), os.sched_getparam(0)):
            os.sched_setscheduler(0, *before)
