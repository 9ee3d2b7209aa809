"""What a run is asked to do: one small frozen dataclass per step, checked where it is made.

Only the standard library is needed here, so that a command line can be read without loading NumPy.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil, inf, pi
from pathlib import Path
from typing import Literal, get_args

from brushgs.choices import (
    MAX_SIDE,
    BenchFamily,
    ColorSpace,
    Extent,
    Features,
    Filter,
    Lock,
    Merge,
    Method,
    Order,
    Params,
    Weight,
    size_rule,
)
from brushgs.region import Region

DEFAULT_KEEP = 0.7  # of the Gaussians, as published
DEFAULT_STROKES = 7000  # the count the method was published with
DEFAULT_SIZE = (1280, 720)
DEFAULT_FPS = 24.0  # of film
DEFAULT_STEPS, STYLE_STEPS, REFINE_SIZE = 900, 100, (384, 288)  # of a refinement, and one to a style
MAX_FRAMES = 99_999  # more than an hour of film; five digits number them
MAX_PSNR = 100.0  # dB; pictures of 16 bits agree no better
MAX_FPS = 1000.0  # more is a slip of the pen, and video formats count no finer than milliseconds

Up = str | tuple[float, float, float]


@dataclass(frozen=True)
class PruneConfig:
    """Which Gaussians stay.

    Attributes:
        keep: share of the Gaussians that stays, in (0, 1]; those of highest weight. None for 0.7, and for all
            of a file of strokes.
        weight: "contribution" or "paper" (the published intensity), see `prune`.
    """

    keep: float | None = None
    weight: Weight = "contribution"

    def __post_init__(self) -> None:
        if self.keep is not None and not 0 < self.keep <= 1:
            cure = f"; for {self.keep:g} % write {self.keep / 100:g}" if 1 < self.keep <= 100 else ""
            raise ValueError(f"keep must be in (0, 1], got {self.keep:g}{cure}")

    def share(self, *, is_strokes: bool = False) -> float:
        """The share that stays of a scene, or of what are strokes already."""
        if self.keep is not None:
            return self.keep
        return 1.0 if is_strokes else DEFAULT_KEEP


@dataclass(frozen=True)
class ErrorBudget:
    """The fewest strokes that come at least so near to the plain picture.

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
    """Strokes that are typically so long in the picture, see `brushgs.sight.typical_size`.

    Attributes:
        pixels: > 0, at most the longest side that a picture can have.
    """

    pixels: float

    def __post_init__(self) -> None:
        if not 0 < self.pixels <= MAX_SIDE:
            raise ValueError(f"stroke-size must be above 0 and at most {MAX_SIDE} px, got {self.pixels:g} px")

    def __str__(self) -> str:
        return f"{self.pixels:g}px"


Aim = Literal["auto"] | ErrorBudget | StrokeSize  # what a count of strokes is chosen for


@dataclass(frozen=True)
class ClusterConfig:
    """How Gaussians become fewer and larger strokes.

    Attributes:
        strokes: at most so many: a count >= 1, a share of the scene as loaded in (0, 1) given as a
            float, or None for one stroke per Gaussian. Or an aim, for which the count is chosen: "auto" for
            the knee of error over cost (`choose_strokes`), an `ErrorBudget` or a `StrokeSize`.
        features: "balanced" or "paper", see `cluster`.
        merge: "cover" or "paper", see `cluster`.
        method: "auto", "minibatch" or "lloyd", see `cluster`.
        seed: of all the chance in it, 0 to 2^32 - 1.
    """

    strokes: int | float | Aim | None = DEFAULT_STROKES
    features: Features = "balanced"
    merge: Merge = "cover"
    method: Method = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**32:
            raise ValueError(f"seed must be 0 to 4294967295, got {self.seed}")
        if self.strokes is None or isinstance(self.strokes, (ErrorBudget, StrokeSize)):
            return
        if isinstance(self.strokes, str):
            if self.strokes != "auto":
                raise ValueError(f"strokes must be a number, auto, a budget or a size, got {self.strokes!r}")
            return
        is_share = isinstance(self.strokes, float)
        if not (0 < self.strokes <= 1 if is_share else self.strokes >= 1):
            raise ValueError(f"strokes must be a count >= 1 or a share in (0, 100 %], got {self.strokes}")

    @property
    def aim(self) -> Aim | None:
        """What the count is chosen for; None where it is given."""
        return self.strokes if isinstance(self.strokes, (str, ErrorBudget, StrokeSize)) else None

    def num_strokes(self, num_gaussians: int) -> int:
        """The count asked for, given how many Gaussians the scene has as loaded.

        Raises:
            TypeError: if it is an aim, which takes a look at the scene.
        """
        if isinstance(self.strokes, (str, ErrorBudget, StrokeSize)):
            raise TypeError(f"num_strokes: strokes must be a count, a share or None, got {self.strokes}")
        if self.strokes is None:
            return num_gaussians
        if isinstance(self.strokes, float):
            return max(1, ceil(self.strokes * num_gaussians - 1e-9))
        return self.strokes


