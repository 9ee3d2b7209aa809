"""VP9 in a .webm file."""

import contextlib
from fractions import Fraction
from pathlib import Path

from brushgs.io.pictures.libav import Codec, EncodedVideo, VideoWriter

_CODEC = Codec(
    "webm",
    {"fflags": "+bitexact"},  # no random number and no version of the writer in the file
    "libvpx-vp9",
    # The scale of crf is not that of H.264: 24 gives about the same error as 18 there.
    {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4", "row-mt": "1", "tile-columns": "2"},
)


def open_writer(
    stack: contextlib.ExitStack, path: Path, size: tuple[int, int], rate: Fraction, *, loops: bool
) -> VideoWriter:
    """See `open_video`; players decide whether the video loops."""
    return EncodedVideo(stack, path, _CODEC, size, rate)
