"""The parts of a look beside strokes: brushes, colour, ground, light and medium, one frozen dataclass each.

Their defaults add nothing: strokes of one brush, in the colours of the scene, flat, on a background. A number
has its range beside its type (`Within`), so a new field needs no other line: files of looks, messages and
resumed paintings take it from there.

Lengths on the canvas are pixels of a picture of 1000 x 750; they grow with the root of its area.
"""

from dataclasses import dataclass, field, fields
from math import degrees, pi, radians
from typing import Annotated, Any, NamedTuple, get_args

from brushgs.options.choices import MAX_BACKDROP, Canvas, Medium, StageTone, color_code

MAX_BRUSHES = 256  # of one picture: a stroke holds the row of its brush in 8 bits
MAX_PIGMENTS = 256
Pair = tuple[float, float]


class Within(NamedTuple):
    """The range of a number, or of every number of a tuple, beside the type of its field."""

    least: float
    most: float


DEGREES = "degrees"  # beside the type of a field of radians that files give in degrees
Share = Annotated[float, Within(0, 1)]
Tint = Annotated[Pair, Within(-0.2, 0.2)]


class _Part:
    """Checks the fields that have a range beside their type."""

    def __post_init__(self) -> None:
        for known in fields(self):  # type: ignore[arg-type]  # every subclass is a dataclass
            value = getattr(self, known.name)
            for rule in getattr(known.type, "__metadata__", ()):
                for number in value if isinstance(value, tuple) else (value,):
                    if isinstance(rule, Within) and not rule.least <= number <= rule.most:
                        raise ValueError(
                            f"{known.name} must be {rule.least:g} to {rule.most:g}, got {number:g}"
                        )


def _check_choice(name: str, value: str, choices: Any) -> None:
    known = get_args(choices)
    if value not in known:
        raise ValueError(f"{name} must be {', '.join(known[:-1])} or {known[-1]}, got {value!r}")


@dataclass(frozen=True)
class BrushesConfig:
    """Which brushes paint which strokes: names of built-in strokes, or image files.

    Without any, all strokes are painted with `DrawConfig.stroke`. A list that is empty is that of `other`.
    Which brush of a list a stroke gets is a hash of its place in space.

    Attributes:
        long: of strokes that are long: length over width above 1.9.
        short: of strokes that are nearly round: below 1.35.
        other: of all others.
        large: what strokes of more than 2.2 times the median size may take beside their own.
        smooth: what strokes of smooth and light surfaces take instead where there is economy, see
            `brushgs.passes.form.material`; without any they keep theirs.
        rough: the same for rough surfaces.
        are_usual: whether nobody asked for these, nor for a stroke: then the strokes of a file that names
            their brushes keep those.
    """

    long: tuple[str, ...] = ()
    short: tuple[str, ...] = ()
    other: tuple[str, ...] = ()
    large: tuple[str, ...] = ()
    smooth: tuple[str, ...] = ()
    rough: tuple[str, ...] = ()
    are_usual: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        if not all(name.strip() for name in self.names):
            raise ValueError("brushes must be names of strokes or image files, got an empty one; remove it")
        if len(self.names) > MAX_BRUSHES:
            raise ValueError(f"brushes must be at most {MAX_BRUSHES}, got {len(self.names)}")
        if self.names and not self.other:
            raise ValueError("other must name at least one brush where other lists do, got none")

    @property
    def names(self) -> tuple[str, ...]:
        """All brushes, each once, in the order of the lists."""
        lists = self.long, self.short, self.other, self.large, self.smooth, self.rough
        return tuple(dict.fromkeys(name for names in lists for name in names))


