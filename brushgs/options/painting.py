"""Options of a painting: one class per step, one line per option, see `brushgs.options.table`.

Only the standard library and msgspec are imported: command lines are checked without loading NumPy.
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
from brushgs.options.maps import Map, make_maps, read_maps
from brushgs.options.media import Medium, Paint, medium_of
from brushgs.options.output import OutputConfig
from brushgs.options.overpaint import OverpaintConfig
from brushgs.options.paper import EXAMPLES, PaperSize, sheet_names
from brushgs.options.projection import ProjectionConfig
from brushgs.options.rules import Rules
from brushgs.options.stroke_target import (
    ErrorBudget,
    StrokeSize,
    StrokeTarget,
    UsualCount,
    parse_strokes,
    size_from_text,
    size_value,
    strokes_value,
)
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.table import Options, numbers, option, rows_of, share, shown
from brushgs.options.where import WhereConfig

DEFAULT_KEEP = 0.7  # share of the Gaussians, as published
DEFAULT_STROKE = "impasto"  # works at any size; a swirl below about 20 px looks like a bubble
DEFAULT_SIZE = (1280, 720)
MAX_PAN = 10.0  # in picture sizes: more is a typing error
MAX_BROKEN_COLOR = 0.2  # OKLab lightness: more would drown the scene's own light
MAX_STREAKS = 0.5  # limit of the core

Up = str | tuple[float, float, float]


def picture_size(text: str) -> tuple[int, int]:
    """Parse (width, height) in pixels from a text such as "1280x720"."""
    match = re.fullmatch(r"([0-9]{1,18})[xX]([0-9]{1,18})", text)
    if match is None:
        raise ValueError(f"must be WIDTHxHEIGHT in pixels such as 1280x720, got {text!r}")
    size = int(match[1]), int(match[2])
    if broken := size_rule(*size):
        raise ValueError(broken)
    return size


def chosen_size(text: str) -> tuple[int, int] | PaperSize | Literal["auto"]:
    """Parse (width, height) in pixels as `picture_size` does, a size on paper, or "auto"."""
    if text == "auto":
        return "auto"
    if "@" in text:
        return PaperSize.of(text)
    try:
        return picture_size(text)
    except ValueError as error:
        if re.search(r"(mm|cm|in)$|^[AB][0-9]|^(letter|legal|tabloid)", text, re.IGNORECASE):
            raise ValueError(f"must name the pixels per inch too, {text}@300, got {text!r}") from None
        more = f"; or auto, or a size on paper such as {EXAMPLES}"
        raise ValueError(f"{error}{more}" if "x" not in text.lower() else str(error)) from None


def _look_at(text: str) -> str | tuple[float, ...]:
    """Parse a value of `ViewConfig.look_at`."""
    if text in get_args(Target):
        return text
    try:
        return numbers(text, 3)
    except ValueError:
        names = ", ".join(get_args(Target))
        raise ValueError(f"must be {names} or three numbers such as 0,1.5,-2, got {text!r}") from None


def _up(given: Any) -> str:
    """Convert three numbers from Python to the text of an up axis."""
    if isinstance(given, list | tuple) and len(given) == 3:
        return ",".join(repr(float(one)) for one in given)
    raise ValueError(f"must be an axis such as -y, or three numbers, got {shown(given)}")


class CleanConfig(Options, frozen=True):
    """What is dropped before painting; nothing is dropped from stroke files."""

    GROUP: ClassVar = "clustering"
    # fmt: off
    floaters: Annotated[Clean, option("what to drop: 'sure' (clearly detached floaters, and crumbs below an "
        "object), 'strong' (closer floaters too; loses some thin leaves), 'floaters' (as 'sure', without "
        "crumbs) or 'off' #floaters #noise #remove #artefacts",
        flag="--clean")] = "sure"
    # fmt: on

    @property
    def drops_crumbs(self) -> bool:
        """Whether crumbs below an object are dropped."""
        return self.floaters in ("sure", "strong")


class PruneConfig(Options, frozen=True):
    """Which Gaussians are kept."""

    GROUP: ClassVar = "pruning"
    # fmt: off
    keep: Annotated[float | None, option("share of Gaussians to keep, by weight, such as 0.7 or 70% #prune "
        "#fewer #reduce", gt=0, le=1, takes_percent=True,
        default=f"{DEFAULT_KEEP:g} (more if the others contribute much or each becomes a stroke; 1 for "
        "stroke files, and with --stroke gaussian without --preset)")] = None
    weight: Annotated[Weight, option("weight of a Gaussian: 'contribution' to pictures (opacity, area and "
        "visibility), or 'paper' (intensity, as published)")] = "contribution"
    # fmt: on

    def share(self) -> float:
        """The share of Gaussians to keep, before the default's exceptions."""
        return DEFAULT_KEEP if self.keep is None else self.keep