@dataclass(frozen=True)
class ViewConfig:
    """Where the picture is seen from: a camera from a file, or one framed on the scene.

    Attributes:
        size: (width, height) in pixels; None for the size of the camera in the file, or 1280 x 720.
        camera_file: cameras.json or transforms.json; then the fields below but `view` are not used.
        view: which camera of the file, from 0.
        up: direction that is up in the picture: "+x" to "-z" or three numbers; None for what the
            scene file says, or else -y.
        azimuth: radians, see `frame_scene`.
        elevation: radians above the horizon; None for 15 degrees, or 40 above flat ground.
        fov_y: vertical field of view, radians.
        zoom: 1 shows the subject whole, > 0.
    """

    size: tuple[int, int] | None = None
    camera_file: Path | None = None
    view: int = 0
    up: Up | None = None
    azimuth: float = pi / 6
    elevation: float | None = None
    fov_y: float = 50 * pi / 180
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if self.size is not None and (broken := size_rule(*self.size)):
            raise ValueError(f"size {broken}")
        if self.view < 0:
            raise ValueError(f"view must be 0 or more, got {self.view}")
        if not 0 < self.fov_y < pi:
            raise ValueError(f"fov-deg must be in (0, 180) degrees, got {self.fov_y * 180 / pi:g}")
        if self.elevation is not None and not abs(self.elevation) <= pi / 2:
            raise ValueError(f"elevation must lie in -90 to 90 degrees, got {self.elevation * 180 / pi:g}")
        if not 0 < self.zoom < inf:
            raise ValueError(f"zoom must be above 0, got {self.zoom:g}")


@dataclass(frozen=True)
class PathConfig:
    """Which way the camera goes: around the scene, or as a file says. Exactly one of `orbit` and `file`.

    Attributes:
        orbit: frames of one turn around the scene's up axis, 3 to 99,999, from the framed view on; always
            a loop.
        file: nerfstudio camera_path.json, transforms.json, cameras.json or a COLMAP sparse model. Each
            of its views is a frame, unless `frames` or `seconds` is given: then they are key views, and
            the path goes through them along a smooth curve at an even speed.
        frames: frames along that curve, 2 to 99,999; first and last frame are the ends of an open path.
        seconds: the same as a duration: `seconds` times `fps` frames, and one more where the path is
            open, so that both ends are frames and twice the fps keeps every frame.
        fps: frames a second of the video; None for what the file says, else 24.
        loop: whether the way goes on from the last view to the first. Neither the first frame is
            repeated nor, at the end, a last view that equals it. A camera path may say so itself.
    """

    orbit: int | None = None
    file: Path | None = None
    frames: int | None = None
    seconds: float | None = None
    fps: float | None = None
    loop: bool = False

    def __post_init__(self) -> None:
        if (self.orbit is None) == (self.file is None):
            found = "neither" if self.file is None else "both"
            raise ValueError(f"a camera path must be either an orbit or a path from a file, got {found}")
        if self.orbit is not None and not 3 <= self.orbit <= MAX_FRAMES:
            raise ValueError(f"orbit must be 3 to {MAX_FRAMES} frames, got {self.orbit}")
        for name in ("frames", "seconds"):
            if self.orbit is not None and getattr(self, name) is not None:
                cure = "set fps to change how long it lasts" if name == "seconds" else "leave frames out"
                raise ValueError(
                    f"{name} must not stand beside orbit, which counts the frames itself; {cure}"
                )
        if self.frames is not None and self.seconds is not None:
            raise ValueError("frames must not stand beside seconds, which says it too; give one and fps")
        if self.frames is not None and not 2 <= self.frames <= MAX_FRAMES:
            raise ValueError(f"frames must be 2 to {MAX_FRAMES}, got {self.frames}")
        if self.seconds is not None and not 0 < self.seconds < inf:
            raise ValueError(f"seconds must be above 0, got {self.seconds:g}")
        if self.fps is not None and not 0 < self.fps <= MAX_FPS:
            raise ValueError(f"fps must be above 0 and at most {MAX_FPS:g}, got {self.fps:g}")


