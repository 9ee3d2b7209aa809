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
ViewLock = Literal["anchor", "off"]  # of a single view
Lock = Literal["track", "anchor", "off"]  # of a single view or a path
Order = Literal["depth", "soft"]
ColorSpace = Literal["lab", "linear", "srgb"]  # in which a palette is matched
BenchFamily = Literal["strokes", "merge", "filter", "precision", "sh", "size"]
Clean = Literal["off", "sure", "strong"]  # which floaters are dropped: none, detached ones, nearer ones too
Params = Literal["colour", "free", "all"]  # of strokes, fitted by refinement

StepValues = Mapping[str, Mapping[str, Any]]  # step of a painting -> field of its config -> value

# Clustering methods -> what the help says of them; `brushgs.passes.cluster.METHODS` has the functions.
METHODS: Mapping[Method, str] = {
    "auto": "by size (default)",
    "lloyd": "with exact steps",
    "minibatch": "with random batches, as published",
}

# "paper" is the published method (Xiang et al. 2025) without its defects.
PRESETS: Mapping[str, StepValues] = {
    "default": {},
    "paper": {
        "clean": {"floaters": "off"},
        "prune": {"weight": "paper"},
        "cluster": {"strokes": 7000, "features": "paper", "merge": "paper", "method": "minibatch"},
        "draw": {"stroke": "swirl", "filter": "bilinear", "extent": "paper", "lock": "off", "order": "depth"},
    },
}
PLAIN_SCENE: StepValues = {"prune": {"keep": 1.0}, "cluster": {"strokes": None}}  # every Gaussian, unmerged

# Of the files that a command which measures writes, by its name: figures, tables, plots.
REPORT_SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "refine": (".json", ".png"),
    "stability": (".json", ".png"),
    "bench": (".json", ".csv", ".png"),
}

# The core keeps pixel bounds in 16 bits; a picture of MAX_PIXELS needs some 14 GB until it is written.
MAX_SIDE, MAX_PIXELS = 32767, 2**28
MAX_FILE_PIXELS = 2**26  # of a picture sized by a camera file: real ones have fewer; takes 4 GB


def size_rule(width: int, height: int) -> str | None:
    """The limit that a picture of this size exceeds, in words; None if there is none."""
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        return f"must be 1x1 to {MAX_SIDE}x{MAX_SIDE} pixels, got {width}x{height}"
    if width * height > MAX_PIXELS:
        return f"must hold at most {MAX_PIXELS / 1e6:.0f} million pixels, got {width}x{height}"
    return None


def file_size_rule(width: int, height: int) -> str | None:
    """The same of a size that comes from a camera file; its limit is lower."""
    if width * height <= MAX_FILE_PIXELS:
        return None
    return (
        f"has cameras of {width}x{height} pixels, more than {MAX_FILE_PIXELS / 1e6:.0f} million; set "
        "the size of the pictures with --size"
    )
