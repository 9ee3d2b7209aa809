"""VP9, 8 bit, 4:2:0, with straight alpha as a second stream of pictures beside the first."""

import contextlib

from brushgs.formats.pictures.libav import EncodedVideo, Encoder, Film, VideoWriter

# The scale of crf is not that of H.264: 24 gives about the same error as 18 there.
_OPTIONS = {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4", "row-mt": "1", "tile-columns": "2"}
# Frames that are not shown would have no picture of alpha beside them, and the encoder refuses them.
_WITH_ALPHA = _OPTIONS | {"auto-alt-ref": "0"}


def open_writer(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(stack, film, _encoder(has_alpha=film.encoding.has_alpha))


def _encoder(*, has_alpha: bool) -> Encoder:
    if has_alpha:
        return Encoder("libvpx-vp9", "yuva420p", _WITH_ALPHA)
    return Encoder("libvpx-vp9", "yuv420p", _OPTIONS)
