"""Needles, discs and blobs of any aspect: few strokes of them still paint what the plain picture shows.

The whole grid is in `examples/measured/stiff_shapes.md`.
"""

from functools import cache

import pytest

from tests.kit.for_each import for_each
from tests.stiff.shapes import ball, likeness, painted, plain

FEW, MORE = 0.05, 0.2
CELLS = [("needle", 1e8, True), ("disc", 1e8, False)]
# dB below the same scene at aspect 10, at a fifth of the count and more. Needles lose most where one stroke
# stands for a few: they are lines of one pixel with gaps between, at aspect 10 they blend.
MOST_LOST = {"needle": 3.5, "disc": 2.0}


@cache
def measured(shape, aspect, among_others):
    """PSNR and coverage of each share, against the plain picture."""
    scene = ball(shape, aspect, among_others=among_others)
    expected = plain(scene)
    return {share: likeness(painted(scene, share), expected) for share in (FEW, MORE)}


@for_each(("shape", "aspect", "among_others"), CELLS)
def test_few_strokes_of_thin_gaussians_paint_what_is_seen_of_them(shape, aspect, among_others):
    found, reference = measured(shape, aspect, among_others), measured(shape, 10.0, among_others)
    for share in (FEW, MORE):
        assert found[share][1] == pytest.approx(reference[share][1], rel=0.1)
    assert found[MORE][0] >= reference[MORE][0] - MOST_LOST[shape]
    assert found[MORE][0] >= found[FEW][0] - 0.3
    scene = ball(shape, aspect, among_others=among_others)
    published, _ = likeness(painted(scene, FEW, preset="paper"), plain(scene))
    assert found[FEW][0] >= published - 0.5
