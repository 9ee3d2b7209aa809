"""The marks of a style, to JSON and from it."""

from typing import Any

import numpy as np

from brushgs.io.styles.arrays import pack, pack_picture, take_array, take_picture
from brushgs.io.styles.fields import Fields
from brushgs.io.styles.format import MAX_BRUSHES, MAX_TEXELS
from brushgs.values.style import StyleMarks

MOST_ASPECT = 20.0
MOST_BROKEN = 0.5  # as `brushgs.passes.color.broken_color` allows


def to_json(marks: StyleMarks) -> dict[str, Any]:
    """The fields; directions in steps of 1/127."""
    ground = None
    if marks.ground is not None:
        ground = "#{:02x}{:02x}{:02x}".format(*np.rint(255 * np.clip(marks.ground, 0, 1)).astype(int))
    return {
        "length": float(marks.length),
        "aspect": float(marks.aspect),
        "broken_lightness": float(marks.broken_lightness),
        "broken_chroma": float(marks.broken_chroma),
        "ground": ground,
        "relief": float(marks.relief),
        "directions": pack(marks.directions, "int8"),
        "brushes": [pack_picture(brush) for brush in marks.brushes],
    }


def of_json(style: Fields) -> StyleMarks:
    """The marks of the fields of a style.

    Raises:
        SceneError: if a field is missing or wrong.
    """
    fields = style.inner("marks")
    directions = take_array(fields, "directions", (None, None, 2), 1.01)
    if max(directions.shape) > MAX_TEXELS:
        fields.refuse("directions", f"at most {MAX_TEXELS} a side", [float(n) for n in directions.shape])
    # Rounding to int8 may lengthen a unit vector.
    lengths = np.linalg.norm(directions, axis=2, keepdims=True)
    brushes: list[Fields] = []
    if "brushes" in fields:
        brushes = list(fields.objects("brushes", "brush", 0, MAX_BRUSHES))
    marks = StyleMarks(
        length=fields.number("length", 0, 1, above=True),
        aspect=fields.number("aspect", 1, MOST_ASPECT),
        directions=(directions / np.maximum(lengths, 1)).astype(np.float32),
        broken_lightness=fields.number("broken_lightness", 0, MOST_BROKEN, 0.0),
        broken_chroma=fields.number("broken_chroma", 0, MOST_BROKEN, 0.0),
        ground=fields.color("ground") if "ground" in fields else None,
        relief=fields.number("relief", 0, 1, 0.0),
        brushes=tuple(take_picture(brush) for brush in brushes),
    )
    fields.end()
    return marks
