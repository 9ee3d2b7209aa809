"""Choices of options, presets and picture limits: all that `--help` needs.

Importing this is cheaper than importing the option classes.
"""

from collections.abc import Mapping
from typing import Any, Literal

Weight = Literal["contribution", "paper"]
Features = Literal["balanced", "paper"]
Merge = Literal["cover", "paper"]
Method = Literal["auto", "lloyd", "minibatch"]
StrokesFor = Literal["scene", "view"]  # strokes of the whole scene, or of its visible part
Filter = Literal["mip", "bilinear", "nearest"]
Extent = Literal["fitted", "paper"]
StrokeColor = Literal["own", "scene", "mix"]  # source of the color of paint
ViewLock = Literal["anchor", "off"]  # for a single view
Lock = Literal["track", "anchor", "canonical", "off"]  # for a single view or a path
Order = Literal["depth", "soft"]
Blend = Literal["cover", "glaze"]
Side = Literal[
    "front", "left", "back", "right", "top", "three-quarter"
]  # side of the subject that a view shows
Target = Literal["subject", "scene", "part"]  # what a view is framed on
ColorSpace = Literal["lab", "linear", "srgb"]  # for palette matching
Knee = Literal["auto", "auto:frame"]  # automatic stroke count: cost by `Cost`, or always by frame
Cost = Literal["frame", "painting"]  # time of one of many frames, or of a whole painting
BenchFamily = Literal["strokes", "merge", "filter", "precision", "sh", "size", "views", "knobs"]
# Dropped: nothing; detached floaters; also crumbs below an object; also closer floaters.
Clean = Literal["off", "floaters", "sure", "strong"]
Params = Literal["color", "free", "all"]  # stroke parameters that refinement fits
StyleLoss = Literal["nnfm", "gram"]  # how features are matched to a style image
See = Literal["views", "off"]  # whether views of the scene influence the strokes
Canvas = Literal["none", "linen", "paper"]  # texture under the paint
Medium = Literal["paint", "charcoal", "ink", "hatching", "stippling", "watercolour"]  # painting medium
StageTone = Literal["auto", "light", "dark"]  # wall of a stage
Codec = Literal["h264", "h265", "prores", "vp9"]  # video codec
# Color spaces of a file; see formats/pictures/exr/planes.py.
FileSpace = Literal["lin_srgb", "srgb", "acescg", "aces2065_1", "lin_rec2020", "lin_p3d65"]

# Built-in looks (files in brushgs/looks), in listing order.
LOOKS = (
    *("oil", "impressionist", "gouache", "watercolour", "charcoal", "ink", "hatching", "stippling"),
    "plain",
)
DEFAULT_LOOK, PLAIN_LOOK = "oil", "plain"
# Strokes of a backdrop: count for looks without one of their own, and the limit.
DEFAULT_BACKDROP, MAX_BACKDROP = 2500, 20_000
# Layers of a picture for compositing -> description. `Frame.layers` documents how they are stored in memory,
# `brushgs.formats.pictures.exr` how they are written.
LAYERS: Mapping[str, str] = {
    "depth": "distance along the camera axis, world units: mean over strokes, weighted by visibility",
    "normal": "normals of the stroke planes, camera axes",
    "motion": "motion of the paint to the next frame, pixels, by strokes and camera",
    "stroke": "Cryptomatte of single strokes",
    "uv": "position on the most visible stroke, 0 to 1 along and across it",
    "height": "height of the paint, pixels; only if the look has relief",
    "id": "Cryptomattes by brush, by region (--rules) and by layer of paint (--look)",
    "unlit": "the picture without the light of the lamp",
}
LAYER_CHANNELS: Mapping[str, str] = {
    "depth": "Z",
    "normal": "N.X N.Y N.Z",
    "motion": "forward.u forward.v",
    "stroke": "CryptoStroke00.R ...",
    "uv": "stroke.u stroke.v",
    "height": "height.Y",
    "id": "CryptoBrush00.R ..., CryptoRegion00.R ..., CryptoLayer00.R ...",
    "unlit": "unlit.R unlit.G unlit.B unlit.A",
}
STYLE_SUFFIX = ".style"  # suffix of style files
# Frames per second of a film of a moving scene whose camera has no rate, and moments per second of moving
# formats without a stated rate: the rate of most captures. They are equal so that a film shows each moment
# once.
CLIP_FPS = 30.0
MOMENTS_PER_SECOND = 24.0  # for numbered files, which state no rate: the rate of films


# Clustering methods -> words for help; functions: `brushgs.passes.reduce.cluster.METHODS`.
METHODS: Mapping[Method, str] = {
    "auto": "by size (default)",
    "lloyd": "with exact steps",
    "minibatch": "with random batches, as published",
}

StepValues = Mapping[str, Mapping[str, Any]]  # step of a painting -> field of its config -> value

