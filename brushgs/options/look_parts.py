"""Parts of a look: brushes, color, ground and light, one class each.

Their defaults add nothing: one brush, scene colors, no relief, a background. Lengths on the canvas are
pixels of a 1000 x 750 picture and scale with the root of the picture's area.
"""

from math import degrees, radians
from typing import Annotated, Any, ClassVar, get_args

from brushgs.options.choices import DEFAULT_BACKDROP, MAX_BACKDROP, Canvas, StageTone, color_code
from brushgs.options.table import Options, count, in_files, number, option, share, shown

MAX_BRUSHES = 256  # per picture: strokes store their brush in 8 bits
MAX_PIGMENTS = 256
Pair = tuple[float, float]
LOOK_GROUP = "look"
ABOUT_LOOKS = "brushes, strokes, color, ground and light that go together; every flag overrides its part"
Names = Annotated[tuple[str, ...], in_files("names of strokes, or image files")]
Tint = Annotated[Pair, in_files("shift of a color, OKLab (a, b)", ge=-0.2, le=0.2)]
Jitter = Annotated[Pair, in_files("standard deviations of strokes, OKLab (L, and a and b)", ge=0, le=0.2)]


class BrushesConfig(Options, frozen=True):
    """Brushes by kind of stroke: names of built-in strokes, or image files.

    Without any, all strokes use `DrawConfig.stroke`. For an empty list, `other` is used. A hash of the
    stroke's position selects a brush from its list. `long` is for strokes with aspect ratio above 1.9,
    `short` below 1.35, `other` in between; strokes above 2.2 times the median size may also use `large`. With
    economy, smooth and light surfaces use `smooth`, rough ones `rough`, see `brushgs.passes.form.material`.
    `are_usual`: the user chose neither brushes nor stroke, so strokes keep the brushes that their file names.
    """

    IN_LOOKS: ClassVar = True
    long: Names = ()
    short: Names = ()
    other: Names = ()
    large: Names = ()
    smooth: Names = ()
    rough: Names = ()
    are_usual: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(name.strip() for name in self.names):
            raise ValueError("brushes must be names of strokes or image files, got an empty one; remove it")
        if len(self.names) > MAX_BRUSHES:
            raise ValueError(f"brushes must be at most {MAX_BRUSHES}, got {len(self.names)}")
        if self.names and not self.other:
            raise ValueError("other must name at least one brush where other lists do, got none")

    def __eq__(self, other: object) -> bool:
        """Whether the lists are equal; `are_usual` is ignored."""
        return isinstance(other, BrushesConfig) and self._lists == other._lists

    def __hash__(self) -> int:
        return hash(self._lists)

    @property
    def _lists(self) -> tuple[tuple[str, ...], ...]:
        return self.long, self.short, self.other, self.large, self.smooth, self.rough

    @property
    def names(self) -> tuple[str, ...]:
        """All brushes without duplicates, in the order of the lists."""
        return tuple(dict.fromkeys(name for names in self._lists for name in names))


class ColorConfig(Options, frozen=True):
    """Color grading of strokes in OKLab; the defaults change nothing."""

    GROUP: ClassVar = LOOK_GROUP
    ABOUT: ClassVar = ABOUT_LOOKS
    IN_LOOKS: ClassVar = True
    # fmt: off
    chroma: Annotated[float, option("colorfulness; 0 is grey, 1 as in the scene #saturation #vivid", ge=0,
        le=3)] = 1.0
    contrast: Annotated[float, in_files("factor of lightness around the pivot", ge=0, le=3)] = 1.0
    pivot: Annotated[float, share("lightness that contrast leaves unchanged", flag=None)] = 0.6
    local: Annotated[float, share("drawing media and watercolour: share of local contrast in a stroke's tone",
        flag=None)] = 0.0
    equalize: Annotated[float, share("drawing media and watercolour: strength of histogram equalization of "
        "tones", flag=None)] = 0.0
    shadows: Tint = (0.0, 0.0)  # in dark colors, such as (0.012, -0.045) toward violet
    lights: Tint = (0.0, 0.0)  # in light colors, such as (0.004, 0.03) toward yellow
    pigments: Annotated[int, option("number of pigments to mix colors from, 2 or more; 0: any color",
        ge=0, le=MAX_PIGMENTS)] = 0
    pure: Annotated[float, share("how far strokes move to the color of their pigment", flag=None)] = 0.85
    gray: Annotated[bool, in_files("keep only lightness, of strokes and of what lies behind them")] = False
    values: Annotated[float, share("how far the tonal range is expanded to that of a painting, with lights "
        "warmer than darks #contrast #range")] = 0.0
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pigments == 1:
            raise ValueError(f"pigments must be 2 to {MAX_PIGMENTS}, or 0 for any color, got 1")

    @property
    def grades(self) -> bool:
        """Whether colors are graded."""
        return self.chroma != 1 or self.contrast != 1 or any((*self.shadows, *self.lights))