@dataclass(frozen=True)
class DrawConfig:
    """How strokes are drawn.

    Attributes:
        stroke: name of a built-in stroke, or an image file.
        filter: "mip", "bilinear" or "nearest", see `rasterize`.
        extent: "fitted" to what the stroke image covers, see `StrokeTexture.fitted_sigmas`, or "paper", 2
            standard deviations whatever it covers.
        background: "white", "black", "transparent", "#rrggbb" or an image file.
        lock: "anchor", "track" or "off", see `project`; None for "anchor" in one picture and "track" along a
            path, which alone can be tracked.
        order: "depth": the nearer stroke hides the other; "soft": strokes of nearly one depth fade into each
            other, so that none jumps in moving pictures, see `render`; None for "depth" in one picture and
            "soft" along a path.
        threads: None takes every processor available; the picture does not depend on it.
    """

    stroke: str = "swirl"
    filter: Filter = "mip"
    extent: Extent = "fitted"
    background: str = "white"
    lock: Lock | None = None
    order: Order | None = None
    threads: int | None = None

    def __post_init__(self) -> None:
        if self.threads is not None and self.threads < 1:
            raise ValueError(f"threads must be at least 1, got {self.threads}")


@dataclass(frozen=True)
class StabilityConfig:
    """What the temporal report measures, see `brushgs.stability`.

    Attributes:
        gaps: frames between the two pictures of a pair, each >= 1, ascending; 1 is always among them.
        pairs: at most so many pairs of a gap are compared, spread evenly over the path, >= 1.
        alone: so many frames are drawn a second time, each alone, >= 0.
    """

    gaps: tuple[int, ...] = (1, 7, 10)
    pairs: int = 40
    alone: int = 3

    def __post_init__(self) -> None:
        if not self.gaps or self.gaps[0] != 1 or any(a >= b for a, b in pairwise(self.gaps)):
            raise ValueError(f"gaps must ascend from 1, got {', '.join(map(str, self.gaps)) or 'none'}")
        if self.pairs < 1:
            raise ValueError(f"pairs must be at least 1, got {self.pairs}")
        if self.alone < 0:
            raise ValueError(f"alone must be 0 or more, got {self.alone}")


