"""Numbers blended between styles and a look: strokes, broken color, ground and relief.

This is a layer between a look and flags: flags win. For colors and directions see `pipeline.styling`.
"""

from collections.abc import Mapping, Sequence
from math import exp, log
from typing import Any

import numpy as np

from brushgs.options.choices import StepValues, color_code
from brushgs.options.painting import STEPS
from brushgs.options.stroke_target import UsualCount
from brushgs.options.table import row_of
from brushgs.passes.style.transport import is_grey
from brushgs.pipeline.look import BOUGHT
from brushgs.values.colors import code_of, oklab_of, rgb_of
from brushgs.values.style import Style, StyleMarks

# A picture of S pixels with n strokes of median area a has n a / S = 1.6 on koala, 1.2 to 1.5 on chair, 3.5
# to 3.9 on truck, which has a street around it; the same for 2000 to 14,000 strokes. With 2.0 the truck falls
# apart: there its strokes are twice as wide as the marks.
LAYERS = 3.5
LONGEST = 4.5  # of strokes of a scene, lengths over widths, hardly any of which are longer
CANVAS = 1000, 750  # pixels of the picture that stroke counts refer to
# Range of strokes of a style. Large washes would be 100 strokes; with 800 the truck is unrecognisable.
FEWEST, MOST = 2400, 20_000
# OKLab lightness, that of the look of broken color: marks of paintings differ by 0.05 to 0.14, but much of
# this is what they depict; with 0.05 a grey street turns to confetti.
MOST_BROKEN = 0.034
MOST_TINT = 0.2  # of a ground, OKLab a and b


def style_values(styles: Sequence[tuple[Style, float]], values: StepValues) -> StepValues:
    """The values of a look, blended with those of the marks of styles by share.

    Args:
        styles: with their shares, 0 to 1, sum at most 1; those without marks have no effect.
        values: step -> field -> value of a look; missing values have the default of their class.

    Returns:
        The values with a changed broken color, a relief if a style has one, the number of strokes if that of
        the look is a `UsualCount`, and the ground if it has one color and a style has one; the input itself
        if no share is above 0.
    """
    drawn = [(style, style.marks, share) for style, share in styles if style.marks is not None and share > 0]
    if not drawn:
        return values
    marked = [(marks, share) for _, marks, share in drawn]
    found: dict[str, dict[str, Any]] = {step: dict(of_step) for step, of_step in values.items()}
    flat = sum(share * style.flatness for style, _, share in drawn)
    if flat > 0:
        found["light"] = found.get("light", {}) | _flattened(values, flat)
    broken = [(_broken_color(style, marks), share) for style, marks, share in drawn]
    lit = [((1 - style.flatness) * marks.relief, share) for style, marks, share in drawn if marks.relief > 0]
    for step, field, wanted in (("strokes", "broken_color", broken), ("light", "relief", lit)):
        if wanted:
            found.setdefault(step, {})[field] = _blended(_of_look(values, step, field), wanted)
    count = _of_look(values, "cluster", "strokes")
    if isinstance(count, UsualCount):
        factors = [(log(count_of(marks)) - log(count.count), share) for marks, share in marked]
        moved = round(count.count * exp(_blended(0.0, factors)))
        found.setdefault("cluster", {})["strokes"] = UsualCount(moved)
    if ground := _moved_ground(values, marked):
        found["ground"] = found.get("ground", {}) | ground
    return found


def _blended(start: float, wanted: Sequence[tuple[float, float]]) -> float:
    """A number of a look moved toward those of styles, each by its share."""
    return start + sum(share * (of_style - start) for of_style, share in wanted)


def _flattened(values: StepValues, flat: float) -> dict[str, float]:
    """Relief and canvas with a share of prints, which have neither ridges of paint nor threads."""
    return {field: (1 - flat) * _of_look(values, "light", field) for field in ("relief", "canvas_strength")}


def _broken_color(style: Style, marks: StyleMarks) -> float:
    """The broken color of a style; none in black and white, less in a print."""
    if is_grey(style.palette):
        return 0.0
    return (1 - style.flatness) * min(marks.broken_lightness, MOST_BROKEN)


def count_of(marks: StyleMarks) -> int:
    """The number of strokes for the mark size of a style in a picture of 1000 x 750.

    Strokes have the width of long marks; they are as long as the form they lie on lets them be.
    """
    width = marks.length / marks.aspect * min(CANVAS)
    area = width**2 * min(marks.aspect, LONGEST)
    return round(min(max(LAYERS * CANVAS[0] * CANVAS[1] / area, FEWEST), MOST))


def _of_look(values: StepValues, step: str, field: str) -> Any:
    """The value of a look, or the default of the class."""
    of_step: Mapping[str, Any] = values.get(step, {})
    if field in of_step:
        return of_step[field]
    return row_of(STEPS[step], field).default


def _moved_ground(values: StepValues, marked: Sequence[tuple[StyleMarks, float]]) -> dict[str, Any]:
    """The fields of the ground that change."""
    grounds = [(marks.ground, share) for marks, share in marked if marks.ground is not None]
    kind = str(_of_look(values, "ground", "ground"))
    if not grounds:
        return {}
    if kind == "toned":  # by its numbers: the missing share of 1 stays a complement of the scene
        own = {
            name: np.array(_of_look(values, "ground", name)) for name in ("lightness", "complement", "warmth")
        }
        shift = {name: np.zeros_like(value, np.float64) for name, value in own.items()}
        for rgb, share in grounds:
            lightness, *tint = oklab_of(rgb[None])[0]
            wanted = {
                "lightness": lightness,
                "complement": 0.0,
                "warmth": np.clip(tint, -MOST_TINT, MOST_TINT),
            }
            for name, value in own.items():
                shift[name] += share * (wanted[name] - value)
        moved = {name: np.asarray(value + shift[name]).tolist() for name, value in own.items()}
        return moved | {"warmth": tuple(moved["warmth"])}
    code = color_code(BOUGHT.get(kind, kind))
    if code is None:  # a picture, or none
        return {}
    start = np.array(rgb_of(code))
    mixed = start + sum(share * (rgb - start) for rgb, share in grounds)
    return {"ground": code_of(mixed)}
