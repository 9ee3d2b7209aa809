"""What the commands that measure and refine are asked to do: bench, stability, refine."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import get_args

from brushgs.options.choices import BenchFamily, Method, Params, size_rule
from brushgs.options.region import Region

DEFAULT_STEPS, STYLE_STEPS, REFINE_SIZE = 900, 100, (384, 288)  # of a refinement, and one to a style


@dataclass(frozen=True)
class StabilityConfig:
    """What the temporal report measures, see `brushgs.measure.stability`.

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
class BenchConfig:
    """What the bench measures, see `brushgs.measure.bench`.

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