@dataclass(frozen=True)
class ColorConfig(_Part):
    """How the colours of strokes differ from those of the scene, in OKLab; the defaults leave them.

    Attributes:
        chroma: factor of chroma, 0 (grey) to 3.
        contrast: factor of lightness around the pivot, 0 to 3.
        pivot: lightness that contrast leaves, 0 to 1.
        local: of drawing media and watercolour: share of a tone that says how a stroke stands out from what
            surrounds it, 0 to 1.
        equalize: of these too: share in which all tones are made equally frequent, 0 to 1.
        shadows: shift of (a, b) in the dark, such as (0.012, -0.045) toward violet, each -0.2 to 0.2.
        lights: the same in the light, such as (0.004, 0.03) toward yellow.
        pigments: how many colours a painting is mixed of, 2 to 256, or 0 for any.
        pure: share in which strokes take the colour of their pigment, 0 to 1.
        gray: whether only lightness is kept.
        values: share in which the painting takes the range of values of a painting, and the warmth of its
            lights, see `brushgs.passes.color.values`; 0 to 1.
    """

    chroma: Annotated[float, Within(0, 3)] = 1.0
    contrast: Annotated[float, Within(0, 3)] = 1.0
    pivot: Share = 0.6
    local: Share = 0.0
    equalize: Share = 0.0
    shadows: Tint = (0.0, 0.0)
    lights: Tint = (0.0, 0.0)
    pigments: Annotated[int, Within(0, MAX_PIGMENTS)] = 0
    pure: Share = 0.85
    gray: bool = False
    values: Share = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pigments == 1:
            raise ValueError(f"pigments must be 2 to {MAX_PIGMENTS}, or 0 for any colour, got 1")

    @property
    def grades(self) -> bool:
        """Whether colours are graded."""
        return self.chroma != 1 or self.contrast != 1 or any((*self.shadows, *self.lights))


@dataclass(frozen=True)
class GroundConfig(_Part):
    """What lies behind the strokes of the scene: the ground of the canvas, and strokes of a backdrop on it.

    Attributes:
        ground: "none" for `DrawConfig.background`; "toned": the complement of the scene's mean colour;
            "canvas" or "paper", as bought; the name of a colour, "#rrggbb", or an image file.
        lightness: of a toned ground, OKLab, 0 to 1.
        complement: of a toned ground, 0 (neutral) to 1: how far it goes from the scene's mean colour.
        warmth: shift of a toned ground, OKLab (a, b), each -0.2 to 0.2.
        backdrop: number of strokes of the backdrop, which stand in the world on a sphere around the scene; 0
            for none. Zoomed-in views get more.
        backdrop_always: whether scenes seen from inside, flat ones seen from above, and those that fill the
            picture, have a backdrop as well.
        backdrop_brushes: names of strokes, or image files; without any those of the strokes.
        backdrop_lightness: OKLab, (above, below).
        backdrop_complement: how far it goes from the scene's mean colour, (above, below), 0 to 1.
        backdrop_above: shift of its colour above, OKLab (a, b), each -0.2 to 0.2.
        backdrop_below: the same below.
        backdrop_jitter: standard deviations of its strokes, OKLab (L, and a and b), each 0 to 0.2.
        backdrop_aspect: length of its strokes over their width, 1 to 10.
        backdrop_size: of its strokes, 1.6 covers the sphere loosely, 0.5 to 4.
        backdrop_dry: how little paint its strokes hold, 0 to 1: the ground shows through.
        backdrop_border: share of the picture's smaller side over which it thins toward the border, 0 to 0.5.
        stage: whether a table, a wall and the cast shadow stand in place of the backdrop, in paint or in the
            marks of a drawing medium.
        stage_tone: "auto", "light" or "dark": of the wall, or the colours of both, as "#table,#wall".
        stage_size: of its strokes, 1 for the usual one, 0.25 to 4.
        stage_aspect: length of its strokes over their width, 1 to 10.
        stage_jitter: standard deviations of its strokes, OKLab (L, and a and b), each 0 to 0.2.
        shadow: strength of the shadow on a stage, 0 to 1.
    """

    ground: str = "none"
    lightness: Share = 0.58
    complement: Share = 0.6
    warmth: Tint = (0.012, 0.04)
    backdrop: Annotated[int, Within(0, MAX_BACKDROP)] = 0
    backdrop_always: bool = False
    backdrop_brushes: tuple[str, ...] = ()
    backdrop_lightness: Annotated[Pair, Within(0, 1)] = (0.66, 0.40)
    backdrop_complement: Annotated[Pair, Within(0, 1)] = (0.5, 0.3)
    backdrop_above: Tint = (0.0, 0.03)
    backdrop_below: Tint = (0.012, 0.03)
    backdrop_jitter: Annotated[Pair, Within(0, 0.2)] = (0.018, 0.004)
    backdrop_aspect: Annotated[float, Within(1, 10)] = 3.0
    backdrop_size: Annotated[float, Within(0.5, 4)] = 1.6
    backdrop_dry: Share = 0.25
    backdrop_border: Annotated[float, Within(0, 0.5)] = 0.13
    stage: bool = False
    stage_tone: str = "auto"
    stage_size: Annotated[float, Within(0.25, 4)] = 1.0
    stage_aspect: Annotated[float, Within(1, 10)] = 2.4
    stage_jitter: Annotated[Pair, Within(0, 0.2)] = (0.008, 0.004)
    shadow: Share = 0.6

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.ground.strip():
            raise ValueError(f"ground must be {GROUND_FORMS}, got {self.ground!r}")
        if not all(name.strip() for name in self.backdrop_brushes):
            raise ValueError("backdrop_brushes must be names of strokes or image files, got an empty one")
        if self.stage_tone not in get_args(StageTone) and self.stage_colors is None:
            forms = f"{', '.join(get_args(StageTone))} or two colours, as '#7a6a58,#9aa4b0'"
            raise ValueError(f"stage_tone must be {forms}, got {self.stage_tone!r}")

    @property
    def stage_colors(self) -> tuple[str, str] | None:
        """Of the table and the wall, "#rrggbb", where they are named; None where they are chosen."""
        table, comma, wall = self.stage_tone.partition(",")
        codes = color_code(table), color_code(wall)
        return (codes[0], codes[1]) if comma and codes[0] and codes[1] else None