# Strokes as clustered, unchanged.
PLAIN_STROKES: Mapping[str, Any] = {
    "see": "off",
    "focus": None,
    "solid": False,
    "direction": "own",
    "broken_color": 0.0,
    "economy": 0.0,
    "edges": 0.0,
    "depth_of_field": 0.0,
}
SCENE_LIGHT: StepValues = {"color": {"values": 0.0}, "light": {"key": 0.0}}  # colors as captured
PLAIN_PAINT: Mapping[str, Any] = {"underpaint": False, "streaks": 0.0}
# "paper" is the published method (Xiang et al. 2025) without its defects, in the plain look. "0.1" applies to
# any look: it restores the defaults of version 0.1.
PLAIN_PRESETS = ("paper",)
PRESETS: Mapping[str, StepValues] = {
    "default": {},
    "0.1": {
        "clean": {"floaters": "floaters"},
        "view": {"size": None},
        "ground": {"stage": False},
        "strokes": {"focus": None, "economy": 0.0, "edges": 0.0},
        **SCENE_LIGHT,
    },
    "paper": {
        "clean": {"floaters": "off"},
        "prune": {"weight": "paper"},
        "cluster": {"strokes": 7000, "features": "paper", "merge": "paper", "method": "minibatch"},
        "strokes": PLAIN_STROKES,
        "draw": {"stroke": "swirl", "filter": "bilinear", "extent": "paper", "lock": "off", "order": "depth"}
        | dict(PLAIN_PAINT),
        **SCENE_LIGHT,
    },
}
# Every Gaussian, unmerged.
PLAIN_SCENE: StepValues = {
    "prune": {"keep": 1.0},
    "cluster": {"strokes": None},
    "strokes": PLAIN_STROKES,
    "draw": PLAIN_PAINT,
    **SCENE_LIGHT,
}

# Suffixes of report files (figures, tables, plots) by measuring command.
REPORT_SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "refine": (".json", ".png"),
    "stability": (".json", ".png"),
    "bench": (".json", ".csv", ".png"),
    "peers": (".json", ".png"),  # for `brushgs bench --peers`
}

# Colors by name: those of CSS, and "toned", a warm drawing paper. "grey" means "gray" everywhere.
COLORS: Mapping[str, str] = {
    "white": "#ffffff",
    "black": "#000000",
    "gray": "#808080",
    "lightgray": "#d3d3d3",
    "darkgray": "#a9a9a9",
    "silver": "#c0c0c0",
    "toned": "#c9b597",
    "ivory": "#fffff0",
    "linen": "#faf0e6",
    "beige": "#f5f5dc",
    "tan": "#d2b48c",
    "brown": "#a52a2a",
    "maroon": "#800000",
    "olive": "#808000",
    "teal": "#008080",
    "red": "#ff0000",
    "yellow": "#ffff00",
    "green": "#008000",
    "blue": "#0000ff",
    "navy": "#000080",
    "midnightblue": "#191970",
    "skyblue": "#87ceeb",
}


def color_code(text: str) -> str | None:
    """The "#rrggbb" of a color name or code; None if it is neither."""
    name = text.strip().lower()
    code = COLORS.get(name.replace("grey", "gray"), name)
    is_code = len(code) == 7 and code[0] == "#" and not set(code[1:]) - set("0123456789abcdef")
    return code if is_code else None


# The core keeps pixel bounds in 16 bits; a picture of MAX_PIXELS needs about 14 GB of memory.
MAX_SIDE, MAX_PIXELS = 32767, 2**28
MAX_FILE_PIXELS = 2**26  # if a camera file gives the size: real ones have fewer; takes 4 GB


def size_rule(width: int, height: int) -> str | None:
    """The size limit that a picture exceeds, in words; None if it is within all limits."""
    if width < 1 or height < 1:
        return f"must be 1x1 to {MAX_SIDE}x{MAX_SIDE} pixels, got {width}x{height}"
    share = min(1.0, MAX_SIDE / width, MAX_SIDE / height, (MAX_PIXELS / width / height) ** 0.5)
    if share == 1:
        return None
    largest = f"{max(1, int(width * share))}x{max(1, int(height * share))}"
    if width * height > MAX_PIXELS:
        rule = f"must hold at most {MAX_PIXELS / 1e6:.0f} million pixels"
    else:
        rule = f"must be 1x1 to {MAX_SIDE}x{MAX_SIDE} pixels"
    return f"{rule}, got {width}x{height}; the largest of that shape is {largest}"


def file_size_rule(width: int, height: int) -> str | None:
    """The lower limit for sizes from a camera file, in words; None if it is kept."""
    if width * height <= MAX_FILE_PIXELS:
        return None
    return (
        f"has cameras of {width}x{height} pixels, more than {MAX_FILE_PIXELS / 1e6:.0f} million; set the "
        "size of the pictures with --size"
    )
