"""`brushgs render --passes`: explain the layers of an EXR file and how to composite them."""

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
right, v up, not premultiplied; the last frame of an open path repeats the motion before it. paint.A, \
which comes with any layer, is the coverage by paint. Mattes of strokes and brushes sum to it, those by \
layer to A: there the ground is a layer of its own.

Strokes are blended display-encoded, not in linear light: layers composited in linear light come out \
lighter at soft edges than the picture. For an exact result encode the parts (sRGB), composite, and decode; \
deep files (--deep) hold display-encoded colors for that. Grading by a matte, or replacing a whole matte, \
is not affected."""


class ShowPasses(_HelpAction):
    """Print the layers, and quit, as --help does."""

    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any, flag: Any = None) -> None:
        """Print the table."""
        print(explained())
        parser.exit()


def explained() -> str:
    """The layers with their channels and conventions."""
    rows = []
    for name, words in LAYERS.items():
        text = f"{words} ({LAYER_CHANNELS[name]})"
        rows.append(textwrap.fill(text, WIDTH, initial_indent=f"  {name:8}", subsequent_indent=" " * 10))
    paragraphs = [textwrap.fill(part, WIDTH) for part in CONVENTIONS.split("\n\n")]
    return "\n\n".join([textwrap.fill(ABOUT, WIDTH), "\n".join(rows), *paragraphs])
