"""`brushgs render --passes`: what the layers of an EXR file are, and how they are put together."""

import textwrap
from argparse import ArgumentParser, Namespace, _HelpAction
from typing import Any

from brushgs.options.choices import LAYER_CHANNELS, LAYERS

WIDTH = 100
ABOUT = """\
Layers of an EXR file, for --layers NAME,NAME or --layers all. R G B A, the picture in linear light and \
premultiplied, is always there."""
CONVENTIONS = """\
Normals are in camera axes: x right, y up, z toward the camera. Motion is in pixels to the next frame, u \
right, v up, not premultiplied; the last frame of a path that is no loop goes on as it came. paint.A, which \
comes with any layer, says how much of a pixel is painted. Mattes of strokes and brushes add up to it, those \
by layer to A: there a ground is a layer of its own.

Strokes are blended as they are seen, display-encoded, and not in linear light: what is laid over each other \
by its alpha in linear light comes out lighter at soft edges than the picture. To put parts together \
exactly, encode them (sRGB), lay them over, and decode; deep files (--deep) hold display-encoded colours for \
that. Grading by a matte, or what replaces a whole matte, is not affected."""


class ShowPasses(_HelpAction):
    """Prints what each layer is, and ends the command, as --help does."""

    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any, flag: Any = None) -> None:
        """Print the table."""
        print(explained())
        parser.exit()


def explained() -> str:
    """The layers in words, their channels, and their conventions."""
    rows = []
    for name, words in LAYERS.items():
        text = f"{words} ({LAYER_CHANNELS[name]})"
        rows.append(textwrap.fill(text, WIDTH, initial_indent=f"  {name:8}", subsequent_indent=" " * 10))
    paragraphs = [textwrap.fill(part, WIDTH) for part in CONVENTIONS.split("\n\n")]
    return "\n\n".join([textwrap.fill(ABOUT, WIDTH), "\n".join(rows), *paragraphs])
