"""Configuration of the commands that measure and refine: stability, bench, refine."""

import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, ClassVar, get_args

from brushgs.options.choices import BenchFamily, Method, Params, StyleLoss, size_rule
from brushgs.options.painting import picture_size
from brushgs.options.styling import StyleConfig, style_config
from brushgs.options.table import Options, hint_for, in_files, option, shown
from brushgs.options.where import Where, WhereConfig

DEFAULT_STEPS, STYLE_STEPS = 900, 100  # steps of a refinement to the scene, and to a style image
REFINE_SIZE = (384, 288)  # pixels
# Default families of a bench: bare strokes, and paintings in a look.
PLAIN_FAMILIES: tuple[BenchFamily, ...] = ("strokes", "merge", "filter", "precision", "sh", "size")
LOOK_FAMILIES: tuple[BenchFamily, ...] = ("strokes", "size", "views", "knobs")
# Families that do not apply to looks -> reason.
NOT_OF_LOOKS: Mapping[BenchFamily, str] = {
    "merge": "it compares bare clusters with the plain picture, and a look adds further coats",
    "filter": "its reference is one coat of strokes; size measures the supersampling of a whole painting",
    "precision": "its reference is one coat of strokes; each painting is verified in float64 anyway",
    "sh": "it measures the plain picture, which no look changes",
}


class StabilityConfig(Options, frozen=True):
    """Options of `brushgs stability`, see `brushgs.measure.stability`.

    `gaps` are the distances of the frames of a pair, ascending from 1.
    """

    gaps: tuple[int, ...] = (1, 7, 10)
    # fmt: off
    pairs: Annotated[int, option("maximum number of frame pairs to compare per gap, spread evenly over the "
        "path; other frames are not painted", ge=1)] = 40
    alone: Annotated[int, in_files("number of frames that are drawn again, each on its own", ge=0
    )] = 3
    skip_alone: Annotated[bool, option("for a moving scene, skip the comparison with frames painted alone: "
        "making new strokes for each takes most of the time")] = False
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.gaps or self.gaps[0] != 1 or any(a >= b for a, b in pairwise(self.gaps)):
            raise ValueError(f"gaps must ascend from 1, got {', '.join(map(str, self.gaps)) or 'none'}")


