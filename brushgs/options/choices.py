"""The values that options take, the presets, and limits of pictures: what the help of the command line needs.

Separate from the config classes, since `dataclasses` takes longer to import than the rest of `--help`.
"""

from collections.abc import Mapping
from typing import Any, Literal

Weight = Literal["contribution", "paper"]
Features = Literal["balanced", "paper"]
Merge = Literal["cover", "paper"]
Method = Literal["auto", "lloyd", "minibatch"]
StrokesFor = Literal["scene", "view"]  # what strokes are made of: all of a scene, or what is seen of it
Filter = Literal["mip", "bilinear", "nearest"]
Extent = Literal["fitted", "paper"]
StrokeColor = Literal["own", "scene", "mix"]  # whose colour paint has
ViewLock = Literal["anchor", "off"]  # of a single view
Lock = Literal["track", "anchor", "off"]  # of a single view or a path
Order = Literal["depth", "soft"]
Blend = Literal["cover", "glaze"]
Side = Literal["front", "left", "back", "right", "top", "three-quarter"]  # that a view shows
Target = Literal["subject", "scene", "part"]  # what a view shows whole
ColorSpace = Literal["lab", "linear", "srgb"]  # in which a palette is matched
Knee = Literal["auto", "auto:frame"]  # chosen counts of strokes: by the time waited for, by that of a frame
Cost = Literal["frame", "painting"]  # what is waited for: one of many frames, or a whole painting
BenchFamily = Literal["strokes", "merge", "filter", "precision", "sh", "size", "views", "knobs"]
# What is dropped: nothing; detached floaters; these and crumbs below an object; nearer floaters too.
Clean = Literal["off", "floaters", "sure", "strong"]
Params = Literal["color", "free", "all"]  # of strokes, fitted by refinement
See = Literal["views", "off"]  # what decides which strokes there are beside the scene: what views of it show
Canvas = Literal["none", "linen", "paper"]  # what lies under the paint
Medium = Literal["paint", "charcoal", "ink", "watercolour"]  # what strokes are made with
StageTone = Literal["auto", "light", "dark"]  # of the wall of a stage
Codec = Literal["h264", "h265", "prores", "vp9"]  # of videos

# The looks that come with the program, files in brushgs/looks: as they are listed.
LOOKS = ("oil", "impressionist", "gouache", "watercolour", "charcoal", "ink", "plain")
DEFAULT_LOOK, PLAIN_LOOK = "oil", "plain"
# Strokes of a backdrop: of one that is switched on in a look without, and the most that a look may have.
DEFAULT_BACKDROP, MAX_BACKDROP = 2500, 20_000
# Layers of a picture that compositing takes -> what each is, in words. `Frame.layers` says how they are held,
# `brushgs.formats.pictures.exr` how they are written.
LAYERS: Mapping[str, str] = {
    "depth": "distance along the camera's axis, world units: the mean of the strokes, by what each shows",
    "normal": "direction that the planes of the strokes face, in camera axes",
    "motion": "pixels from here to where the same paint is in the next frame, of strokes and camera",
    "stroke": "Cryptomatte of single strokes: how much of a pixel is each",
    "uv": "place on the stroke that shows most, 0 to 1 along it and across",
    "height": "how high the paint stands, pixels; only where the look has relief",
    "id": "Cryptomattes by brush, by region (--rules) and by layer of paint (--look)",
    "unlit": "the picture before the lamp shines on it",
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
STYLE_SUFFIX = ".style"  # of files of styles
# Frames a second of a film whose camera has no rate of its own, and moments a second of formats that move by
# themselves and do not say: that of most captures. One number, so that a film shows each moment once.
CLIP_FPS = 30.0
MOMENTS_PER_SECOND = 24.0  # of numbered files, which never say: that of films


# Clustering methods -> what the help says of them; `brushgs.passes.reduce.cluster.METHODS` has the functions.
METHODS: Mapping[Method, str] = {
    "auto": "by size (default)",
    "lloyd": "with exact steps",
    "minibatch": "with random batches, as published",
}

StepValues = Mapping[str, Mapping[str, Any]]  # step of a painting -> field of its config -> value

# Strokes as clustering leaves them, and drawn as they are.
PLAIN_STROKES: Mapping[str, Any] = {
    "see": "off",
    "focus": None,
    "solid": False,
    "direction": "own",
    "broken_color": 0.0,
    "economy": 0.0,
    "edges": 0.0,
}
SCENE_LIGHT: StepValues = {"color": {"values": 0.0}, "light": {"key": 0.0}}  # colours as they were captured
PLAIN_PAINT: Mapping[str, Any] = {"underpaint": False, "streaks": 0.0}
# "paper" is the published method (Xiang et al. 2025) without its defects, and the plain look. "0.1" lies over
# any look: each default that has changed since has its old value there.
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

# Of the files that a command which measures writes, by its name: figures, tables, plots.
REPORT_SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "refine": (".json", ".png"),
    "stability": (".json", ".png"),
    "bench": (".json", ".csv", ".png"),
}

# Colours by name: those of CSS, and "toned", a warm drawing paper. "grey" means "gray" everywhere.
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
    """The "#rrggbb" of a colour that is given by name or like that; None if it is none."""
    name = text.strip().lower()
    code = COLORS.get(name.replace("grey", "gray"), name)
    is_code = len(code) == 7 and code[0] == "#" and not set(code[1:]) - set("0123456789abcdef")
    return code if is_code else None


# The core keeps pixel bounds in 16 bits; a picture of MAX_PIXELS needs some 14 GB until it is written.
MAX_SIDE, MAX_PIXELS = 32767, 2**28
MAX_FILE_PIXELS = 2**26  # of a picture sized by a camera file: real ones have fewer; takes 4 GB


def size_rule(width: int, height: int) -> str | None:
    """The limit that a picture of this size exceeds, in words; None if there is none."""
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
    """The same of a size that comes from a camera file; its limit is lower."""
    if width * height <= MAX_FILE_PIXELS:
        return None
    return (
        f"has cameras of {width}x{height} pixels, more than {MAX_FILE_PIXELS / 1e6:.0f} million; set the "
        "size of the pictures with --size"
    )
