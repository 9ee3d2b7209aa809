"""Options of a painting: one class per step, a line an option, see `brushgs.options.table`.

Only the standard library and msgspec are imported, so that a command line is checked without loading NumPy.
"""

import re
from collections.abc import Mapping
from math import ceil, inf, radians
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

import msgspec

from brushgs.core.threads import MOST_THREADS
from brushgs.options.choices import (
    COLORS,
    MAX_SIDE,
    METHODS,
    PLAIN_STROKES,
    Clean,
    ColorSpace,
    Cost,
    Extent,
    Features,
    Filter,
    Knee,
    Lock,
    Merge,
    Method,
    Order,
    See,
    Side,
    StepValues,
    StrokeColor,
    StrokesFor,
    Target,
    Weight,
    size_rule,
)
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.hand import STEADY, HandConfig, Pace
from brushgs.options.look_parts import BrushesConfig, ColorConfig, GroundConfig, LightConfig
from brushgs.options.media import Medium, Paint, medium_of
from brushgs.options.output import OutputConfig
from brushgs.options.rules import Rules
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.table import Options, number, numbers, option, rows_of, share, shown
from brushgs.options.where import WhereConfig

DEFAULT_KEEP = 0.7  # of the Gaussians, as published
DEFAULT_STROKE = "impasto"  # reads at any size; a swirl under some 20 px looks like a bubble
DEFAULT_SIZE = (1280, 720)
MAX_PAN = 10.0  # pictures: more is a typing error
MAX_PSNR = 100.0  # dB; pictures of 16 bits agree no better
MAX_BROKEN_COLOR = 0.2  # OKLab lightness: more would leave nothing of the scene's own light
MAX_STREAKS = 0.5  # of the core

Up = str | tuple[float, float, float]


def picture_size(text: str) -> tuple[int, int]:
    """(width, height) in pixels of a text such as "1280x720"."""
    match = re.fullmatch(r"([0-9]{1,18})[xX]([0-9]{1,18})", text)
    if match is None:
        raise ValueError(f"must be WIDTHxHEIGHT in pixels such as 1280x720, got {text!r}")
    size = int(match[1]), int(match[2])
    if broken := size_rule(*size):
        raise ValueError(broken)
    return size


def chosen_size(text: str) -> tuple[int, int] | Literal["auto"]:
    """(width, height) in pixels as `picture_size`, or "auto" for one that is chosen."""
    if text == "auto":
        return "auto"
    try:
        return picture_size(text)
    except ValueError as error:
        raise ValueError(f"{error}; or auto" if "x" not in text.lower() else str(error)) from None


def _look_at(text: str) -> str | tuple[float, ...]:
    """A value of `ViewConfig.look_at`."""
    if text in get_args(Target):
        return text
    try:
        return numbers(text, 3)
    except ValueError:
        names = ", ".join(get_args(Target))
        raise ValueError(f"must be {names} or three numbers such as 0,1.5,-2, got {text!r}") from None


def _up(given: Any) -> str:
    """An axis in the form of its flag."""
    if isinstance(given, list | tuple) and len(given) == 3:
        return ",".join(repr(float(one)) for one in given)
    raise ValueError(f"must be an axis such as -y, or three numbers, got {shown(given)}")


class CleanConfig(Options, frozen=True):
    """What is dropped before anything else; nothing of a file of strokes."""

    GROUP: ClassVar = "clustering"
    # fmt: off
    floaters: Annotated[Clean, option("what is dropped: 'sure': floaters that are clearly detached, and "
        "crumbs that hang below an object, 'strong': closer floaters too, which loses some thin leaves; "
        "'floaters': as 'sure' without crumbs; 'off': nothing #floaters #noise #remove #artefacts",
        flag="--clean")] = "sure"
    # fmt: on

    @property
    def drops_crumbs(self) -> bool:
        """Whether what hangs below an object is dropped."""
        return self.floaters in ("sure", "strong")


class PruneConfig(Options, frozen=True):
    """Which Gaussians are kept."""

    GROUP: ClassVar = "pruning"
    # fmt: off
    keep: Annotated[float | None, option("share of the Gaussians to keep, those of highest weight, such as "
        "0.7 or 70% #prune #fewer #reduce", gt=0, le=1, takes_percent=True, default=f"{DEFAULT_KEEP:g} (more "
        "where each counts or becomes a stroke; 1 for a file of strokes, and with --stroke gaussian without "
        "--preset)")] = None
    weight: Annotated[Weight, option("importance of a Gaussian: its 'contribution' to pictures by opacity, "
        "area and visibility, or 'paper': intensity as published")] = "contribution"
    # fmt: on

    def share(self) -> float:
        """The share of a scene that is kept, without what the default keeps beyond."""
        return DEFAULT_KEEP if self.keep is None else self.keep


