"""The values of `--quality`: how much of a painting is made, from a draft to a picture to keep.

The counts follow the measured curves of bare strokes (`examples/measured/curves.md`). From 1,500 to 6,000
strokes the error falls by 2 to 3 dB and a whole painting takes 1.1 to 1.3 times as long; doubling once more
brings about 1 dB for 1.2 to 1.4 times. Of a count that is chosen by the scene, "good" takes the knee of a
still, and "final" that of a film, which has 2 to 5 times as many strokes. No value draws more samples per
pixel: brushes are filtered to the size of each stroke, so nine samples change a pixel by 1 to 5 of 255.

A draft has the tones and the composition of the picture. Without views that correct strokes (`--see off`) it
would be faster still, but has other tones, and with few strokes nothing is recognized.
"""

from collections.abc import Mapping
from typing import Any, Literal

from brushgs.options.choices import StepValues
from brushgs.options.stroke_target import UsualCount

Quality = Literal["draft", "good", "final"]
DRAFT_STROKES = 500  # of a count that would be chosen by the scene
FACTORS: Mapping[str, float] = {"draft": 0.25, "final": 2.0}  # of the count of a look
# Drafts have strokes for the picture or path alone, and neither accents nor lost and cut edges.
CHANGES: Mapping[str, StepValues] = {
    "draft": {"cluster": {"strokes_for": "view"}, "strokes": {"economy": 0.0, "edges": 0.0}},
}


def with_quality(values: StepValues, quality: Quality) -> StepValues:
    """The values of a look in a quality, for a picture or a film.

    Args:
        values: of the look, by step and field.
        quality: "good" changes nothing.

    Returns:
        The values; a share of the scene, and one stroke per Gaussian, are kept.
    """
    if quality == "good":
        return values
    changes = CHANGES.get(quality, {})
    made = {step: {**values.get(step, {}), **changes.get(step, {})} for step in {*values, *changes}}
    cluster = made.setdefault("cluster", {})
    found: Any = cluster.get("strokes", "auto")
    if isinstance(found, UsualCount):
        cluster["strokes"] = UsualCount(max(1, round(FACTORS[quality] * found.count)))
    elif found in ("auto", "auto:frame"):
        cluster["strokes"] = UsualCount(DRAFT_STROKES) if quality == "draft" else "auto:frame"
    return made