class BenchConfig(Options, frozen=True):
    """Options of `brushgs bench`, see `brushgs.measure.bench`.

    Stroke counts at or above the number of Gaussians are dropped. Slow points take at most three rounds.
    """

    # fmt: off
    families: Annotated[tuple[BenchFamily, ...] | None, option("curves to measure: any of "
        f"{', '.join(get_args(BenchFamily))}",
        default="all that apply; with a look: strokes, size, views and knobs", metavar="NAME,...")] = None
    strokes: Annotated[tuple[int, ...], option("stroke counts of the first curve, ascending, each 1 or more; "
        "one stroke per kept Gaussian is always added as the last", default="125 to 64000 by doubling",
        metavar="N,...")] = (125, 250, 500, 1000, 2000, 4000, 8000, 16000, 32000, 64000)
    count: Annotated[int, in_files("strokes of all other curves: the nearest of `strokes`", ge=1)] = 2000
    methods: tuple[Method, ...] = ("auto", "minibatch")
    repeats: Annotated[int, option("rounds in which every point is measured", ge=1,
        default="5 (3 with --quick)")] = 5
    # fmt: on

    @classmethod
    def quick(cls) -> "BenchConfig":
        """A bench that takes under a minute for 100,000 Gaussians at 640 x 360 pixels."""
        return cls(strokes=(250, 1000, 4000, 16000), count=250, methods=("auto",), repeats=3)

    def __post_init__(self) -> None:
        super().__post_init__()
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

    def families_of(self, *, has_look: bool) -> tuple[BenchFamily, ...]:
        """The families to measure, for bare strokes or a look.

        Raises:
            ValueError: if a requested one does not apply to looks.
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


# Classes of parameters with a learning rate each, and the parameters in them.
RATE_CLASSES: Mapping[str, tuple[str, ...]] = {
    "place": ("means",),
    "size": ("scales",),
    "direction": ("quats",),
    "opacity": ("opacities",),
    "color": ("sh_base", "sh_rest"),
}
_LAYER = re.compile(r"conv([1-5])(?:_([1-4]))?")


def style_layer(name: str) -> tuple[int, int]:
    """Block and layer of a name such as "conv3_1"; layer 0 for the whole block "conv3".

    Raises:
        ValueError: if it is no such name.
    """
    found = _LAYER.fullmatch(name)
    if found is None:
        raise ValueError(
            f"style-layers must be blocks conv1 to conv5, or layers of them such as conv3_1, got {name!r}"
        )
    return int(found[1]), int(found[2] or 0)


class Rate(Options, frozen=True):
    """A factor on learning rates, above 0 and at most 10: of a class of parameters, or of a region."""

    of: str
    factor: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.factor <= 10:
            raise ValueError(
                f"rates must be factors above 0 and at most 10, got {self.factor:g} of {self.of}; "
                "--params and --where choose what may change at all"
            )

    def __str__(self) -> str:
        return f"{self.of}={self.factor:g}"


def _rates(text: str, between: str = ",") -> tuple[Rate, ...]:
    rates = []
    for part in filter(None, (part.strip() for part in text.split(between))):
        of, equals, number = (word.strip() for word in part.rpartition("="))
        try:
            rates.append(Rate(of, float(number)))
        except ValueError as error:
            if equals and of and "factors" in str(error):
                raise
            raise ValueError(f"must be what=factor, such as color=0.5, got {part!r}") from None
    return tuple(rates)


def _region_rates(text: str) -> tuple[Rate, ...]:
    return _rates(text, ";")


class RefineConfig(Options, frozen=True):
    """Options of refinement.

    Without a `style`, strokes are matched to the plain picture of the scene. Only strokes in `where` change.
    `keeps` names options that the user gave and a style must not replace: "stroke" (the brushes), "direction"
    and "broken_color". `regions` are the parts of `region_rates`, with the cameras and the model that their
    terms need; empty for parts that need none.
    """

    GROUP: ClassVar = "refinement"
    ABOUT: ClassVar = "needs PyTorch: pip install torch"
    # fmt: off
    style: Annotated[StyleConfig | None, option("painting, or style file that was learned from one (`brushgs "
        "style learn`): strokes become its marks, with brushes cut out of it, in its colors; several with "
        "shares and dials as for `brushgs render --style`", metavar="FILE:SHARE", read=StyleConfig.parse,
        make=style_config)] = None
    params: Annotated[Params, option("parameters of the strokes that are fitted: 'color' alone, 'free' all "
        "but opacity, 'all'")] = "all"
    where: WhereConfig | None = None
    steps: Annotated[int | None, option("maximum number of steps", ge=1,
        default=f"{DEFAULT_STEPS} ({STYLE_STEPS} with --style)")] = None
    views: Annotated[int | None, option("number of training views around the scene", ge=1,
        default="320 (24 with --style)")] = None
    size: Annotated[tuple[int, int], option("size of the training views in pixels", metavar="WxH",
        read=picture_size, written=("x", ""))] = REFINE_SIZE
    seed: Annotated[int, in_files("seed of the order of the views", ge=0)] = 0
    rates: Annotated[tuple[Rate, ...], option(f"factors on learning rates, of {', '.join(RATE_CLASSES)}: "
        "color=0.5,size=2", metavar="CLASS=X,...", read=_rates, default="1")] = ()
    region_rates: Annotated[tuple[Rate, ...], option("factors on learning rates of parts of the scene, as "
        "for --where, with semicolons between: 'subject=0.2;height:..10%=0.5'; the first that holds a stroke "
        "counts", metavar="EXPR=X;...", read=_region_rates, default="1", written=(";", ""))] = ()
    weights: Annotated[Path | None, option("folder with torchvision's weights of VGG-16 or VGG-19 "
        "(vgg19-dcbb9e9d.pth, or .safetensors), or the file itself", default="those in torch's cache, else "
        "features without weights")] = None
    style_layers: Annotated[tuple[str, ...], option("layers of the VGG whose features are matched: blocks "
        "conv1 to conv5, or layers of them such as conv3_1", metavar="NAME,...", default="conv3")] = ()
    style_loss: Annotated[StyleLoss, option("how features are matched to the style image: 'nnfm', each to "
        "the nearest, or 'gram', their mean products")] = "nnfm"
    is_resumed: Annotated[bool, option("resume a stopped refinement from the .checkpoint beside the output; "
        "start anew if there is none", flag="--resume")] = False
    # fmt: on
    keeps: tuple[str, ...] = ()
    regions: tuple[WhereConfig, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if broken := size_rule(*self.size):
            raise ValueError(f"size {broken}")
        for name, given in (
            ("weights", self.weights is not None),
            ("style-layers", bool(self.style_layers)),
            ("style-loss", self.style_loss != "nnfm"),
        ):
            if given and self.style is None:
                raise ValueError(f"{name} needs style: only a style image is matched by features")
        for layer in self.style_layers:
            style_layer(layer)
        for rate in self.rates:
            if rate.of not in RATE_CLASSES:
                rule = f"rates must be of {', '.join(RATE_CLASSES)}"
                raise ValueError(f"{rule}, got {shown(rate.of)}{hint_for(rate.of, RATE_CLASSES)}")
        if self.regions and len(self.regions) != len(self.region_rates):
            raise ValueError(f"regions must be as many as region-rates, {len(self.region_rates)}")
        assert len(self.rated_regions) == len(self.region_rates), "each is parsed, or refused, here"

    @property
    def rated_regions(self) -> tuple[WhereConfig, ...]:
        """The parts of `region_rates`."""
        return self.regions or tuple(WhereConfig(Where.parse(rate.of)) for rate in self.region_rates)

    @property
    def parameter_rates(self) -> Mapping[str, float]:
        """Parameter -> factor on its learning rate."""
        return {name: rate.factor for rate in self.rates for name in RATE_CLASSES[rate.of]}

    @property
    def most_steps(self) -> int:
        """`steps`, or the default."""
        return self.steps or (DEFAULT_STEPS if self.style is None else STYLE_STEPS)