class ErrorBudget(Options, frozen=True):
    """The fewest strokes whose picture reaches a PSNR to the plain picture.

    `psnr` is in dB, above 0 and at most 100.
    """

    psnr: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.psnr <= MAX_PSNR:
            raise ValueError(f"strokes must be above 0 dB and at most {MAX_PSNR:g} dB, got {self.psnr:g} dB")

    def __str__(self) -> str:
        return f"{self.psnr:g}dB"


class StrokeSize(Options, frozen=True):
    """Strokes of a typical length in the picture, see `brushgs.stroke_count.view_model.typical_size`.

    Its `pixels` are above 0, and at most the longest side that a picture can have.
    """

    pixels: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.pixels <= MAX_SIDE:
            raise ValueError(f"stroke-size must be above 0 and at most {MAX_SIDE} px, got {self.pixels:g} px")

    def __str__(self) -> str:
        return f"{self.pixels:g}px"


class UsualCount(Options, frozen=True):
    """So many strokes of a scene, and all of a file of strokes: the number of a look, which nobody asked
    for.
    """

    count: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.count < 1:
            raise ValueError(f"strokes must be a count >= 1, got {self.count}")

    def __str__(self) -> str:
        return str(self.count)


StrokeTarget = Knee | ErrorBudget | StrokeSize  # that a number of strokes is chosen for
KNEES: Mapping[str, Knee] = {knee: knee for knee in get_args(Knee)}


def parse_strokes(text: str) -> int | float | Knee | ErrorBudget | None:
    """A value of `ClusterConfig.strokes`: int for a count, float for a share, None for all.

    Args:
        text: a count such as "7000", a share such as "10%", "all", "auto" or "auto:frame", or a PSNR such as
            "24dB".

    Raises:
        ValueError: if it is none of these, or out of range.
    """
    if text == "all":
        return None
    if text in KNEES:
        return KNEES[text]
    if text.lower().endswith("db") and (decibels := _number(text[:-2])) is not None:
        return ErrorBudget(decibels)
    if text.endswith("%") and (percent := _number(text[:-1])) is not None:
        if not 0 < percent <= 100:
            raise ValueError(f"strokes must be above 0 % and at most 100 %, got {text!r}")
        return percent / 100
    if re.fullmatch(r"\+?[0-9]{1,18}", text) and int(text) >= 1:
        return int(text)
    raise ValueError(
        "strokes must be a count of 1 or more, a share such as 10%, all, auto, or a PSNR such as 24dB, got "
        f"{text!r}"
    )


def _number(text: str) -> float | None:
    try:
        return number(text)
    except ValueError:
        return None


def _strokes(given: Any) -> int | ErrorBudget | StrokeSize | UsualCount:
    """A number of strokes that Python gives: a count, or a target that is made already."""
    if isinstance(given, ErrorBudget | StrokeSize | UsualCount):
        return given
    if isinstance(given, bool) or not hasattr(given, "__index__") or given < 1:
        raise ValueError(
            "must be a count of 1 or more, a share such as '10%', all, auto, or a PSNR such as '24dB', got "
            f"{shown(given)}"
        )
    return int(given)


def _stroke_size(text: str) -> StrokeSize:
    """A typical length of strokes in pixels; the unit may be omitted."""
    match = re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+) ?(px)?", text, re.IGNORECASE)
    if match is None:
        raise ValueError(f"must be a length above 0 in pixels such as 24px, got {text!r}")
    return StrokeSize(float(match[1]))


def _size_value(given: Any) -> StrokeSize:
    return given if isinstance(given, StrokeSize) else _stroke_size(str(given))


class StrokeSizeFlag(Options, frozen=True):
    """The other flag of `ClusterConfig.strokes`."""

    GROUP: ClassVar = "clustering"
    # fmt: off
    strokes: Annotated[StrokeSize | None, option("typical length of strokes in the picture such as "
        "24px, above 0, in place of --strokes #brush #size #thick #thin #width #large #small",
        flag="--stroke-size", metavar="PX", read=_stroke_size, make=_size_value, alone="strokes",
        example="24px")] = None
    # fmt: on


