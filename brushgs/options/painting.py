"""Options of a painting: one frozen dataclass per step, which checks its values.

Only the standard library is imported, so that a command line is checked without loading NumPy.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from math import ceil, inf, pi, radians
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, Self, get_args

from brushgs.core.threads import MOST_THREADS
from brushgs.options.choices import (
    MAX_SIDE,
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
    StrokesFor,
    Target,
    Weight,
    check_above_0,
    size_rule,
)
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.look_parts import BrushesConfig, ColorConfig, GroundConfig, LightConfig, MediaConfig
from brushgs.options.output import OutputConfig
from brushgs.options.rules import Rules
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.where import WhereConfig

DEFAULT_KEEP = 0.7  # of the Gaussians, as published
DEFAULT_STROKE = "impasto"  # reads at any size; a swirl under some 20 px looks like a bubble
DEFAULT_SIZE = (1280, 720)
MAX_PAN = 10.0  # pictures: more is a typing error
MAX_PSNR = 100.0  # dB; pictures of 16 bits agree no better
MAX_BROKEN_COLOR = 0.2  # OKLab lightness: more would leave nothing of the scene's own light
MAX_STREAKS = 0.5  # of the core

Up = str | tuple[float, float, float]


@dataclass(frozen=True)
class CleanConfig:
    """What is dropped before anything else; nothing of a file of strokes.

    Attributes:
        floaters: "sure", "strong", "floaters" or "off", see `brushgs.clean`; with "sure" and "strong" also
            what hangs below an object, see `brushgs.passes.reduce.crumbs`.
    """

    floaters: Clean = "sure"

    @property
    def drops_crumbs(self) -> bool:
        """Whether what hangs below an object is dropped."""
        return self.floaters in ("sure", "strong")


@dataclass(frozen=True)
class PruneConfig:
    """Which Gaussians are kept.

    Attributes:
        keep: share of the Gaussians that is kept, in (0, 1]: those of highest weight. None for 0.7, or more
            where too much would be lost (see `prune`), at least as many as strokes are asked for, and all of
            a file of strokes.
        weight: "contribution" or "paper" (the published intensity), see `prune`.
    """

    keep: float | None = None
    weight: Weight = "contribution"

    def __post_init__(self) -> None:
        if self.keep is not None and not 0 < self.keep <= 1:
            cure = (
                f"; for {self.keep:g} % write {self.keep / 100:g} or {self.keep:g}%"
                if 1 < self.keep <= 100
                else ""
            )
            raise ValueError(f"keep must be in (0, 1], got {self.keep:g}{cure}")

    def share(self) -> float:
        """The share of a scene that is kept, without what the default keeps beyond."""
        return DEFAULT_KEEP if self.keep is None else self.keep


@dataclass(frozen=True)
class ErrorBudget:
    """The fewest strokes whose picture reaches a PSNR to the plain picture.

    Attributes:
        psnr: dB, in (0, 100].
    """

    psnr: float

    def __post_init__(self) -> None:
        if not 0 < self.psnr <= MAX_PSNR:
            raise ValueError(f"strokes must be above 0 dB and at most {MAX_PSNR:g} dB, got {self.psnr:g} dB")

    def __str__(self) -> str:
        return f"{self.psnr:g}dB"


@dataclass(frozen=True)
class StrokeSize:
    """Strokes of a typical length in the picture, see `brushgs.stroke_count.view_model.typical_size`.

    Attributes:
        pixels: > 0, at most the longest side that a picture can have.
    """

    pixels: float

    def __post_init__(self) -> None:
        if not 0 < self.pixels <= MAX_SIDE:
            raise ValueError(f"stroke-size must be above 0 and at most {MAX_SIDE} px, got {self.pixels:g} px")

    def __str__(self) -> str:
        return f"{self.pixels:g}px"


@dataclass(frozen=True)
class UsualCount:
    """So many strokes of a scene, and all of a file of strokes: the number of a look, which nobody asked for.

    Attributes:
        count: >= 1.
    """

    count: int

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"strokes must be a count >= 1, got {self.count}")

    def __str__(self) -> str:
        return str(self.count)


StrokeTarget = Knee | ErrorBudget | StrokeSize  # that a number of strokes is chosen for


@dataclass(frozen=True)
class ClusterConfig:
    """How Gaussians become fewer and larger strokes.

    Attributes:
        strokes: maximum number: a count >= 1, a share of the scene as loaded in (0, 1) given as a float, or
            None for one stroke per Gaussian. Or a target that the count is chosen for: "auto" for the knee of
            error over cost (`choose_strokes`), or all of a file of strokes; an `ErrorBudget` or a
            `StrokeSize`. The cost is the time of a painting, and of a film or with "auto:frame" that of a
            frame. A `UsualCount` is a count, but all of a file of strokes.
        features: "balanced" or "paper", see `cluster`.
        merge: "cover" or "paper", see `cluster`.
        method: "auto", "minibatch" or "lloyd", see `cluster`.
        strokes_for: what strokes are made of: "scene", all of it, so that any other view of them fits, or
            "view", only what the picture sees, or the views of a path.
        seed: of the random numbers, 0 to 2^32 - 1.
    """

    strokes: int | float | StrokeTarget | UsualCount | None = "auto"
    features: Features = "balanced"
    merge: Merge = "cover"
    method: Method = "auto"
    strokes_for: StrokesFor = "scene"
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**32:
            raise ValueError(f"seed must be 0 to 4294967295, got {self.seed}")
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
        return replace(self, strokes="auto:frame") if self.strokes == "auto" else self

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


@dataclass(frozen=True)
class StrokesConfig:
    """What strokes are beside clusters of Gaussians; none of it changes a file of strokes.

    Attributes:
        see: "views": small plain pictures of what a painting shows decide where strokes go, where they are
            split, and their colours; "off": the scene alone does.
        focus: where twice as many strokes go to an area, out of the same number; None for nowhere.
        solid: whether faint strokes become crisp paint, see `brushgs.passes.form.solid`.
        direction: which way strokes run within their own plane, see `brushgs.passes.form.orient`.
        broken_color: standard deviation of the lightness by which strokes differ from their neighbours,
            OKLab, 0 to 0.2, see `brushgs.passes.color.broken_color`; 0 for none.
        economy: share in which few large strokes describe what is flat, and marks follow the surface, 0 to 1,
            see `brushgs.passes.form.economy`.
        edges: share in which outlines are lost in the shade and found near the focus, 0 to 1, see
            `brushgs.passes.form.edges`.
    """

    see: See = "views"
    focus: Focus | None = None
    solid: bool = True
    direction: Direction = field(default_factory=lambda: Direction("form"))
    broken_color: float = 0.016
    economy: float = 0.0
    edges: float = 0.0

    def __post_init__(self) -> None:
        for name in ("economy", "edges"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} must be 0 to 1, got {getattr(self, name):g}")
        if not 0 <= self.broken_color <= MAX_BROKEN_COLOR:
            raise ValueError(f"broken-color must be 0 to {MAX_BROKEN_COLOR:g}, got {self.broken_color:g}")

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


@dataclass(frozen=True)
class ViewConfig:
    """The view: a camera from a file, or one framed on the scene by its first view.

    Attributes:
        size: (width, height) in pixels; None for the size of the camera in the file, or 1280 x 720. "auto"
            for one that suits what is framed, which then is set into the picture (see
            `brushgs.cameras.composition`); where the camera moves or is given it counts as None.
        camera_file: in any format of `brushgs.io.cameras.formats`; then only `view` and `size` are used.
        view: which camera of the file, from 0.
        up: direction that is up in the picture: "+x" to "-z" or three numbers; None for that of the scene
            file, or what is known of the scene.
        azimuth: radians, see `frame_scene`; None for that of the first view.
        elevation: radians above the horizon; None for that of the first view: 15 degrees, or 40 above flat
            ground.
        side: the side that is shown, in place of an azimuth; "left" and "right" are those of the viewer of
            the front, "top" is also an elevation, and "three-quarter" is the first view.
        look_at: what is in the middle of the picture: the "subject", whole; the "scene" with all of its
            surroundings; a "part" of the subject, its upper third, where heads are; or a point, world units,
            as far away as the subject is seen from, or `distance`. None for the subject, or the view from
            inside of a scene that is seen so: there azimuth and elevation turn the camera where it stands.
        distance: from the camera to that point, world units, > 0; None for that of the subject.
        pan: (right, up), by which the camera moves aside without turning, in shares of the width and height
            of the picture, each in [-10, 10].
        roll: radians by which the scene is turned clockwise in the picture.
        fov_y: vertical field of view, radians.
        zoom: 1 shows the subject whole, > 0.
    """

    size: tuple[int, int] | Literal["auto"] | None = None
    camera_file: Path | None = None
    view: int = 0
    up: Up | None = None
    azimuth: float | None = None
    elevation: float | None = None
    side: Side | None = None
    look_at: Target | tuple[float, float, float] | None = None
    distance: float | None = None
    pan: tuple[float, float] = (0.0, 0.0)
    roll: float = 0.0
    fov_y: float = radians(50.0)
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if self.fixed_size is not None and (broken := size_rule(*self.fixed_size)):
            raise ValueError(f"size {broken}")
        if self.view < 0:
            raise ValueError(f"view must be 0 or more, got {self.view}")
        if not 0 < self.fov_y < pi:
            raise ValueError(f"fov-deg must be in (0, 180) degrees, got {self.fov_y * 180 / pi:g}")
        if self.elevation is not None and not abs(self.elevation) <= pi / 2:
            raise ValueError(f"elevation must lie in -90 to 90 degrees, got {self.elevation * 180 / pi:g}")
        check_above_0("zoom", self.zoom)
        if self.side is not None and self.azimuth is not None:
            raise ValueError(f"azimuth cannot be combined with side {self.side!r}, which is one; omit one")
        if self.side == "top" and self.elevation is not None:
            raise ValueError("elevation cannot be combined with side 'top', which is 90 degrees; omit one")
        if not all(abs(share) <= MAX_PAN for share in self.pan):
            x, y = self.pan
            raise ValueError(f"pan must be two shares in -{MAX_PAN:g} to {MAX_PAN:g}, got {x:g},{y:g}")
        self._check_aim()

    def _check_aim(self) -> None:
        if isinstance(self.look_at, tuple) and not all(abs(number) < inf for number in self.look_at):
            raise ValueError(f"look-at must be finite, got {','.join(f'{x:g}' for x in self.look_at)}")
        check_above_0("distance", self.distance)
        if self.distance is not None and not isinstance(self.look_at, tuple):
            raise ValueError("distance is that to a point: give the point too, look-at X,Y,Z")

    @property
    def fixed_size(self) -> tuple[int, int] | None:
        """(width, height) in pixels; None where nobody asked for these."""
        return None if self.size == "auto" else self.size


@dataclass(frozen=True)
class DrawConfig:
    """How strokes are drawn.

    Attributes:
        stroke: name of a built-in stroke, or an image file.
        filter: "mip", "bilinear" or "nearest", see `rasterize`.
        extent: "fitted" to what the stroke image covers, see `StrokeTexture.fitted_sigmas`, or "paper", 2
            standard deviations whatever it covers.
        background: the name of a colour (`COLORS`), "transparent", "#rrggbb" or an image file.
        lock: how strokes get their direction: "anchor", "track" or "off", see `project`. None for "anchor" in
            one picture, and "track" along a path; only a path can be tracked.
        order: "depth": the nearer stroke hides the other; "soft": strokes of similar depth fade into each
            other, so that none jumps in moving pictures, see `render`. None for "depth" in one picture, and
            "soft" along a path.
        underpaint: whether a soft copy of each stroke lies behind it, so that nothing shows between strokes.
        streaks: by what share bristles are lighter or darker than their stroke, 0 to 0.5.
        threads: None takes every processor available; the picture does not depend on it.
    """

    stroke: str = DEFAULT_STROKE
    filter: Filter = "mip"
    extent: Extent = "fitted"
    background: str = "white"
    lock: Lock | None = None
    order: Order | None = None
    underpaint: bool = True
    streaks: float = 0.1
    threads: int | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.streaks <= MAX_STREAKS:
            raise ValueError(f"streaks must be 0 to {MAX_STREAKS:g}, got {self.streaks:g}")
        if self.threads is not None and not 1 <= self.threads <= MOST_THREADS:
            raise ValueError(f"threads must be in 1 to {MOST_THREADS}, got {self.threads}")

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


@dataclass(frozen=True)
class PaletteConfig:
    """The palette that the strokes take their colours from.

    Attributes:
        file: a picture, usually of a painting.
        strength: how far colours move to those of the palette, in [0, 1].
        space: where colours are compared: "lab", "linear" or "srgb", see `recolor`.
    """

    file: Path
    strength: float = 1.0
    space: ColorSpace = "lab"

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 1:
            cure = (
                f"; for {self.strength:g} % write {self.strength / 100:g}" if 1 < self.strength <= 100 else ""
            )
            raise ValueError(f"palette-strength must be in [0, 1], got {self.strength:g}{cure}")


@dataclass(frozen=True)
class PaintConfig:
    """A whole painting, step by step; without a palette strokes keep the colours of the scene.

    The defaults are the plain method: one brush, no ground, no relief; `brushgs.options.look` has others.
    Where only a part is `painted`, the rest is shown as the scene has it.
    """

    prune: PruneConfig = field(default_factory=PruneConfig)
    cluster: ClusterConfig = field(default_factory=ClusterConfig)
    palette: PaletteConfig | None = None
    view: ViewConfig = field(default_factory=ViewConfig)
    draw: DrawConfig = field(default_factory=DrawConfig)
    clean: CleanConfig = field(default_factory=CleanConfig)
    strokes: StrokesConfig = field(default_factory=StrokesConfig)
    brushes: BrushesConfig = field(default_factory=BrushesConfig)
    color: ColorConfig = field(default_factory=ColorConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    light: LightConfig = field(default_factory=LightConfig)
    media: MediaConfig = field(default_factory=MediaConfig)
    style: StyleConfig | None = None
    adjust: AdjustConfig = field(default_factory=AdjustConfig)
    rules: Rules | None = None
    painted: WhereConfig | None = None
    output: OutputConfig = field(default_factory=OutputConfig)

    @classmethod
    def of(cls, values: StepValues) -> Self:
        """The painting of which these fields of these steps are known; the others have their defaults.

        Raises:
            ValueError: if a value is out of range.
        """
        return cls(**{step: _make(STEPS[step], of_step) for step, of_step in values.items() if of_step})


def _make(kind: type, values: Mapping[str, Any]) -> Any:
    return getattr(kind, "of", kind)(**values)


def _class_of(kind: Any) -> type:
    """The class of a step, which may be optional."""
    return next(one for one in (kind, *get_args(kind)) if isinstance(one, type) and is_dataclass(one))


# Steps of a painting -> their classes, by the fields of `PaintConfig`.
STEPS: Mapping[str, type] = MappingProxyType(
    {step.name: _class_of(step.type) for step in fields(PaintConfig)}
)