def _backdrop(text: str) -> bool | int | str:
    """Parse a kind of backdrop, on or off, or a number of loose strokes; 0 is off."""
    if text in ("on", "off"):
        return text == "on"
    if text in ("stage", "loose"):
        return text
    try:
        return count(text, 0) or False
    except ValueError:
        raise ValueError(f"must be stage, loose, on, off or a whole number, got {text!r}") from None


def _backdrop_value(given: Any) -> bool | int:
    """Convert a backdrop from Python or a file: a bool, or a number of strokes."""
    if isinstance(given, bool) or (isinstance(given, int) and abs(given) < 2**63):
        return given
    raise ValueError(f"must be a whole number, got {shown(given)}")


GROUND_FORMS = "toned, canvas, paper, none, the name of a color, #rrggbb or an image file"


class GroundConfig(Options, frozen=True):
    """The ground of the canvas, and a backdrop or stage behind the scene.

    Backdrop strokes lie on a sphere around the scene; zoomed-in views get more of them. Scenes seen from
    inside, flat scenes seen from above, and scenes that fill the picture get a backdrop only with
    `backdrop_always`. A stage (table, wall and cast shadow, in paint or in marks of a drawing medium)
    replaces the backdrop.
    """

    GROUP: ClassVar = LOOK_GROUP
    ABOUT: ClassVar = ABOUT_LOOKS
    IN_LOOKS: ClassVar = True
    # fmt: off
    ground: Annotated[str, option("tone of the canvas: 'toned' (complement of the scene's colors), "
        "'canvas', 'paper', a color as for --background, an image file, or 'none' for the plain background "
        "#background #behind #canvas", metavar="NAME|COLOR|FILE", example="paper")] = "none"
    lightness: Annotated[float, share("of a toned ground, OKLab", flag=None)] = 0.58
    complement: Annotated[float, share("of a toned ground: strength of the complement of the scene's mean "
        "color", flag=None)] = 0.6
    warmth: Tint = (0.012, 0.04)
    backdrop: Annotated[int, option("surroundings of an object: 'stage' (table, wall and shadow); 'loose' "
        f"or N (loose strokes, their number from the look or {DEFAULT_BACKDROP}); 'on' (that of the look, "
        "also for scenes that fill the picture) #background #behind #around #table",
        default="that of the look; none if the scene has its own surroundings",
        metavar="stage|loose|on|off|N", read=_backdrop, make=_backdrop_value, ge=0, le=MAX_BACKDROP)] = 0
    backdrop_always: Annotated[bool, in_files("add it also to scenes that fill the picture"
    )] = False
    backdrop_brushes: Names = ()
    backdrop_lightness: Annotated[Pair, share("OKLab lightness, above and below", flag=None)] = (0.66, 0.40)
    backdrop_complement: Annotated[Pair, share("strength of the complement of the scene's mean color, above "
        "and below",
        flag=None)] = (0.5, 0.3)
    backdrop_above: Tint = (0.0, 0.03)
    backdrop_below: Tint = (0.012, 0.03)
    backdrop_jitter: Jitter = (0.018, 0.004)
    backdrop_aspect: Annotated[float, in_files("aspect ratio of its strokes", ge=1, le=10)] = 3.0
    backdrop_size: Annotated[float, in_files("size of its strokes; 1.6 covers the sphere loosely", ge=0.5,
        le=4)] = 1.6
    backdrop_dry: Annotated[float, share("dryness of its strokes: the ground shows through",
        flag=None)] = 0.25
    backdrop_border: Annotated[float, in_files("share of the picture's smaller side over which it thins out "
        "toward the border", ge=0, le=0.5)] = 0.13
    stage: Annotated[bool, in_files("a stage replaces the backdrop")] = False
    stage_tone: Annotated[str, option("lightness of the stage's wall, or colors of table and wall such as "
        "'#7a6a58,#9aa4b0'", default="auto: contrast with the subject's outline",
        metavar="auto|light|dark|COLORS")] = "auto"
    stage_size: Annotated[float, in_files("factor on the size of its strokes", ge=0.25, le=4)] = 1.0
    stage_aspect: Annotated[float, in_files("aspect ratio of its strokes", ge=1, le=10)] = 2.4
    stage_jitter: Jitter = (0.008, 0.004)
    shadow: Annotated[float, share("strength of the shadow on a stage")] = 0.6
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.ground.strip():
            raise ValueError(f"ground must be {GROUND_FORMS}, got {self.ground!r}")
        if not all(name.strip() for name in self.backdrop_brushes):
            raise ValueError("backdrop_brushes must be names of strokes or image files, got an empty one")
        if self.stage_tone not in get_args(StageTone) and self.stage_colors is None:
            forms = f"{', '.join(get_args(StageTone))} or two colors, as '#7a6a58,#9aa4b0'"
            raise ValueError(f"stage_tone must be {forms}, got {self.stage_tone!r}")

    @property
    def stage_colors(self) -> tuple[str, str] | None:
        """The "#rrggbb" of table and wall, if given; None if they are chosen automatically."""
        table, comma, wall = self.stage_tone.partition(",")
        codes = color_code(table), color_code(wall)
        return (codes[0], codes[1]) if comma and codes[0] and codes[1] else None


