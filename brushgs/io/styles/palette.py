"""The palette of a style, to JSON and from it."""

from typing import Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.styles.arrays import pack, take_array
from brushgs.io.styles.fields import Fields
from brushgs.io.styles.format import MAX_COLORS
from brushgs.values.style import NamedColor, StylePalette

FARTHEST = 2.0  # of an offset, in a channel: colours lie in 0 to 1, and offsets within 1


def to_json(palette: StylePalette) -> list[dict[str, Any]]:
    """The colours, most frequent first; offsets in half precision, relative to the colour as written."""
    return [_color_to_json(color) for color in palette.colors]


def _color_to_json(color: NamedColor) -> dict[str, Any]:
    code = np.rint(255 * np.clip(color.rgb, 0, 1)).astype(int)
    offsets = color.offsets + (color.rgb - code / 255)
    return {
        "name": color.name,
        "color": "#{:02x}{:02x}{:02x}".format(*code),
        "share": round(float(color.share), 6),
        "offsets": pack(offsets, "float16"),
    }


def of_json(style: Fields) -> StylePalette:
    """The palette of the fields of a style.

    Raises:
        SceneError: if a field is missing or wrong.
    """
    colors = []
    for fields in style.objects("palette", "colour", 1, MAX_COLORS):
        name, rgb, share = fields.text("name"), fields.color("color"), fields.number("share", 0, 1e6)
        offsets = np.zeros((1, 3))
        if "offsets" in fields:
            offsets = take_array(fields, "offsets", (None, 3), FARTHEST)
        fields.end()
        colors.append((name, rgb, share, offsets.astype(np.float32)))
    total = sum(share for _, _, share, _ in colors)
    if not total > 0:
        raise SceneError(style.path, "'palette' must have a colour with a share above 0, got none; raise one")
    return StylePalette(
        tuple(NamedColor(name, rgb, share / total, offsets) for name, rgb, share, offsets in colors)
    )
