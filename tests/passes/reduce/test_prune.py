from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.reduce.prune import intensities, prune
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, colors_of, gaussians_at, on_sphere, random_gaussians


def rows_of(part, whole):
    """Which rows of the whole the part consists of, by position."""
    return [int(np.flatnonzero((whole.means == mean).all(axis=1))[0]) for mean in part.means]


@given(st.integers(1, 60), st.integers(0, 99), st.floats(0, 1, exclude_min=True), st.booleans())
def test_prune_keeps_order_and_is_a_subset(n, seed, keep, is_paper):
    weight = "paper" if is_paper else "contribution"
    scene = replace(random_gaussians(n, seed), antialiased=bool(seed % 2))
    kept = prune(scene, keep, weight=weight)
    assert kept.antialiased == scene.antialiased
    rows = rows_of(kept, scene)
    assert rows == sorted(set(rows))
    assert len(kept) == max(1, int(np.floor(keep * n + 0.5)))
    assert_same(kept, scene.take(np.array(rows)))
    assert_same(prune(scene, f"{100 * keep}%", weight=weight), kept)


def test_nothing_is_pruned_by_itself_where_each_holds_more_than_can_be_lost():
    scene = random_gaussians(5).take(np.zeros(5, dtype=int))
    assert prune(scene) is scene


def test_paper_weight_is_opacity_times_trace_times_luminance():
    scene = random_gaussians(7)
    luminance = np.clip(colors_of(scene), 0, 1) @ (0.2126, 0.7152, 0.0722)
    expected = scene.opacities * (scene.scales**2).sum(axis=1) * luminance
    np.testing.assert_allclose(intensities(scene), expected, rtol=1e-12)
    assert rows_of(prune(scene, 0.4, weight="paper"), scene) == sorted(np.argsort(-expected)[:3])


def test_a_closed_room_does_not_hide_what_stands_in_it():
    scene = gaussians_at(np.concatenate([on_sphere(3900), 0.3 * on_sphere(100)]), 0.03)
    inside = np.linalg.norm(prune(scene, 0.5).means, axis=1) < 0.5
    assert inside.sum() > 60  # of the 100 that stand inside: more than of the walls, of which half goes


@for_each(
    ("keep", "message"),
    [
        (30.0, r"prune: keep must be in \(0, 1\], got 30.0; for 30 % write 0.3"),
        (0.0, r"prune: keep must be in \(0, 1\], got 0.0$"),
        (-1.0, r"prune: keep must be in \(0, 1\], got -1.0$"),
        (float("nan"), r"prune: keep must be in \(0, 1\], got nan$"),
        ("120%", "prune: keep must be at most 100 %, got '120%'"),
        ("most", "prune: keep must be a number, got 'most'"),
    ],
)
def test_keep_out_of_range_is_refused(keep, message):
    with pytest.raises(ValueError, match=message):
        prune(random_gaussians(3), keep)
    with pytest.raises(ValueError, match="prune: weight must be 'contribution' or 'paper', got 'size'"):
        prune(random_gaussians(3), weight="size")