USUAL_LAMP = radians(225.0), radians(52.0)  # for flat pictures: upper left


def _sun(text: str) -> tuple[float, ...]:
    """Parse "AZ,EL" or "AZ,EL..AZ,EL" in degrees; returns radians."""
    ends = [end.split(",") for end in text.split("..")]
    if len(ends) > 2:
        raise ValueError(f"must be AZ,EL or AZ,EL..AZ,EL in degrees, got {text!r}")
    if wrong := [end for end in ends if len(end) != 2]:
        raise ValueError(f"must be 2 numbers separated by commas, got {','.join(wrong[0])!r}")
    return tuple(radians(number(word)) for end in ends for word in end)


class LightConfig(Options, frozen=True):
    """Relief of paint and canvas, and the lamp that lights them and the scene; the defaults add nothing.

    Angles are radians here, degrees in files and flags. `lamp` None is the usual lamp: `USUAL_LAMP` on flat
    pictures, more from the side if it lights the scene. With `key` the lamp stands in the scene (see
    `KeyLight`): relief, shadow and colors agree in every view. A `sun` overrides the lamp; two pairs of
    angles make it move from the first to the second along a film.
    """

    GROUP: ClassVar = LOOK_GROUP
    ABOUT: ClassVar = ABOUT_LOOKS
    IN_LOOKS: ClassVar = True
    # fmt: off
    relief: Annotated[float, share("strength of light and shade on the paint; 0 is flat #impasto #thick #3d"
    )] = 0.0
    lamp: Annotated[Pair | None, option("direction of the light in the first view, degrees: clockwise from "
        "the right of the picture, and elevation above the canvas, above 0 and at most 90 #light #direction "
        "#sun #shading", default="that of the look, the upper left", unit="degrees", metavar="AZ,EL",
        is_signed=True, alone="light", example="160,30")] = None
    key: Annotated[float, share("strength of the lamp on the scene, warm in the light and cool in the shade; "
        "0: it lights only the paint")] = 0.0
    sun: Annotated[tuple[float, ...] | None, option("direction of the light in the scene, degrees: azimuth "
        "as for --azimuth, and elevation above the table; two with .. between them: it moves from one to the "
        "other along a film #day #shadow", default="--lamp", unit="degrees", metavar="AZ,EL[..AZ,EL]",
        read=_sun, is_signed=True, alone="light")] = None
    gloss: Annotated[float, option("strength of highlights; from 0.15 paint looks like plastic #shine",
        ge=0, le=0.5)] = 0.06
    exponent: Annotated[float, in_files("of highlights: higher is smaller", ge=1, le=200)] = 40.0
    gain: Annotated[float, in_files("height of the ridges in a stroke", ge=0, le=10)] = 1.7
    base: Annotated[float, in_files("thickness of a stroke", ge=0, le=10)] = 0.4
    canvas: Annotated[Canvas, option("texture under the paint #texture #linen #paper")] = "none"
    canvas_strength: Annotated[float, in_files("factor on height and tone of linen and paper", ge=0,
        le=5)] = 1.0
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sun is not None and len(self.sun) not in (2, 4):
            raise ValueError(f"sun must be one or two azimuths with elevations, got {len(self.sun)} numbers")
        for name in ("lamp", "sun"):
            angles = [degrees(angle) for angle in getattr(self, name) or ()]
            for azimuth, elevation in zip(angles[::2], angles[1::2], strict=True):
                if not abs(azimuth) <= 720:
                    raise ValueError(f"{name} must have an azimuth of -720 to 720 degrees, got {azimuth:g}")
                if not 0 < elevation <= 90:
                    raise ValueError(
                        f"{name} must have an elevation above 0 and at most 90 degrees, got {elevation:g}"
                    )

    @property
    def is_in_scene(self) -> bool:
        """Whether the lamp stands in the scene, not with the canvas."""
        return self.key > 0 or self.sun is not None

    @property
    def has_day(self) -> bool:
        """Whether the sun moves along a film."""
        return self.sun is not None and len(self.sun) == 4
