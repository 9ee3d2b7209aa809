"""Draw text on pictures with OpenImageIO and its built-in fonts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.values.arrays import F32

BOLD, PLAIN = "DroidSans-Bold", "DroidSans"


@dataclass(frozen=True)
class Words:
    """One line of text."""

    text: str  # the line
    x: int  # left end, pixels
    y: int  # baseline, pixels
    size: int  # height of the letters, pixels
    color: tuple[float, float, float]  # RGB, display-encoded, 0 to 1
    font: str = PLAIN  # `BOLD` or `PLAIN`


def with_words(picture: F32, words: Sequence[Words]) -> F32 | None:
    """A copy of a picture [H, W, 3] with lines of text; None if OpenImageIO was built without text."""
    import OpenImageIO

    canvas = OpenImageIO.ImageBuf(np.ascontiguousarray(picture, np.float32))
    for line in words:
        is_drawn = OpenImageIO.ImageBufAlgo.render_text(
            canvas, line.x, line.y, line.text, line.size, line.font, line.color
        )
        if line.text and not is_drawn:
            return None
    return np.asarray(canvas.get_pixels(OpenImageIO.FLOAT), np.float32)


def shortened(text: str, most: int) -> str:
    """The first words of a text, at most `most` characters together; at least one word."""
    while len(text) > most and " " in text:
        text = text.rsplit(" ", 1)[0].rstrip(",;")
    return text