USUAL_LAMP = radians(225.0), radians(52.0)  # on flat pictures: the upper left
GROUND_FORMS = "toned, canvas, paper, none, the name of a colour, #rrggbb or an image file"


@dataclass(frozen=True)
class LightConfig(_Part):
    """The height of the paint and the canvas, and the lamp on them and on the scene; defaults leave both.

    Attributes:
        relief: strength of light and shade, 0 (flat) to 1, below which paint does not look like plastic.
        lamp: (azimuth, elevation), radians: where the light comes from, clockwise in the picture from its
            right side, so that 225 degrees is the upper left; and how high above the canvas, above 0 to 90
            degrees. Files and flags give degrees. None for the usual lamp, which is `USUAL_LAMP` on flat
            pictures, and stands more to the side of a scene that it lights.
        key: strength in which the lamp lights the scene, see `KeyLight`; 0 to 1. From then on it
            stands in the scene: relief, shadow and colours agree in every view.
        sun: (azimuth, elevation), radians, of a lamp in the axes of the scene: the azimuth as that of a view,
            the elevation above the table; with two pairs it goes from the first to the second along a film.
            It goes before `lamp`; None for that.
        gloss: strength of highlights, 0 to 0.5; from 0.15 on paint looks like plastic.
        exponent: of highlights, 1 to 200: higher ones are smaller.
        gain: height of the ridges in a stroke, pixels, 0 to 10.
        base: thickness of a stroke, pixels, 0 to 10.
        canvas: "linen", "paper" or "none": what lies under the paint.
        canvas_strength: factor on the height and the tone of linen and paper, 0 to 5.
    """

    relief: Share = 0.0
    lamp: Annotated[Pair | None, DEGREES] = None
    key: Share = 0.0
    sun: Annotated[tuple[float, ...] | None, DEGREES] = None
    gloss: Annotated[float, Within(0, 0.5)] = 0.06
    exponent: Annotated[float, Within(1, 200)] = 40.0
    gain: Annotated[float, Within(0, 10)] = 1.7
    base: Annotated[float, Within(0, 10)] = 0.4
    canvas: Canvas = "none"
    canvas_strength: Annotated[float, Within(0, 5)] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("canvas", self.canvas, Canvas)
        if self.sun is not None and len(self.sun) not in (2, 4):
            raise ValueError(f"sun must be one or two azimuths with elevations, got {len(self.sun)} numbers")
        for name in ("lamp", "sun"):
            angles = getattr(self, name) or ()
            for azimuth, elevation in zip(angles[::2], angles[1::2], strict=True):
                if not abs(azimuth) <= 4 * pi:
                    found = f"{degrees(azimuth):g}"
                    raise ValueError(f"{name} must have an azimuth of -720 to 720 degrees, got {found}")
                if not 0 < elevation <= pi / 2:
                    found = f"{degrees(elevation):g}"
                    raise ValueError(
                        f"{name} must have an elevation above 0 and at most 90 degrees, got {found}"
                    )

    @property
    def is_in_scene(self) -> bool:
        """Whether the lamp stands in the scene, not with the canvas."""
        return self.key > 0 or self.sun is not None

    @property
    def has_day(self) -> bool:
        """Whether the sun passes over the scene."""
        return self.sun is not None and len(self.sun) == 4


