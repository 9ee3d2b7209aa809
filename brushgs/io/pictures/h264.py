"""H.264 in an .mp4 file."""

import contextlib
from fractions import Fraction
from pathlib import Path

from brushgs.io.pictures.libav import Codec, EncodedVideo, VideoWriter

_CODEC = Codec(
    "mp4",
    # faststart: the index precedes the frames, so that a browser plays what it has received; bitexact: no
    # random number and no version of the writer in the file.
    {"movflags": "+faststart", "fflags": "+bitexact"},
    "libx264",
    # A crf of 18 is considered visually lossless. x264's macroblock tree reads uninitialised memory: bytes
    # differed in 39 of 600 runs, and with MALLOC_PERTURB_. Without it files are 8 % larger, but repeatable.
    {"crf": "18", "preset": "medium", "x264-params": "no-mbtree=1"},
)


def open_writer(
    stack: contextlib.ExitStack, path: Path, size: tuple[int, int], rate: Fraction, *, loops: bool
) -> VideoWriter:
    """See `open_video`; players decide whether the video loops."""
    return EncodedVideo(stack, path, _CODEC, size, rate)
