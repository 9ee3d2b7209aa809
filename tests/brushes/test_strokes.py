"""The built-in stroke images: drawn by the script, and fit to paint with."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.formats.pictures.images import read_image
from tests.kit.for_each import for_each

STROKES = Path(__file__).resolve().parents[2] / "strokes"
NAMES = sorted(path.stem for path in STROKES.glob("*.png"))
SOLID = {"flat", "filbert", "dab", "impasto", "swirl", "moon", "flower", "x", "ink", "palette_knife"}
SMALL = {256: 120_000, 512: 160_000}  # bytes by width: they travel in the wheel


@pytest.fixture
def draw(monkeypatch):
    monkeypatch.syspath_prepend(str(STROKES))
    return importlib.import_module("draw")


def test_the_script_draws_exactly_the_strokes_that_ship(draw):
    assert sorted(draw.IMAGES) == NAMES
    assert set(NAMES) >= SOLID | {"dry_brush", "splatter"}
    assert sum((STROKES / f"{name}.png").stat().st_size for name in NAMES) < 3_000_000


@pytest.mark.parametrize("name", ["flat", "ink"])
def test_drawing_again_gives_the_same_picture(draw, name):
    # Other versions of NumPy and SciPy may round another way; here the difference is 0.
    again = draw.draw(name).astype(int)
    shipped = np.rint(read_image(STROKES / f"{name}.png") * 255)
    assert np.abs(again - shipped).max() <= 1


@for_each("name", NAMES)
def test_a_stroke_is_small_rgba_covers_most_and_fades_at_its_border(name):
    path = STROKES / f"{name}.png"
    pixels = read_image(path)
    assert path.stat().st_size < SMALL[pixels.shape[1]]
    assert pixels.shape[2] == 4
    assert pixels.shape[0] <= pixels.shape[1]
    alpha = pixels[..., 3]
    border = np.concatenate([alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]])
    assert border.mean() < 0.05  # no stroke is cut off by its picture
    assert np.mean((alpha > 0.02) & (alpha < 0.98)) > 0.05  # soft edges, thin paint between bristles
    assert np.all(np.rint(pixels[alpha == 0, :3] * 255) == 128)  # bare canvas
    coverage = StrokeTexture.open(name).coverage / 255
    assert coverage.mean() > (0.4 if name in SOLID else 0.3)
    assert coverage[coverage > 0.02].mean() > (0.75 if name in SOLID else 0.55)


@for_each("name", ["flat", "filbert", "dry_brush", "ink", "palette_knife", "charcoal"])
def test_a_stroke_runs_from_left_to_right(name):
    """It lands full and lifts thin, and streaks lie along it."""
    coverage = StrokeTexture.open(name).coverage / 255
    width = coverage.shape[1]
    assert coverage[:, : width // 4].mean() > 1.1 * coverage[:, -width // 4 :].mean()
    inside = coverage[coverage.shape[0] // 4 : -coverage.shape[0] // 4, width // 8 : width // 2]
    along, across = np.abs(np.diff(inside, axis=1)).mean(), np.abs(np.diff(inside, axis=0)).mean()
    assert along < across
