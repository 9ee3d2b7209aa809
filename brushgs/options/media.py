"""Painting media, one class of numbers each; their coats are in `brushgs.pipeline.media`.

To add one: a class here, a module of the same name there, and a look that uses it. Tones are those of the
drawing, from 0 (darkest) to 1 (lightest).
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from brushgs.options.table import Options, in_files, listed, rows_of, share, shown

Share = Annotated[float, share(flag=None)]


def _color(text: str) -> str:
    if len(text) != 7 or text[0] != "#" or set(text[1:].lower()) - set("0123456789abcdef"):
        raise ValueError(f"must be #rrggbb, got {text!r}")
    return text


Pair = tuple[float, float]
Key = Annotated[
    float, share("how far the focus takes all tones, from dark to light, so that it reads", flag=None)
]
Code = Annotated[str, in_files("#rrggbb", read=_color)]


class Medium(Options, frozen=True):
    """Base of all media; `kind` is the name, such as "paint" or "ink"."""

    kind: ClassVar[str]
    has_own_color: ClassVar[bool] = False  # whether marks have the medium's color, not those of the scene
    draws_lines: ClassVar[bool] = False  # whether there may be lines along edges
    draws_tones: ClassVar[bool] = False  # whether tones are those in the views of a job, keyed in the focus
    # fmt: off
    behind: Annotated[float, in_files("strokes are painted up to this many stroke sizes behind the visible "
        "surface", ge=0, le=10)] = 1.6
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        for row in rows_of(type(self)):
            if row.option.read is _color:
                try:
                    _color(getattr(self, row.field))
                except ValueError as error:
                    raise ValueError(f"{row.field} {error}") from None


class Paint(Medium, frozen=True):
    """Opaque paint, without numbers of its own."""

    kind = "paint"


class DrawingMedium(Medium, frozen=True):
    """Base of media that draw lines along edges."""

    lines: Annotated[float, share("opacity of lines along edges; 0 for none", flag=None)] = 0.0
    line_color: Code = "#0f0e0e"
    line_width: Annotated[float, in_files("of lines", ge=0.2, le=20, unit="px")] = 1.5
    line_dry: Annotated[float, share("`dry` of lines", flag=None)] = 0.2
    line_strength: Annotated[
        float, share("minimum strength of edges that get lines; 0 for all", flag=None)
    ] = 0.3

    @property
    def draws_lines(self) -> bool:  # type: ignore[override]  # a ClassVar in the base
        """Whether there are lines along edges."""
        return self.lines > 0


class SoftMedium(DrawingMedium, frozen=True):
    """Base of media with a soft tone under marks."""

    wash: Annotated[float, share("strength of the soft tone under the marks", flag=None)] = 0.6
    marks: Annotated[float, share("opacity of marks", flag=None)] = 0.9
    dry: Annotated[float, share("share of the paper's tooth that marks leave open", flag=None)] = 0.0


class Charcoal(SoftMedium, frozen=True):
    """Charcoal, a rubber and chalk."""

    kind = "charcoal"
    has_own_color = True
    draws_tones = True
    color: Code = "#171615"
    key: Key = 0.3
    rub: Annotated[float, share("how far the edges of masses are rubbed", flag=None)] = 0.6
    middle: Annotated[float, share("tone up to which marks are made", flag=None)] = 0.6
    accents: Annotated[float, share("opacity of marks in the darkest tones; 0 for none", flag=None)] = 0.9
    rubber: Annotated[float, share("opacity of lights taken out with a rubber; 0 for none", flag=None)] = 0.8
    chalk: Annotated[float, share("opacity of chalk in the lightest tones; 0 for none", flag=None)] = 0.9
    chalk_dry: Annotated[float, share("`dry` of chalk", flag=None)] = 0.34


class TonalMedium(DrawingMedium, frozen=True):
    """Base of media whose tone is the density of marks of one color.

    Lengths are pixels in a picture of 960 x 540, and scale with the root of its area.
    """

    has_own_color = True
    draws_tones = True
    # fmt: off
    color: Code = "#171615"
    spacing: Annotated[Pair, in_files("distance of marks in the darkest tone, and not less in the lightest",
        ge=0.5, le=100, unit="px")] = (2.4, 5.5)
    width: Annotated[Pair, in_files("of marks in the darkest and in the lightest tone", ge=0.1, le=20,
        unit="px")] = (1.9, 1.6)
    lightest: Annotated[float, share("tone from which paper is left white", flag=None)] = 0.6
    key: Key = 0.6
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.spacing[1] < self.spacing[0]:
            raise ValueError(f"spacing must not be less in the lightest tone, got {list(self.spacing)}")


class Hatching(TonalMedium, frozen=True):
    """Evenly spaced lines along the form, crossed in the dark."""

    kind = "hatching"
    crossed: Annotated[float, share("tone up to which hatching is crossed; 0 for nowhere", flag=None)] = 0.36
    length: Annotated[Pair, in_files("shortest and longest line", ge=1, le=1000, unit="px")] = (22.0, 110.0)
    dry: Annotated[float, share("share of the paper's tooth that lines leave open", flag=None)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.length[1] < self.length[0]:
            raise ValueError(f"length must name the shortest line first, got {list(self.length)}")


class Ink(Hatching, frozen=True):
    """Pen and brush: hatching, and the darkest masses in solid black."""

    kind = "ink"
    black: Annotated[float, share("share of what is drawn that is solid black", flag=None)] = 0.17


class Stippling(TonalMedium, frozen=True):
    """Dots."""

    kind = "stippling"


class Watercolour(SoftMedium, frozen=True):
    """Watercolour: one wet layer of washes, a few touches of the brush on it, and pencil at the focus."""

    kind = "watercolour"
    paper: Annotated[float, share("share of the painted area that stays white paper", flag=None)] = 0.05
    wet: Annotated[float, share("how far washes run into each other", flag=None)] = 1.0
    flow: Annotated[float, share("unevenness of the pigment in a wash, with its backruns", flag=None)] = 1.0
    rims: Annotated[float, share("gathering of pigment at the rims of a wash", flag=None)] = 1.0
    grain: Annotated[float, share("settling of pigment in the valleys of the paper", flag=None)] = 1.0
    touches: Annotated[int, in_files("largest number of brush marks on the wet layer", ge=0, le=5000)] = 500


MEDIA: Mapping[str, type[Medium]] = {
    one.kind: one for one in (Paint, Charcoal, Ink, Hatching, Stippling, Watercolour)
}
# Fields of a table [media]; a look with a base may give only the medium, or only some of its numbers.
ROWS = {row.field: row for medium in MEDIA.values() for row in rows_of(medium)}


def medium_of(values: Mapping[str, Any]) -> Medium:
    """The medium `kind` with these values; values of other media are ignored.

    Raises:
        ValueError: if there is no such medium, or a value is out of range.
    """
    kind = values.get("kind", Paint.kind)
    if kind not in MEDIA:
        raise ValueError(f"kind must be {listed(list(map(repr, MEDIA)))}, got {shown(kind)}")
    for name, value in values.items():
        if name != "kind":
            ROWS[name].check(value)
    known = MEDIA[kind].__struct_fields__
    return MEDIA[kind](**{name: value for name, value in values.items() if name in known})