class ClusterConfig(Options, frozen=True):
    """How Gaussians become fewer and larger strokes.

    Its `strokes` are a count of 1 or more, a share of the scene as loaded in (0, 1] given as a float, or None
    for one stroke per Gaussian; or a target that the count is chosen for: "auto" for the knee of error over
    cost (`choose_strokes`), or all of a file of strokes; an `ErrorBudget` or a `StrokeSize`. The cost is the
    time of a painting, and of a film or with "auto:frame" that of a frame. A `UsualCount` is a count, but
    all of a file of strokes.
    """

    GROUP: ClassVar = "clustering"
    # fmt: off
    strokes: Annotated[int | float | StrokeTarget | UsualCount | None, option("number of strokes, 1 or "
        "more; a share of the scene as loaded such as 10%; all; auto: the knee of error against the time "
        "of the painting, or of a frame of a film (auto:frame: of a frame in any case); 24dB: the fewest "
        "that reach this PSNR to the plain picture, above 0 and at most 100 #number #count #detail "
        "#quality", default="auto", metavar="COUNT|PERCENT|all|auto|DB", read=parse_strokes, make=_strokes,
        alone="strokes", example="2000")] = "auto"
    features: Annotated[Features, option("what makes Gaussians similar: 'balanced', independent of the "
        "scene's unit, or 'paper' as published")] = "balanced"
    merge: Annotated[Merge, option("how Gaussians merge: 'cover' keeps the area they paint, 'paper': plain "
        "means")] = "cover"
    method: Annotated[Method, option(
        "k-means: " + ", ".join(f"'{name}' {words}" for name, words in METHODS.items()), default="")] = "auto"
    strokes_for: Annotated[StrokesFor, option("'scene': strokes are made of all of it, so that any view of "
        "them fits; 'view': only of what this picture or path sees, so that all are spent there")] = "scene"
    seed: Annotated[int, option("seed of all random choices #random", ge=0, le=2**32 - 1)] = 0
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.strokes is None or isinstance(self.strokes, (ErrorBudget, StrokeSize, UsualCount)):
            return
        if isinstance(self.strokes, str):
            if self.strokes not in get_args(Knee):
                raise ValueError(f"strokes must be a number, auto, a budget or a size, got {self.strokes!r}")
            return
        is_share = isinstance(self.strokes, float)
        if not (0 < self.strokes <= 1 if is_share else self.strokes >= 1):
            raise ValueError(f"strokes must be a count >= 1 or a share in (0, 100 %], got {self.strokes}")

    @property
    def target(self) -> StrokeTarget | None:
        """The target that the count is chosen for; None if it is given."""
        return self.strokes if isinstance(self.strokes, (str, ErrorBudget, StrokeSize)) else None

    @property
    def cost(self) -> Cost:
        """What a knee is the knee of."""
        return "frame" if self.strokes == "auto:frame" else "painting"

    @property
    def of_film(self) -> "ClusterConfig":
        """The same where many frames are painted."""
        return msgspec.structs.replace(self, strokes="auto:frame") if self.strokes == "auto" else self

    @property
    def keeps_strokes(self) -> bool:
        """Whether all of a file of strokes are kept, since nobody asked for a number."""
        return isinstance(self.strokes, str | UsualCount)

    @property
    def asked_count(self) -> int | None:
        """The number of strokes, where it does not depend on the scene; None where it does."""
        count = self.strokes.count if isinstance(self.strokes, UsualCount) else self.strokes
        return count if isinstance(count, int) else None

    def num_strokes(self, num_gaussians: int) -> int:
        """The count, given the number of Gaussians in the scene as loaded.

        Raises:
            TypeError: if it is a target, which depends on the scene.
        """
        if isinstance(self.strokes, (str, ErrorBudget, StrokeSize)):
            raise TypeError(f"num_strokes: strokes must be a count, a share or None, got {self.strokes}")
        if self.strokes is None:
            return num_gaussians
        if isinstance(self.strokes, UsualCount):
            return self.strokes.count
        if isinstance(self.strokes, float):
            return max(1, ceil(self.strokes * num_gaussians - 1e-9))
        return self.strokes