@dataclass(frozen=True)
class PaletteConfig:
    """Whose colours the strokes take.

    Attributes:
        file: a picture, usually of a painting.
        strength: share of the way to its colours, in [0, 1].
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
class BenchConfig:
    """What the bench measures, see `brushgs.bench`.

    Attributes:
        families: at least one.
        strokes: counts of the curve of strokes, ascending, each >= 1; those that leave nothing to merge fall
            away, and one stroke per Gaussian that is kept is always the last.
        count: strokes of all other families: that of the counts which is next to it.
        methods: of k-means, that the family of merging compares; at least one.
        repeats: rounds in which every point runs, >= 1; slow ones in three at most.
    """

    families: tuple[BenchFamily, ...] = get_args(BenchFamily)
    strokes: tuple[int, ...] = (125, 250, 500, 1000, 2000, 4000, 8000, 16000, 32000, 64000)
    count: int = 2000
    methods: tuple[Method, ...] = ("auto", "minibatch")
    repeats: int = 5

    @classmethod
    def quick(cls) -> "BenchConfig":
        """One that ends within a minute on a scene of 100,000 Gaussians, at 640 x 360 pixels."""
        return cls(strokes=(250, 1000, 4000, 16000), count=250, methods=("auto",), repeats=3)

    def __post_init__(self) -> None:
        known = get_args(BenchFamily)
        unknown = [name for name in self.families if name not in known]
        if unknown or not self.families:
            found = repr(unknown[0]) if unknown else "none"
            raise ValueError(f"families must be among {', '.join(known)}, got {found}")
        if not self.strokes or self.strokes[0] < 1 or any(a >= b for a, b in pairwise(self.strokes)):
            raise ValueError(
                f"strokes must ascend from 1 or more, got {', '.join(map(str, self.strokes)) or 'none'}"
            )
        for name in ("count", "repeats"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")


@dataclass(frozen=True)
class PaintConfig:
    """A whole painting, step by step; without a palette strokes keep the colours of the scene."""

    prune: PruneConfig = field(default_factory=PruneConfig)
    cluster: ClusterConfig = field(default_factory=ClusterConfig)
    palette: PaletteConfig | None = None
    view: ViewConfig = field(default_factory=ViewConfig)
    draw: DrawConfig = field(default_factory=DrawConfig)


@dataclass(frozen=True)
class RefineConfig:
    """How strokes are refined.

    Attributes:
        style: a picture to come near to; None to come near to the plain picture of the scene.
        params: which numbers of the strokes move, see `brushgs.refine.variables`.
        where: strokes that may change; None for all.
        steps: at most so many, >= 1; None for 900, and 100 toward a style image.
        views: to learn from, >= 1; None for 320 of the scene, or 24 toward a style image.
        size: (width, height) of these views, pixels.
        seed: of the order of the views, 0 or more.
        vgg_weights: torchvision's file of VGG-16 or VGG-19; None for features without weights, unless torch's
            hub has such a file.
        is_resumed: whether a run that was stopped is gone on with.
    """

    style: Path | None = None
    params: Params = "all"
    where: Region | None = None
    steps: int | None = None
    views: int | None = None
    size: tuple[int, int] = REFINE_SIZE
    seed: int = 0
    vgg_weights: Path | None = None
    is_resumed: bool = False

    def __post_init__(self) -> None:
        for name, least in (("steps", 1), ("views", 1), ("seed", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ValueError(f"{name} must be {least} or more, got {value}")
        if broken := size_rule(*self.size):
            raise ValueError(f"size {broken}")
        if self.vgg_weights is not None and self.style is None:
            raise ValueError("vgg-weights must stand beside style: only a style image is matched by features")

    @property
    def most_steps(self) -> int:
        """The steps asked for, or the usual ones."""
        return self.steps or (DEFAULT_STEPS if self.style is None else STYLE_STEPS)


@dataclass(frozen=True)
class SequenceConfig:
    """Where the frames of a sequence are painted, and which.

    Attributes:
        jobs: processes of this machine, >= 1.
        scheduler: address of a Dask scheduler whose workers paint, such as "tcp://host:8786"; None for here.
        is_resumed: whether frames of the same painting that are there already are left as they are.
    """

    jobs: int = 1
    scheduler: str | None = None
    is_resumed: bool = False

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise ValueError(f"jobs must be at least 1, got {self.jobs}")
        if self.jobs > 1 and self.scheduler is not None:
            raise ValueError("jobs must not stand beside scheduler, whose workers paint; leave one out")
