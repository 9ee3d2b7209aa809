"""Crowds: where more than 160 fragments of a block wait in soft order, their weights are interpolated."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.rendering import reference
from brushgs.rendering.rasterize import RasterOptions, rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.strokes import boxes_of, bristles, ridges

ERROR = 0.5 / 255  # of a crowd, as `rasterize` states it
MOST_WAITING = 160
SIZE = {"width": 9, "height": 6}
SEEDS = st.integers(0, 2**32 - 1)
SPREADS = [0.05, 2.0]  # between the nearest and the farthest, world units
NUMBERS = [(200, np.float64), (300, np.float64), (260, np.float32)]  # of strokes
# Ranges of opacities, and of softness in world units.
OPACITIES = {"faint": (0.004, 0.01), "light": (0.02, 0.05), "half": (0.1, 0.6), "full": (0.9, 1.0)}
SOFTNESS = {"one": (1.0, 1.0), "twice": (0.5, 1.0), "wide": (0.02, 1.0), "giants": (0.05, 50.0)}
LOOKS = {
    "plain": {},
    "layered": {"underpaint": Underpaint(1.5), "streaks": 0.4},
    "raised": {"relief": True},
    "all": {"underpaint": Underpaint(1.5), "streaks": 0.4, "relief": True},
}


def crowd(
    n: int, *, opacities=(0.004, 0.01), softness=(1.0, 1.0), spread=0.7, seed=0, dtype=np.float64
) -> Boxes:
    """Strokes of all directions that cover the whole picture."""
    g = np.random.default_rng([seed, n])
    boxes = boxes_of(
        np.array((4.5, 3.0)) + g.uniform(-1, 1, (n, 2)),
        np.exp(g.uniform(np.log(9), np.log(40), (n, 2))),
        angles=g.uniform(-np.pi, np.pi, n),
        depths=np.sort(g.uniform(5, 5 + spread, n)),
        colors=g.uniform(0, 1, (n, 3)),
        opacities=g.uniform(*opacities, n),
        dtype=dtype,
    )
    return replace(boxes, softness=np.exp(g.uniform(*np.log(softness), n)).astype(dtype))


def painted(boxes: Boxes, **options) -> Frame:
    return rasterize(boxes, ridges(), **SIZE, **options)


def error_of(boxes: Boxes) -> float:
    """Largest difference from the definition in color and alpha."""
    actual, expected = painted(boxes), reference.rasterize(boxes, ridges(), RasterOptions(**SIZE))
    for plane in (actual.rgb, actual.alpha, actual.depth):
        assert np.isfinite(plane).all()
    np.testing.assert_allclose(actual.depth, expected.depth, atol=2 * ERROR * np.ptp(boxes.depths) + 1e-5)
    return float(max(np.abs(actual.rgb - expected.rgb).max(), np.abs(actual.alpha - expected.alpha).max()))


@for_each(("opacities", "softness", "spread", "num"), pairs_of(OPACITIES, SOFTNESS, SPREADS, NUMBERS))
def test_crowds_are_as_defined_to_half_a_step_of_eight_bits(opacities, softness, spread, num):
    n, dtype = num
    boxes = crowd(n, opacities=OPACITIES[opacities], softness=SOFTNESS[softness], spread=spread, dtype=dtype)
    assert error_of(boxes) < ERROR


@settings(max_examples=10, deadline=None)
@given(
    seed=SEEDS,
    n=st.integers(MOST_WAITING + 1, 400),
    spread=st.floats(0, 8),
    least_softness=st.floats(0, 1),
    alternates=st.booleans(),
)
def test_any_mixture_of_faint_and_full_paint_is_as_defined(seed, n, spread, least_softness, alternates):
    """Also where colors alternate from stroke to stroke: merging neighbors would show most there."""
    g = np.random.default_rng(seed)
    boxes = crowd(n, spread=spread, seed=seed)
    colors = np.tile([[1.0, 0, 0], [0, 0, 1]], (n, 1))[:n] if alternates else boxes.colors
    opacities = g.choice([0.005, 0.03, 0.3, 1.0], n, p=g.dirichlet(np.ones(4)))
    softness = g.uniform(least_softness, 1, n) * (g.random(n) < 0.9)
    assert error_of(replace(boxes, colors=colors, opacities=opacities, softness=softness)) < ERROR


def test_up_to_160_that_wait_are_painted_without_error_and_more_of_one_depth_too():
    boxes = crowd(400)
    few = boxes.take(np.s_[:MOST_WAITING])
    assert error_of(few) < 1e-13
    assert 1e-13 < error_of(boxes) < ERROR
    level = replace(boxes, depths=np.full(400, 5.0))
    assert error_of(level) < 1e-12


def test_threads_and_the_tiles_before_change_no_bit():
    """Memory of a thread is kept: a tile of a crowd leaves nothing behind for the next."""
    g = np.random.default_rng(5)
    boxes = crowd(1000, opacities=(0.01, 0.2), softness=(0.1, 1.0), spread=2.0, dtype=np.float32)
    boxes = replace(boxes, centers=(g.uniform(0, 150, (1000, 2))).astype(np.float32))
    how = {"width": 150, "height": 120}
    one = rasterize(boxes, bristles(), num_threads=1, **how)
    for num_threads in (2, 5, 1):
        threaded = rasterize(boxes, bristles(), num_threads=num_threads, **how)
        np.testing.assert_array_equal(threaded.rgb, one.rgb)
        np.testing.assert_array_equal(threaded.depth, one.depth)
