"""Configuration of the commands that measure and refine: stability, bench, refine."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import get_args

from brushgs.options.choices import BenchFamily, Method, Params, size_rule
from brushgs.options.where import WhereConfig

DEFAULT_STEPS, STYLE_STEPS = 900, 100  # of a refinement to the scene, and to a style image
REFINE_SIZE = (384, 288)  # pixels
# What a bench measures where nobody says: of bare strokes, and of paintings in a look.
PLAIN_FAMILIES: tuple[BenchFamily, ...] = ("strokes", "merge", "filter", "precision", "sh", "size")
LOOK_FAMILIES: tuple[BenchFamily, ...] = ("strokes", "size", "views", "knobs")
# Families that no look has -> why.
NOT_OF_LOOKS: Mapping[BenchFamily, str] = {
    "merge": "it compares bare clusters with the plain picture, and a look lays more over them",
    "filter": "its truth is of one coat of strokes; size has the supersampling of a whole painting",
    "precision": "its truth is of one coat of strokes; each painting is verified in float64 anyway",
    "sh": "it is of the plain picture, which no look changes",
}


@dataclass(frozen=True)
class StabilityConfig:
    """What `brushgs stability` measures, see `brushgs.measure.stability`.

    Attributes:
        gaps: frames between the two pictures of a pair, ascending, the first is 1.
        pairs: maximum number of pairs compared at each gap, spread evenly over the path, >= 1.
        alone: number of frames that are drawn a second time, each on its own, >= 0.
        skip_alone: of a moving scene, whether the configuration `alone` is omitted: making strokes anew for
            each frame takes most of the time.
    """

    gaps: tuple[int, ...] = (1, 7, 10)
    pairs: int = 40
    alone: int = 3
    skip_alone: bool = False

    def __post_init__(self) -> None:
        if not self.gaps or self.gaps[0] != 1 or any(a >= b for a, b in pairwise(self.gaps)):
            raise ValueError(f"gaps must ascend from 1, got {', '.join(map(str, self.gaps)) or 'none'}")
        if self.pairs < 1:
            raise ValueError(f"pairs must be at least 1, got {self.pairs}")
        if self.alone < 0:
            raise ValueError(f"alone must be 0 or more, got {self.alone}")


@dataclass(frozen=True)
class BenchConfig:
    """What `brushgs bench` measures, see `brushgs.measure.bench`.

    Attributes:
        families: curves to measure, at least one; None for all that apply, see `families_of`.
        strokes: counts of the curve of strokes, ascending, each >= 1. Counts that leave nothing to merge are
            dropped; one stroke per Gaussian that is kept is always the last.
        count: strokes of all other curves: the nearest of `strokes` is used, or the number of a look.
        methods: of k-means, compared by the curve of merging; at least one.
        repeats: rounds in which every point is measured, >= 1; slow points take at most three.
    """

    families: tuple[BenchFamily, ...] | None = None
    strokes: tuple[int, ...] = (125, 250, 500, 1000, 2000, 4000, 8000, 16000, 32000, 64000)
    count: int = 2000
    methods: tuple[Method, ...] = ("auto", "minibatch")
    repeats: int = 5

    @classmethod
    def quick(cls) -> "BenchConfig":
        """A bench of less than a minute on 100,000 Gaussians at 640 x 360 pixels."""
        return cls(strokes=(250, 1000, 4000, 16000), count=250, methods=("auto",), repeats=3)

    def __post_init__(self) -> None:
        known = get_args(BenchFamily)
        families = known if self.families is None else self.families
        unknown = [name for name in families if name not in known]
        if unknown or not families:
            found = repr(unknown[0]) if unknown else "none"
            raise ValueError(f"families must be among {', '.join(known)}, got {found}")
        if not self.strokes or self.strokes[0] < 1 or any(a >= b for a, b in pairwise(self.strokes)):
            raise ValueError(
                f"strokes must ascend from 1 or more, got {', '.join(map(str, self.strokes)) or 'none'}"
            )
        for name in ("count", "repeats"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")

    def families_of(self, *, has_look: bool) -> tuple[BenchFamily, ...]:
        """The families of a scene that is painted in bare strokes, or in a look.

        Raises:
            ValueError: if one is asked for that no look has.
        """
        if self.families is None:
            return LOOK_FAMILIES if has_look else PLAIN_FAMILIES
        for name in self.families:
            if has_look and name in NOT_OF_LOOKS:
                others = ", ".join(LOOK_FAMILIES)
                raise ValueError(
                    f"families must not have {name} in a look: {NOT_OF_LOOKS[name]}; a look has {others}"
                )
        return self.families


@dataclass(frozen=True)
class RefineConfig:
    """How strokes are refined.

    Attributes:
        style: style image to match, or a style file; None to match the plain picture of the scene.
        params: which parameters of the strokes are fitted, see `brushgs.refine.variables`.
        where: strokes that may change; None for all.
        steps: maximum number, >= 1; None for 900, or 100 with a style image.
        views: number of training views, >= 1; None for 320, or 24 with a style image.
        size: (width, height) of the training views, pixels.
        seed: of the order of the views, >= 0.
        vgg_weights: torchvision's weights of VGG-16 or VGG-19; None for those in torch's cache, or else for
            features without weights.
        is_resumed: whether to resume a run that was stopped.
        keeps: what a style does not decide, since somebody asked for it: "stroke" (the brushes), "direction"
            and "broken_color".
    """

    style: Path | None = None
    params: Params = "all"
    where: WhereConfig | None = None
    steps: int | None = None
    views: int | None = None
    size: tuple[int, int] = REFINE_SIZE
    seed: int = 0
    vgg_weights: Path | None = None
    is_resumed: bool = False
    keeps: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, least in (("steps", 1), ("views", 1), ("seed", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ValueError(f"{name} must be {least} or more, got {value}")
        if broken := size_rule(*self.size):
            raise ValueError(f"size {broken}")
        if self.vgg_weights is not None and self.style is None:
            raise ValueError("vgg-weights needs style: only a style image is matched by features")

    @property
    def most_steps(self) -> int:
        """`steps`, or the default."""
        return self.steps or (DEFAULT_STEPS if self.style is None else STYLE_STEPS)