class StrokesConfig(Options, frozen=True):
    """What strokes are beside clusters of Gaussians; none of it changes a file of strokes.

    See `brushgs.passes.form` for each.
    """

    GROUP: ClassVar = "strokes"
    ABOUT: ClassVar = (
        "what strokes are beside clusters of Gaussians; files of strokes are painted as they are, and "
        "--preset paper and --stroke gaussian switch these off, with --underpaint and --streaks"
    )
    # fmt: off
    see: Annotated[See, option("'views': small plain pictures of what is painted decide where strokes go, "
        "which of them are split, and their colours; 'off': the scene alone")] = "views"
    focus: Annotated[Focus | None, option("where more strokes go to an area, out of the same number: "
        "'auto', faces, hands and what stands out, up to eight times as many; or twice as many: the "
        "subject, a sphere in world units, or where a picture in the place of the painting is light "
        "#detail #face", default="that of the look, off in plain", metavar="auto|off|subject|X,Y,Z,R|FILE",
        read=Focus.of, is_signed=True)] = None
    solid: Annotated[bool, option("paint in place of glass: faint strokes become smaller and opaque #opaque"
    )] = True
    direction: Annotated[Direction, option("which way strokes run: 'own', as clustered; 'form', along "
        "shapes and edges; 'color', along edges of colour; as the brush marks of a painting, or along "
        "lines in space do #orientation #flow", metavar="own|form|color|painting:FILE|guides:FILE",
        read=Direction.of)] = Direction("form")
    broken_color: Annotated[float, option("by how much strokes differ in lightness from their neighbours, "
        "OKLab #variation", ge=0, le=MAX_BROKEN_COLOR)] = 0.016
    economy: Annotated[float, share("how far few large strokes describe what is flat, and what is left "
        "goes to accents of light and dark #loose #abstract #simple", default="that of the look")] = 0.0
    edges: Annotated[float, share("how far outlines are lost in the shade and found near the focus; 0: all "
        "hard #soft #blur #outline", default="that of the look")] = 0.0
    # fmt: on

    @classmethod
    def of(cls, **fields: Any) -> "StrokesConfig":
        """The same with the direction as text, as tables of presets hold it."""
        if isinstance(fields.get("direction"), str):
            fields["direction"] = Direction.of(fields["direction"])
        return cls(**fields)

    @classmethod
    def off(cls) -> "StrokesConfig":
        """Strokes as clustering by the scene alone leaves them."""
        return cls.of(**PLAIN_STROKES)

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that strokes are made from beside the scene."""
        mask = None if self.focus is None else self.focus.mask
        return tuple(path for path in (mask, self.direction.file) if path is not None)


class ViewConfig(Options, frozen=True):
    """The view: a camera from a file, or one framed on the scene by its first view.

    Angles are radians here, and degrees in flags. A `size` of None is that of the camera in the file, or
    1280 x 720; "auto" is one that suits what is framed, which then is set into the picture (see
    `brushgs.cameras.composition`); where the camera moves or is given it counts as None. With a `camera_file`
    only `view`, its index there, and `size` are used. `look_at` None is the subject, or the view from inside
    of a scene that is seen so: there azimuth and elevation turn the camera where it stands.
    """

    GROUP: ClassVar = "view"
    ABOUT: ClassVar = "framed on the scene, or a camera from a file"
    # fmt: off
    size: Annotated[tuple[int, int] | Literal["auto"] | None, option("picture size in pixels; 'auto' "
        "chooses portrait, square or landscape of as many pixels as 1280x720 has by what is framed, and "
        "sets an object into the picture with room for its shadow #resolution #width #height #quality "
        "#portrait #landscape #crop", default="1280x720, or that of the camera in the file",
        metavar="WxH|auto", read=chosen_size, written=("x", ""), example="1920x1080")] = None
    camera_file: Annotated[Path | None, option("cameras: {cameras}; 'none' passes over cameras that lie "
        "beside the scene, which by default give {beside} #pose #colmap #transforms", default="",
        metavar="FILE|none", action="camera file")] = None
    view: Annotated[int, option("index of the camera in the file #camera #index", ge=0)] = 0
    up: Annotated[Up | None, option("up direction of the scene: +x, -x, +y, -y, +z, -z or three numbers "
        "such as 0,-1,0 #upside #down #flip #rotate #orientation", default="from the header of the file, "
        "else the likely axis, and -y where that is hardly less likely", metavar="AXIS", read=str, make=_up,
        is_signed=True, example="-y")] = None
    azimuth: Annotated[float | None, option("degrees around the scene to the viewer's right, any; 0 is a "
        "view along an axis of the scene #rotate #turn #angle #side", default="30", unit="degrees",
        is_signed=True)] = None
    elevation: Annotated[float | None, option("above the horizon #rotate #angle #above #below #height "
        "#tilt", ge=-90, le=90, default="15 (40 above flat ground)", unit="degrees", is_signed=True)] = None
    side: Annotated[Side | None, option("side that is shown, in place of --azimuth; 'left' and 'right' "
        "are those of who sees the front #rotate #front #back #angle #portrait", flag="--from",
        default="three-quarter", example="left")] = None
    look_at: Annotated[Target | tuple[float, float, float] | None, option("what is in the middle: "
        "'subject', whole, 'scene', with all surroundings, 'part', the upper third of the subject, where "
        "heads are, or a point in world units #center #aim #target #crop #portrait #head", default="subject",
        metavar="X,Y,Z|NAME", read=_look_at, is_signed=True)] = None
    distance: Annotated[float | None, option("from the camera to the point --look-at X,Y,Z, in world units "
        "#near #far #closer", gt=0, default="that from which the subject is seen whole")] = None
    pan: Annotated[tuple[float, float], option("move the camera aside without turning it, right and up, in "
        "shares of the picture #shift #move #crop #center", ge=-MAX_PAN, le=MAX_PAN, metavar="RIGHT,UP",
        is_signed=True)] = (0.0, 0.0)
    roll: Annotated[float, option("degrees by which the scene is turned clockwise in the picture, any "
        "#rotate #tilt #straighten", unit="degrees", is_signed=True)] = 0.0
    fov_y: Annotated[float, option("vertical field of view #lens #focal #length #angle", flag="--fov-deg",
        gt=0, lt=180, unit="degrees")] = radians(50.0)
    zoom: Annotated[float, option("1 shows the whole subject, 2 twice as large #closer #crop #larger #near "
        "#scale", gt=0, example="1.5")] = 1.0
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fixed_size is not None and (broken := size_rule(*self.fixed_size)):
            raise ValueError(f"size {broken}")
        if self.side is not None and self.azimuth is not None:
            raise ValueError(f"azimuth cannot be combined with side {self.side!r}, which is one; omit one")
        if self.side == "top" and self.elevation is not None:
            raise ValueError("elevation cannot be combined with side 'top', which is 90 degrees; omit one")
        if isinstance(self.look_at, tuple) and not all(abs(number) < inf for number in self.look_at):
            raise ValueError(f"look-at must be finite, got {','.join(f'{x:g}' for x in self.look_at)}")
        if self.distance is not None and not isinstance(self.look_at, tuple):
            raise ValueError("distance is that to a point: give the point too, look-at X,Y,Z")

    @property
    def fixed_size(self) -> tuple[int, int] | None:
        """(width, height) in pixels; None where nobody asked for these."""
        return None if self.size == "auto" else self.size


class DrawConfig(Options, frozen=True):
    """How strokes are drawn.

    A `lock` of None is "anchor" in one picture, and "track" along a path; only a path can be tracked. An
    `order` of None is "depth" in one picture, and "soft" along a path. See `project`, `rasterize` and
    `render`.
    """

    GROUP: ClassVar = "drawing"
    # fmt: off
    stroke: Annotated[str, option("built-in stroke (`brushgs strokes` lists them), an image file, or "
        "'gaussian' for the plain 3DGS picture; several with commas between them (flat,dab: long strokes "
        "take the flat brush, short ones dabs), or a folder of images: any of them; image files: "
        "{pictures} #brush #texture #image #shape", metavar="NAME|FILE|FOLDER", example="my_brush.png"
    )] = DEFAULT_STROKE
    stroke_color: Annotated[StrokeColor | None, option("colour of paint where a stroke image has colours: "
        "'scene', that of its stroke; 'mix', that and what differs in the image from its mean; 'own', that "
        "of the image #brush #texture #colour", default="scene, and mix of the marks of a style")] = None
    filter: Annotated[Filter, option("how the stroke image is sampled: 'mip', small strokes do not shimmer, "
        "'bilinear' as published, 'nearest'")] = "mip"
    extent: Annotated[Extent, option("size of strokes: 'fitted' to what the stroke image covers, 'paper': 2 "
        "sigma")] = "fitted"
    background: Annotated[str, option("transparent, '#rrggbb', an image file, scaled to fill the picture, "
        f"or one of {', '.join(COLORS)} #background #transparent #alpha", metavar="COLOR|FILE")] = "white"
    lock: Annotated[Lock | None, option("how strokes get their direction: 'track' chooses it along the "
        "whole path, 'anchor' in each view alone, 'off' as published: strokes flip #flicker #stable",
        default="track along a path, anchor for a picture")] = None
    order: Annotated[Order | None, option("how strokes hide each other: by 'depth', or 'soft': strokes of "
        "nearly equal depth blend, so that none pops #popping #flicker",
        default="depth for a picture, soft along a path")] = None
    underpaint: Annotated[bool, option("a soft copy of each stroke behind it, so that nothing shows between "
        "strokes #holes #gaps")] = True
    streaks: Annotated[float, option("by what share bristles are lighter or darker than their stroke "
        "#bristles #texture", ge=0, le=MAX_STREAKS)] = 0.1
    threads: Annotated[int | None, option("processors to use; the picture does not depend on it #cpu "
        "#speed #cores", ge=1, le=MOST_THREADS, default="all (with several --jobs an equal share each)"
    )] = None
    # fmt: on

    def lock_of(self, *, along_path: bool) -> Lock:
        """The lock of a path, or of one picture.

        Raises:
            ValueError: if it is "track" and there is no path.
        """
        if self.lock == "track" and not along_path:
            raise ValueError(
                "lock must be anchor or off for one picture, got track; only a path can be tracked"
            )
        return self.lock or ("track" if along_path else "anchor")

    def order_of(self, *, along_path: bool) -> Order:
        """The order of a path, or of one picture."""
        return self.order or ("soft" if along_path else "depth")


class PaletteConfig(Options, frozen=True):
    """The palette that the strokes take their colours from."""

    GROUP: ClassVar = "palette"
    ABOUT: ClassVar = "recolor strokes with the mean and covariance of a picture's colours"
    # fmt: off
    file: Annotated[Path, option("picture whose colours are taken: {pictures} #colors #recolor #reference "
        "#painting", flag="--palette", default="", example="monet.jpg")]
    strength: Annotated[float, share("0 keeps the colours of the scene, 1 (or 100%) takes those of the "
        "picture", flag="--palette-strength")] = 1.0
    space: Annotated[ColorSpace, option("colour space of the comparison: 'lab', perceptual, 'linear' "
        "light, 'srgb' as encoded", flag="--palette-space")] = "lab"
    # fmt: on


class PaintConfig(Options, frozen=True):
    """A whole painting, step by step; without a palette strokes keep the colours of the scene.

    The defaults are the plain method: one brush, no ground, no relief; `brushgs.options.look` has others.
    Where only a part is `painted`, the rest is shown as the scene has it.
    """

    prune: PruneConfig = PruneConfig()
    cluster: ClusterConfig = ClusterConfig()
    palette: PaletteConfig | None = None
    view: ViewConfig = ViewConfig()
    draw: DrawConfig = DrawConfig()
    clean: CleanConfig = CleanConfig()
    strokes: StrokesConfig = StrokesConfig()
    brushes: BrushesConfig = BrushesConfig()
    color: ColorConfig = ColorConfig()
    ground: GroundConfig = GroundConfig()
    light: LightConfig = LightConfig()
    media: Medium = Paint()
    style: StyleConfig | None = None
    adjust: AdjustConfig = AdjustConfig()
    rules: Rules | None = None
    painted: WhereConfig | None = None
    hand: HandConfig = HandConfig()
    output: OutputConfig = OutputConfig()

    @classmethod
    def of(cls, values: StepValues) -> Self:
        """The painting of which these fields of these steps are known; the others have their defaults.

        Raises:
            ValueError: if a value is out of range.
        """
        return cls(**{step: _make(STEPS[step], of_step) for step, of_step in values.items() if of_step})

    @property
    def paces(self) -> tuple[Pace, ...]:
        """How a film is made by hand: what is in no part, then the parts of its rules from label 1 on."""
        of_film = Pace(self.hand.hold, self.hand.boil, self.hand.redraw)
        rules = () if self.rules is None else self.rules.rules
        return (of_film, *(rule.pace(of_film) for rule in rules))

    @property
    def is_by_hand(self) -> bool:
        """Whether a film is made by hand in any part."""
        return self.hand.smear > 0 or any(pace != STEADY for pace in self.paces)


def _make(kind: type[Options], values: Mapping[str, Any]) -> Any:
    return medium_of(values) if kind is Medium else getattr(kind, "of", kind)(**values)


# Steps of a painting -> their classes, by the fields of `PaintConfig`.
STEPS: Mapping[str, type[Options]] = MappingProxyType(
    {row.field: row.kinds[0] for row in rows_of(PaintConfig)}
)
