"""The words that options take, and the presets: all that the help of the command line has to know.

Apart from `config` because dataclasses alone take longer to import than the rest of `brushgs --help`.
"""

from collections.abc import Mapping
from typing import Any, Literal

Weight = Literal["contribution", "paper"]
Features = Literal["balanced", "paper"]
Merge = Literal["cover", "paper"]
Method = Literal["auto", "minibatch", "lloyd"]
Filter = Literal["mip", "bilinear", "nearest"]
Extent = Literal["fitted", "paper"]
ViewLock = Literal["anchor", "off"]  # of one view, which knows of no other
Lock = Literal["track", "anchor", "off"]  # of a sequence
Order = Literal["depth", "soft"]
ColorSpace = Literal["lab", "linear", "srgb"]  # that a palette is matched in
BenchFamily = Literal["strokes", "merge", "filter", "precision", "sh", "size"]
Floaters = Literal["sure", "strong", "keep"]  # which of them a cure drops
Params = Literal["colour", "free", "all"]  # of strokes, that refinement moves

StepValues = Mapping[str, Mapping[str, Any]]  # step of a painting -> field of its config -> value

# "paper" is the published method (Xiang et al. 2025) without its defects.
PRESETS: Mapping[str, StepValues] = {
    "default": {},
    "paper": {
        "prune": {"weight": "paper"},
        "cluster": {"features": "paper", "merge": "paper", "method": "minibatch"},
        "draw": {"filter": "bilinear", "extent": "paper", "lock": "off", "order": "depth"},
    },
}
PLAIN_SCENE: StepValues = {"prune": {"keep": 1.0}, "cluster": {"strokes": None}}  # every Gaussian, unmerged

# Of the files that a command which measures writes, by its name: figures, tables, plots.
REPORT_SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "refine": (".json", ".png"),
    "stability": (".json", ".png"),
    "bench": (".json", ".csv", ".png"),
}

# The core keeps pixel bounds in 16 bits; a picture of the most pixels needs some 14 GB until it is written.
MAX_SIDE, MAX_PIXELS = 32767, 2**28
MAX_UNASKED = 2**26  # pixels of a picture whose size only a file says: cameras have less, and it takes 4 GB


def size_rule(width: int, height: int) -> str | None:
    """What a picture of so many pixels breaks, in words; None where nothing."""
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        return f"must be 1x1 to {MAX_SIDE}x{MAX_SIDE} pixels, got {width}x{height}"
    if width * height > MAX_PIXELS:
        return f"must hold at most {MAX_PIXELS / 1e6:.0f} million pixels, got {width}x{height}"
    return None


def unasked_rule(width: int, height: int) -> str | None:
    """The same of a size that nobody asked for, because a camera file says it."""
    if width * height <= MAX_UNASKED:
        return None
    return (
        f"asks for pictures of {width}x{height} pixels, more than {MAX_UNASKED / 1e6:.0f} million; say with "
        "--size what size they should have"
    )
