"""Canvas and paper."""

import numpy as np

import brushgs.rendering.surface as canvases
from brushgs.rendering.surface import Surface, flat, linen, paper
from tests.kit.for_each import for_each

CANVASES = {"linen": linen, "paper": paper}
HEIGHTS = {"linen": canvases.LINEN_HEIGHT, "paper": canvases.PAPER_HEIGHT}
TONES = {"linen": canvases.LINEN_TONE, "paper": canvases.PAPER_TONE}
CREAM = (0.9, 0.85, 0.75)


def canvas(name: str, width: int = 1000, height: int = 750, **options) -> Surface:
    return CANVASES[name](CREAM, height=height, width=width, **options)


@for_each("name", CANVASES)
def test_heights_and_tones_are_as_said(name):
    surface = canvas(name)
    assert surface.rgb.shape == (750, 1000, 3)
    assert surface.height.shape == surface.grain.shape == (750, 1000)
    assert {a.dtype for a in (surface.rgb, surface.height, surface.grain)} == {np.dtype(np.float32)}
    np.testing.assert_allclose(surface.height.std(), HEIGHTS[name], rtol=0.15)
    assert abs(surface.height.mean()) < 0.02 * HEIGHTS[name]
    np.testing.assert_allclose(surface.rgb.mean(axis=(0, 1), dtype=np.float64), CREAM, atol=1e-3)
    np.testing.assert_allclose((surface.rgb[..., 0] / CREAM[0]).std(), TONES[name], rtol=0.15)
    assert surface.grain.min() >= 0
    assert surface.grain.max() <= 1
    assert abs(surface.grain.mean() - 0.5) < 0.03
    assert surface.grain.std() > 0.15
    raised = surface.height > surface.height.std()
    assert surface.grain[raised].min() > surface.grain[~raised].mean()


@for_each("name", CANVASES)
def test_a_seed_repeats(name):
    surface, again, other = canvas(name), canvas(name), canvas(name, seed=1)
    np.testing.assert_array_equal(surface.height, again.height)
    np.testing.assert_array_equal(surface.rgb, again.rgb)
    assert abs(np.corrcoef(surface.height.ravel(), other.height.ravel())[0, 1]) < 0.1


@for_each("name", CANVASES)
def test_a_small_picture_previews_a_large_one(name):
    large, small = canvas(name, 2000, 1500).height, canvas(name).height
    halved = large.reshape(750, 2, 1000, 2).mean(axis=(1, 3)) / 2
    assert np.corrcoef(halved.ravel(), small.ravel())[0, 1] > 0.95
    np.testing.assert_allclose(halved.std(), small.std(), rtol=0.2)


@for_each(("width", "height"), [(1, 1), (3, 500), (16, 12), (320, 180)])
@for_each("name", CANVASES)
def test_any_size_has_a_surface(name, width, height):
    surface = canvas(name, width, height)
    assert surface.rgb.shape == (height, width, 3)
    for array in (surface.rgb, surface.height, surface.grain):
        assert np.isfinite(array).all()


def test_a_flat_board_has_nothing_but_its_color():
    picture = np.random.default_rng(0).uniform(0, 1, (5, 7, 3)).astype(np.float32)
    board = flat(picture, height=5, width=7)
    np.testing.assert_array_equal(board.rgb, picture)
    assert not board.height.any()
    np.testing.assert_array_equal(board.grain, 1)
