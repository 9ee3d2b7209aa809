"""Boxes, balls, half spaces and colors: who is in, and soft edges."""

import numpy as np
import pytest

from brushgs.options.where import Where
from brushgs.passes.where import WhereContext, memberships, sides
from brushgs.values.camera import FirstView
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at


def scene():
    colors = [[1, 0, 0], [0.9, 0.1, 0], [0, 0, 1], [0, 1, 0]]
    return gaussians_at([[0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], 1, colors, dtype=np.float32)


@for_each(
    ("text", "inside"),
    [
        ("box:-1,-1,-1,1,1,1", [1, 1, 0, 0]),
        ("box:1,2,1,-1,-1,-1", [1, 1, 1, 0]),
        ("sphere:0,0,0,1.5", [1, 1, 0, 0]),
        ("sphere: 5, 5, 5, 0.1", [0, 0, 0, 1]),
        ("colour:#ff0000,0.2", [1, 1, 0, 0]),
        ("color:#0000ff,0.01", [0, 0, 1, 0]),
        ("half:1,0,0,1", [0, 1, 0, 1]),
        ("half:-1,0,0,0", [1, 0, 1, 0]),
        ("half:1e-200,0,0,1e-200", [0, 1, 0, 1]),
        ("not sphere:0,0,0,1.5", [0, 0, 1, 1]),
        ("half:1,0,0,1 and sphere:0,0,0,1.5", [0, 1, 0, 0]),
        ("half:1,0,0,1 or colour:#0000ff,0.01", [0, 1, 1, 1]),
        ("not (half:1,0,0,1 or colour:#0000ff,0.01)", [1, 0, 0, 0]),
    ],
)
def test_a_part_holds_what_lies_in_it(text, inside):
    assert memberships(Where.parse(text), scene()).tolist() == inside


def test_a_soft_edge_is_a_ramp_of_its_width_about_the_hard_one():
    points = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, 0, 0.5]])  # longest distance: 2
    view = FirstView(points, np.array([0, -1.0, 0]), 0.0, 0.0)
    context = WhereContext(view, soft=1.0)  # 2 world units wide
    narrow, red = WhereContext(view, soft=0.4), 0.5 + (0.2 - np.hypot(0.1, 0.1)) / 0.4
    for text, around, expected in (
        ("sphere:0,0,0,1.5", context, [1, 0.75, 0.25, 0]),
        ("box:0,-9,-9,9,9,9 and half:0,-1,0,-1", context, [0.5, 1, 0, 0]),
        ("colour:#ff0000,0.2", narrow, [1, red, 0, 0]),
    ):
        found = memberships(Where.parse(text), scene(), around)
        np.testing.assert_allclose(found, expected, atol=1e-6)
    with pytest.raises(ValueError, match="the first view of the scene must be known"):
        memberships(Where.parse("sphere:0,0,0,1"), scene(), WhereContext(soft=0.1))


def test_each_gaussian_is_on_one_side_by_its_place():
    rng = np.random.default_rng(0)
    means = rng.normal(size=(20_000, 3)).astype(np.float32)
    gaussians = gaussians_at(means, 1)
    shares = np.repeat([0.0, 0.25, 0.75, 1.0], 5000)
    found = sides(shares, gaussians)
    counts = found.reshape(4, 5000).mean(axis=1)
    assert (counts[0], counts[3]) == (0, 1)
    np.testing.assert_allclose(counts[1:3], [0.25, 0.75], atol=0.02)
    order = rng.permutation(len(means))
    assert np.array_equal(sides(shares[order], gaussians.take(order)), found[order])