class StrokeSizeFlag(Options, frozen=True):
    """`--stroke-size`, the second flag of `ClusterConfig.strokes`."""

    GROUP: ClassVar = "clustering"
    # fmt: off
    strokes: Annotated[StrokeSize | None, option("typical length of strokes in the picture such as 24px, or "
        "8mm with a --size on paper, above 0; replaces --strokes #brush #size #thick #thin #width #large "
        "#small #mm", flag="--stroke-size", metavar="PX|MM", read=size_from_text, make=size_value,
        alone="strokes", example="24px")] = None
    # fmt: on


class ClusterConfig(Options, frozen=True):
    """Clustering of Gaussians to fewer, larger strokes.

    `strokes` is a count >= 1; a float in (0, 1], the share of the scene as loaded; None for one stroke per
    Gaussian; or a target: "auto" for the knee of error over cost (`choose_strokes`), an `ErrorBudget` or a
    `StrokeSize`. Cost is the time of a painting, or of a frame for films and "auto:frame". "auto" and a
    `UsualCount` keep all strokes of a stroke file.
    """

    GROUP: ClassVar = "clustering"
    # fmt: off
    strokes: Annotated[int | float | StrokeTarget | UsualCount | None, option("number of strokes, 1 or more; "
        "a share of the scene as loaded such as 10%; all; auto: the knee of error over painting time, for "
        "films over frame time (auto:frame: always over frame time); 24dB: the fewest that reach this PSNR "
        "to the plain picture, above 0 and at most 100 #number #count #detail #quality", default="auto",
        metavar="COUNT|PERCENT|all|auto|DB", read=parse_strokes, make=strokes_value,
        alone="strokes", example="2000")] = "auto"
    features: Annotated[Features, option("features by which Gaussians are compared: 'balanced' (independent "
        "of the scene's unit) or 'paper' (as published)")] = "balanced"
    merge: Annotated[Merge, option("how Gaussians merge: 'cover' (keeps the painted area) or 'paper' (plain "
        "means)")] = "cover"
    method: Annotated[Method, option(
        "k-means: " + ", ".join(f"'{name}' {words}" for name, words in METHODS.items()), default="")] = "auto"
    strokes_for: Annotated[StrokesFor, option("'scene': make strokes of the whole scene, for any view; "
        "'view': spend all strokes on what this picture or path sees")] = "scene"
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
        """The target of a chosen count; None if the count is given."""
        return self.strokes if isinstance(self.strokes, (str, ErrorBudget, StrokeSize)) else None

    @property
    def cost(self) -> Cost:
        """The cost of the knee."""
        return "frame" if self.strokes == "auto:frame" else "painting"

    @property
    def of_film(self) -> "ClusterConfig":
        """The options for a film: "auto" becomes "auto:frame"."""
        return msgspec.structs.replace(self, strokes="auto:frame") if self.strokes == "auto" else self

    @property
    def keeps_strokes(self) -> bool:
        """Whether all strokes of a stroke file are kept, because the user gave no number."""
        return isinstance(self.strokes, str | UsualCount)

    @property
    def asked_count(self) -> int | None:
        """The number of strokes; None if it depends on the scene."""
        count = self.strokes.count if isinstance(self.strokes, UsualCount) else self.strokes
        return count if isinstance(count, int) else None

    def num_strokes(self, num_gaussians: int) -> int:
        """The count, given the number of Gaussians in the scene as loaded.

        Raises:
            TypeError: if it is a target.
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
    """What is done to strokes beyond clustering; stroke files are not changed.

    See `brushgs.passes.form` for each.
    """

    GROUP: ClassVar = "strokes"
    ABOUT: ClassVar = (
        "beyond clustering; stroke files are painted unchanged. --preset paper and --stroke gaussian switch "
        "these off, and --underpaint and --streaks"
    )
    # fmt: off
    see: Annotated[See, option("'views': small plain pictures of the scene decide the placement, splitting "
        "and colors of strokes; 'off': the scene alone decides")] = "views"
    focus: Annotated[Focus | None, option("region with higher stroke density; the total stays: 'auto' "
        "(faces, hands and salient parts, up to eight times as dense), or twice as dense: 'subject', a "
        "sphere in world units, or the light part of a picture of the same view #detail #face",
        default="that of the look, off in plain", metavar="auto|off|subject|X,Y,Z,R|FILE",
        read=Focus.of, is_signed=True)] = None
    solid: Annotated[bool, option("make faint strokes smaller and opaque, like paint #opaque"
    )] = True
    direction: Annotated[Direction, option("direction of strokes: 'own' (as clustered), 'form' (along shapes "
        "and edges), 'color' (along color edges), as the brush marks of a painting, or along guide lines in "
        "space #orientation #flow", metavar="own|form|color|painting:FILE|guides:FILE",
        read=Direction.of)] = Direction("form")
    broken_color: Annotated[float, option("lightness variation between neighboring strokes, OKLab "
        "#variation", ge=0, le=MAX_BROKEN_COLOR)] = 0.016
    economy: Annotated[float, share("how far flat areas get few large strokes, and the strokes saved go to "
        "accents of light and dark #loose #abstract #simple", default="that of the look")] = 0.0
    edges: Annotated[float, share("how far outlines are lost in shade and crisp near the focus; 0: all hard "
        "#soft #blur #outline", default="that of the look")] = 0.0
    depth_of_field: Annotated[float, share("how far detail is lost before and behind the focus, or without "
        "one the subject: strokes grow up to threefold, soften, and lose contrast #blur #bokeh #aperture "
        "#defocus #distance")] = 0.0
    maps: Annotated[tuple[Map, ...], option("change size, density, opacity, chroma, relief (height of the "
        "paint) or edge (how far outlines are lost) of strokes by a factor, or hold (frames of a film): LOW "
        "where a picture of the first view is black, HIGH where it is white; outside and inside a part, such "
        "as subject or height:20%.. (EXPR of `brushgs refine --where`); or where a column of the PLY file is "
        "low and high; repeatable; by default 0.5..2 for size and density, 0..1 for opacity and "
        "edge, 0..2 for chroma and relief, 1..2 for hold #mask #local #column", flag="--map", default="none",
        metavar="PROPERTY=FILE|EXPR|column:NAME[:LOW..HIGH]", read=read_maps,
        make=make_maps, action="append")] = ()
    # fmt: on

    @classmethod
    def of(cls, **fields: Any) -> "StrokesConfig":
        """Make a config; the direction may be text, as in presets."""
        if isinstance(fields.get("direction"), str):
            fields["direction"] = Direction.of(fields["direction"])
        return cls(**fields)

    @classmethod
    def off(cls) -> "StrokesConfig":
        """All off: strokes as clustered."""
        return cls.of(**PLAIN_STROKES)

    @property
    def files(self) -> tuple[Path, ...]:
        """Input files beside the scene: the focus mask, the file of the direction, and pictures of maps."""
        mask = None if self.focus is None else self.focus.mask
        sources = (one.source for one in self.maps)
        return tuple(path for path in (mask, self.direction.file, *sources) if isinstance(path, Path))


class ViewConfig(Options, frozen=True):
    """The view: a camera from a file, or one framed on the scene by its first view.

    Angles are radians here, degrees in flags. `size` None is the size of the camera in the file, or
    1280 x 720; with "auto", or paper of free orientation, the subject decides the shape of the picture and is
    composed in it (see `brushgs.cameras.composition`); for moving or given cameras "auto" counts as None.
    With a `camera_file`, only `view` (the index in the file) and `size` are used. `look_at` None is the
    subject; in scenes seen from inside, azimuth and elevation turn the camera in place instead.
    """

    GROUP: ClassVar = "view"
    ABOUT: ClassVar = "framed on the scene, or a camera from a file"
    # fmt: off
    size: Annotated[tuple[int, int] | PaperSize | Literal["auto"] | None, option("picture size in pixels; "
        "'auto' chooses portrait, square or landscape with as many pixels as 1280x720, and composes an "
        "object with room for its shadow; or on paper, with pixels per inch: A3@300 (turned and composed "
        f"likewise; {sheet_names()}), A3-portrait@300, 40x30cm@200 #resolution #width #height #quality "
        "#portrait #landscape #crop #print #dpi #paper",
        default="1280x720, or that of the camera in the file", metavar="WxH|PAPER@DPI|auto",
        read=chosen_size, written=("x", ""), example="1920x1080")] = None
    camera_file: Annotated[Path | None, option("camera file: {cameras}; 'none' ignores camera files beside "
        "the scene, which by default give {beside} #pose #colmap #transforms", default="",
        metavar="FILE|none", action="camera file")] = None
    view: Annotated[int, option("index of the camera in the file #camera #index", ge=0)] = 0
    up: Annotated[Up | None, option("up axis of the scene: +x, -x, +y, -y, +z, -z or three numbers such as "
        "0,-1,0 #upside #down #flip #rotate #orientation",
        default="from the file's header, else estimated, with a preference for -y", metavar="AXIS", read=str,
        make=_up, is_signed=True, example="-y")] = None
    azimuth: Annotated[float | None, option("camera position around the scene, degrees to the viewer's "
        "right; 0 looks along an axis of the scene #rotate #turn #angle #side", default="30", unit="degrees",
        is_signed=True)] = None
    elevation: Annotated[float | None, option("camera elevation above the horizon #rotate #angle #above "
        "#below #height #tilt", ge=-90, le=90, default="15 (40 above flat ground)", unit="degrees",
        is_signed=True)] = None
    side: Annotated[Side | None, option("side of the subject to show, in place of --azimuth; 'left' and "
        "'right' as seen facing its front #rotate #front #back #angle #portrait", flag="--from",
        default="three-quarter", example="left")] = None
    look_at: Annotated[Target | tuple[float, float, float] | None, option("what to frame: 'subject', 'scene' "
        "(with all surroundings), 'part' (the upper third of the subject, where heads are), or a point in "
        "world units to center #center #aim #target #crop #portrait #head", default="subject",
        metavar="X,Y,Z|NAME", read=_look_at, is_signed=True)] = None
    distance: Annotated[float | None, option("from the camera to the point of --look-at X,Y,Z, world units "
        "#near #far #closer", gt=0, default="that which shows the whole subject")] = None
    pan: Annotated[tuple[float, float], option("move the camera right and up without turning it, in shares "
        "of the picture #shift #move #crop #center", ge=-MAX_PAN, le=MAX_PAN, metavar="RIGHT,UP",
        is_signed=True)] = (0.0, 0.0)
    roll: Annotated[float, option("rotation of the scene in the picture, degrees clockwise #rotate #tilt "
        "#straighten", unit="degrees", is_signed=True)] = 0.0
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
        """(width, height) in pixels; None if "auto" or not given."""
        if isinstance(self.size, PaperSize):
            return self.size.pixels
        return None if isinstance(self.size, str) else self.size

    @property
    def dpi(self) -> float | None:
        """Pixels per inch on paper; None without a size on paper."""
        return self.size.dpi if isinstance(self.size, PaperSize) else None

    @property
    def is_composable(self) -> bool:
        """Whether the subject decides how the picture lies."""
        return self.size == "auto" or (isinstance(self.size, PaperSize) and self.size.is_free)


class DrawConfig(Options, frozen=True):
    """Drawing of strokes.

    For `lock` None see `lock_of`; only paths can be tracked. `order` None is "depth" for one picture and
    "soft" along a path, where strokes around a subject have one order in all frames. See `project`,
    `rasterize` and `render`.
    """

    GROUP: ClassVar = "drawing"
    # fmt: off
    stroke: Annotated[str, option("built-in stroke (`brushgs strokes` lists them), an image file, or "
        "'gaussian' for the plain 3DGS picture; several separated by commas (flat,dab: long strokes get the "
        "flat brush, short ones dabs), or a folder of images to choose from; image files: {pictures} #brush "
        "#texture #image #shape", metavar="NAME|FILE|FOLDER", example="my_brush.png"
    )] = DEFAULT_STROKE
    stroke_color: Annotated[StrokeColor | None, option("color of paint where a stroke image has colors: "
        "'scene', that of its stroke; 'mix', that and what differs in the image from its mean; 'own', that "
        "of the image #brush #texture #color", default="scene, and mix of the marks of a style")] = None
    filter: Annotated[Filter, option("how the stroke image is sampled: 'mip', small strokes do not shimmer, "
        "'bilinear' as published, 'nearest'")] = "mip"
    extent: Annotated[Extent, option("size of strokes: 'fitted' to what the stroke image covers, 'paper': 2 "
        "sigma")] = "fitted"
    background: Annotated[str, option("transparent, '#rrggbb', an image file, scaled to fill the picture, "
        f"or one of {', '.join(COLORS)} #background #transparent #alpha", metavar="COLOR|FILE")] = "white"
    lock: Annotated[Lock | None, option("how stroke direction is fixed: 'track' (over the whole path), "
        "'canonical' (by a field of directions fitted to each stroke: all pictures and pages of a painting "
        "agree; on a path, films agree with them and flicker a little more), 'anchor' (in each view alone, "
        "by the longest axis) or 'off' (as published: strokes flip) #flicker #stable",
        default="track along a path, canonical for pictures, pages and spheres")] = None
    order: Annotated[Order | None, option("occlusion of strokes: by 'depth', or 'soft' (strokes of nearly "
        "equal depth blend, so that none pops) #popping #flicker",
        default="depth for a picture; soft along a path, but for what surrounds a subject: its strokes keep "
        "one order")] = None
    underpaint: Annotated[bool, option("draw a soft copy of each stroke behind it, to close gaps #holes "
        "#gaps")] = True
    streaks: Annotated[float, option("lightness variation of bristles within a stroke #bristles #texture",
        ge=0, le=MAX_STREAKS)] = 0.1
    threads: Annotated[int | None, option("number of threads; the picture does not depend on it #cpu #speed "
        "#cores", ge=1, le=MOST_THREADS, default="all (with several --jobs an equal share each)"
    )] = None
    # fmt: on

    def lock_of(self, *, along_path: bool, is_spherical: bool = False) -> Lock:
        """The effective lock of an output.

        Args:
            along_path: whether for the frames of a path; else for pictures, or pages, which show a painting
                from all sides.
            is_spherical: whether for spherical pictures, whose views cannot be tracked in one picture.

        Raises:
            ValueError: if it is "track" without a path.
        """
        if self.lock == "track" and not along_path:
            raise ValueError(
                "lock must be anchor, canonical or off for one picture, got track; only a path can be tracked"
            )
        return self.lock or ("track" if along_path and not is_spherical else "canonical")

    def order_of(self, *, along_path: bool) -> Order:
        """The effective order, for the frames of a path or for one picture."""
        return self.order or ("soft" if along_path else "depth")


class PaletteConfig(Options, frozen=True):
    """Recoloring by the palette of a picture."""

    GROUP: ClassVar = "palette"
    ABOUT: ClassVar = "recolor strokes to the mean and covariance of a picture's colors"
    # fmt: off
    file: Annotated[Path, option("picture that gives the colors: {pictures} #colors #recolor #reference "
        "#painting", flag="--palette", default="", example="monet.jpg")]
    strength: Annotated[float, share("0 keeps the colors of the scene, 1 (or 100%) takes those of the "
        "picture", flag="--palette-strength")] = 1.0
    space: Annotated[ColorSpace, option("color space of the match: 'lab' (perceptual), 'linear' (light) or "
        "'srgb' (as encoded)", flag="--palette-space")] = "lab"
    # fmt: on


class PaintConfig(Options, frozen=True):
    """All options of a painting, by step.

    The defaults are the plain method: one brush, scene colors, no ground, no relief; looks (see
    `brushgs.options.look`) have others. With `painted`, only that part of the scene is painted and the rest
    is shown as plain Gaussians.
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
    overpaint: OverpaintConfig = OverpaintConfig()
    hand: HandConfig = HandConfig()
    output: OutputConfig = OutputConfig()
    projection: ProjectionConfig = ProjectionConfig()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.projection.is_plain:
            return
        usual = self.projection.usual_size
        if usual is not None and self.view.fixed_size is None:
            msgspec.structs.force_setattr(self, "view", msgspec.structs.replace(self.view, size=usual))
        self.projection.check_with(self)

    @classmethod
    def of(cls, values: StepValues) -> Self:
        """Make a config from step -> field -> value; other fields have their defaults.

        Raises:
            ValueError: if a value is out of range.
        """
        return cls(**{step: _make(STEPS[step], of_step) for step, of_step in values.items() if of_step})

    @property
    def in_pixels(self) -> Self:
        """The options with a stroke size in millimeters converted to pixels.

        Raises:
            ValueError: if there is no size on paper.
        """
        size = self.cluster.strokes
        if not isinstance(size, StrokeSize) or not size.is_mm:
            return self
        replace = msgspec.structs.replace
        return replace(self, cluster=replace(self.cluster, strokes=size.at(self.view.dpi)))

    @property
    def paces(self) -> tuple[Pace, ...]:
        """Unsteadiness of a film: outside all parts, then for the parts of the rules from label 1 on."""
        of_film = Pace(self.hand.hold, self.hand.boil, self.hand.redraw)
        rules = () if self.rules is None else self.rules.rules
        return (of_film, *(rule.pace(of_film) for rule in rules))

    @property
    def is_by_hand(self) -> bool:
        """Whether any part of a film is unsteady, see `HandConfig`."""
        is_mapped = any(one.name == "hold" for one in self.strokes.maps)
        return is_mapped or self.hand.smear > 0 or any(pace != STEADY for pace in self.paces)


def _make(kind: type[Options], values: Mapping[str, Any]) -> Any:
    return medium_of(values) if kind is Medium else getattr(kind, "of", kind)(**values)


# Fields of `PaintConfig` -> their classes.
STEPS: Mapping[str, type[Options]] = MappingProxyType(
    {row.field: row.kinds[0] for row in rows_of(PaintConfig)}
)
