"""ProRes 4444: 10 bit, chroma for every pixel, straight alpha; each frame stands alone."""

import contextlib

from brushgs.formats.pictures.libav import EncodedVideo, Encoder, Film, VideoWriter

_OPTIONS = {"profile": "4444", "vendor": "apl0"}  # some programs open only what says it is Apple's


def open_writer(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(
        stack,
        film,
        Encoder("prores_ks", "yuva444p10le" if film.encoding.has_alpha else "yuv444p10le", _OPTIONS),
    )