@dataclass(frozen=True)
class MediaConfig(_Part):
    """What strokes are made with, and its numbers; "paint" uses none of them.

    Tones are those of the drawing, from 0, its darkest, to 1, its lightest.

    Attributes:
        kind: "paint", "charcoal", "ink" or "watercolour".
        color: of charcoal and ink, "#rrggbb".
        wash: strength of the soft tone under the marks, 0 to 1.
        marks: opacity of marks in charcoal, of strokes of ink, and of glazes of watercolour, 0 to 1.
        dry: how much of the paper's tooth the marks leave open, 0 to 1.
        dark: tone up to which ink is solid, 0 to 1.
        middle: tone up to which marks are made: in ink with a dry brush, 0 to 1.
        white: tone from which chalk is laid, or paper is left white, 0 to 1; 1 for nowhere.
        chalk: opacity of chalk, 0 to 1.
        chalk_dry: `dry` of chalk, 0 to 1.
        behind: sizes of a stroke by which it may lie behind what is seen and be painted, 0 to 10.
        details: opacity of smaller glazes in the dark, 0 to 1; 0 for none.
        lines: opacity of lines along edges, 0 to 1; 0 for none.
        line_color: of them, "#rrggbb".
        line_width: of them, pixels, 0.2 to 20.
        line_dry: `dry` of them, 0 to 1.
        line_strength: of edges from which there are lines, 0 (all) to 1.
    """

    kind: Medium = "paint"
    color: str = "#171615"
    wash: Share = 0.6
    marks: Share = 0.9
    dry: Share = 0.0
    dark: Share = 0.2
    middle: Share = 0.7
    white: Share = 1.0
    chalk: Share = 0.8
    chalk_dry: Share = 0.34
    behind: Annotated[float, Within(0, 10)] = 1.6
    details: Share = 0.0
    lines: Share = 0.0
    line_color: str = "#0f0e0e"
    line_width: Annotated[float, Within(0.2, 20)] = 1.5
    line_dry: Share = 0.2
    line_strength: Share = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("kind", self.kind, Medium)
        for name in ("color", "line_color"):
            code = getattr(self, name)
            if len(code) != 7 or code[0] != "#" or set(code[1:].lower()) - set("0123456789abcdef"):
                raise ValueError(f"{name} must be #rrggbb, got {code!r}")

    @property
    def has_own_color(self) -> bool:
        """Whether marks have a colour of the medium, not those of the scene."""
        return self.kind in ("charcoal", "ink")

    @property
    def draws_lines(self) -> bool:
        """Whether there are lines along edges."""
        return self.kind != "paint" and self.lines > 0
