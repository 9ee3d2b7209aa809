"""Open `refine --style` as a style with its painting: paintings are learned, styles are painted.

Strokes are matched to features of a picture. A style file has no picture, so one is painted with its marks,
directions, colors and brushes.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.rendering.rasterize import rasterize
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.colors import LUMINANCE
from brushgs.values.style import Style, StyleMarks

NUM_MARKS = 8  # of a dictionary, if its shapes serve as brushes
SIZE = 480, 360  # pixels of a painting made from a style
COVER = 5.0  # layers of marks
MOST_MARKS = 20_000
LUMPS = 6.0  # areas of one tone along the shorter side
SPREAD = 0.35  # deviation of a mark's tone from that of its area, as a share of the range


@dataclass(frozen=True, eq=False)
class PaintingStyle:
    """A style, and the picture that shows it.

    Attributes:
        style: its marks are None if the painting shows none.
        painting: [H, W, C] as `read_image` returns it.
    """

    style: Style
    painting: Array


def is_style(path: Path) -> bool:
    """Whether a file is a style, by its name."""
    return path.suffix.lower() == STYLE_SUFFIX


def open_style(path: Path) -> PaintingStyle:
    """Learn the style of a painting, or paint that of a style file.

    Raises:
        SceneError: if the file cannot be read, or is the style of an edit.
    """
    if not is_style(path):
        painting = read_image(path)
        return PaintingStyle(_learnt(painting, path), painting)
    from brushgs.formats.styles import read_style

    style = read_style(path)
    if style.palette is None:
        raise SceneError(
            path, "was learned from an edit, which has no colors and marks; give a painting, or its style"
        )
    return PaintingStyle(style, painted(style))


def at_size(painting: Array, shorter: int) -> Array:
    """A painting [H, W, C], averaged down to at most the shorter side of the pictures.

    Mark sizes are relative to the shorter side, so features then see equal sizes; in a painting of twice the
    size the bristles would match the picture's marks.
    """
    height, width = painting.shape[:2]
    if min(height, width) <= shorter:
        return painting
    import torch
    import torch.nn.functional as F  # noqa: N812

    factor = shorter / min(height, width)
    pixels = torch.from_numpy(np.ascontiguousarray(painting)).permute(2, 0, 1)[None]
    size = (round(height * factor), round(width * factor))
    return np.asarray(F.interpolate(pixels, size, mode="area")[0].permute(1, 2, 0).contiguous())


def _learnt(painting: Array, path: Path) -> Style:
    from brushgs.passes.style.marks import learn_marks
    from brushgs.passes.style.palette import learn_palette

    name = "".join(c if c.isprintable() else "?" for c in path.stem)[:80].strip() or "style"
    try:
        palette = learn_palette(painting)
    except ValueError as error:
        raise SceneError(path, f"has no colors to take ({error}); choose another picture") from None
    try:
        marks = learn_marks(painting, 0)  # strokes are fitted to the painting, so they take no marks from it
        if not marks.brushes:
            marks = _with_brushes(learn_marks(painting, NUM_MARKS))
    except ValueError:  # one even color, or too small
        marks = None
    return Style(name, palette, marks)


def _with_brushes(marks: StyleMarks) -> StyleMarks:
    """Give marks that are too small to be cut as brushes the shapes of their dictionary as brushes."""
    shapes = () if marks.dictionary is None else tuple(marks.dictionary.texels[..., 3])
    return replace(marks, brushes=shapes, dictionary=None)


def painted(style: Style, *, seed: int = 0) -> F32:
    """[H, W, 3] a painting in a style with a palette: equal styles and seeds give equal pictures."""
    assert style.palette is not None, "a painting has colors"
    rng = np.random.default_rng(seed)
    width, height = SIZE
    short = min(SIZE)
    marks = style.marks or StyleMarks(0.08, 2.0, np.zeros((1, 1, 2), np.float32))
    images = marks.brushes or (StrokeTexture.open("flat").coverage,)
    brushes = BrushSet(tuple(StrokeTexture.from_coverage(np.asarray(image)) for image in images))
    half = 0.5 * short * marks.length * np.array([1.0, 1 / marks.aspect])
    num = int(np.clip(COVER * width * height / (4 * half[0] * half[1]), 50, MOST_MARKS))
    x, y = rng.uniform(-half[0], width + half[0], num), rng.uniform(-half[0], height + half[0], num)
    boxes = Boxes(
        centers=np.stack([x, y], axis=1),
        half_extents=half * rng.uniform(0.8, 1.25, (num, 1)),
        angles=_angles(marks, x / width, y / height, rng),
        depths=np.arange(1.0, num + 1),
        colors=_colors(style, x / short, y / short, rng),
        opacities=np.ones(num),
        ids=np.arange(num, dtype=np.int32),
        brushes=rng.integers(0, len(brushes), num).astype(np.uint8),
    )
    frame = rasterize(boxes, brushes, width=width, height=height, depth=False)
    palette = style.palette
    ground = palette.weights @ palette.samples if marks.ground is None else marks.ground
    return np.clip(frame.over(np.asarray(ground, frame.rgb.dtype)), 0, 1).astype(np.float32)


def _angles(marks: StyleMarks, u: F64, v: F64, rng: np.random.Generator) -> F64:
    """[n] angles of marks at shares of the width and height; random if the style has no direction."""
    rows, columns = marks.directions.shape[:2]
    i, j = (np.clip(share * n, 0, n - 1).astype(np.intp) for share, n in ((v, rows), (u, columns)))
    pairs = marks.directions[i, j].astype(np.float64)
    pairs += 0.1 * rng.normal(size=pairs.shape)
    return np.asarray(0.5 * np.arctan2(pairs[:, 1], pairs[:, 0]))


def _colors(style: Style, x: F64, y: F64, rng: np.random.Generator) -> F64:
    """[n, 3] colors of marks: the palette's colors in their shares, with similar neighbors."""
    assert style.palette is not None, "a painting has colors"
    phases = rng.uniform(0, 2 * np.pi, 4)
    turns = 2 * np.pi * 0.5 * LUMPS
    tones = np.sin(0.8 * turns * x + phases[0] + np.sin(turns * y + phases[1]))
    tones += np.sin(0.9 * turns * y + phases[2] + np.sin(0.7 * turns * x + phases[3]))
    tones = 0.25 * tones + SPREAD * rng.normal(size=len(x))
    ranks = (np.argsort(np.argsort(tones)) + 0.5) / len(x)
    samples, weights = np.clip(style.palette.samples, 0, 1), style.palette.weights
    order = np.argsort(samples @ np.array(LUMINANCE), kind="stable")
    sums = np.cumsum(weights[order])
    chosen = np.searchsorted(sums, ranks * sums[-1]).clip(0, len(order) - 1)
    return np.asarray(samples[order[chosen]])
