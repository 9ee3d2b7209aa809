"""An edit that was learned is the edit that was made, as far as a scene can say."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.color.color_map import Affine, map_colors
from brushgs.passes.style.edit import apply_edit, needed_features
from brushgs.passes.style.features import stroke_features
from brushgs.passes.style.learn_edit import learn_edit
from brushgs.passes.style.pairs import pair_rows
from brushgs.values.colors import LUMINANCE
from tests.kit.for_each import for_each
from tests.passes.scenes import colors_of, random_gaussians, replaced, with_colors
from tests.passes.style.test_features import VIEW

FEW = 16  # bumps, where their number is not the matter: their time grows with its square
GREY = np.tile(LUMINANCE, (3, 1))
AFFINE = {
    "warm": (np.diag([1.1, 1.0, 0.8]), np.array([0.03, 0.0, -0.03])),
    "grey": (GREY, np.zeros(3)),
    "negative": (-np.eye(3), np.ones(3)),
    "saturation": (1.6 * np.eye(3) - 0.6 * GREY, np.zeros(3)),
    "any": (np.array([[1.1, 0.1, 0], [0, 0.9, 0.05], [0, 0.1, 0.7]]), np.array([0.05, 0, -0.1])),
}


def scene(n=2000, seed=0, colors=None, dtype=np.float64):
    """A cloud of strokes in random colors within the display range, or in given ones."""
    plain = random_gaussians(n, seed, spread=0.4, terms=4)
    if colors is None:
        colors = np.random.default_rng(seed + 1).uniform(size=(n, 3))
    return with_colors(replaced(plain, sh=0.1 * plain.sh), np.broadcast_to(colors, (n, 3))).astype(dtype)


def error(edit, other, wanted):
    """Root mean square difference of an edit applied to another scene from what is wanted there."""
    features = stroke_features(other, VIEW, needed_features([edit]))
    found = colors_of(apply_edit(other, edit, features))
    return float(np.sqrt(((found - colors_of(wanted)) ** 2).mean()))


@for_each("name", AFFINE)
@for_each("dtype", [np.float32, np.float64])
def test_an_affine_edit_is_found_exactly(name, dtype):
    matrix, offset = AFFINE[name]
    before = scene(dtype=dtype)
    learned = learn_edit(before, map_colors(before, Affine(matrix, offset)), VIEW)
    np.testing.assert_allclose(learned.edit.affine, np.column_stack([matrix, offset]), atol=1e-5)
    assert learned.edit.residual is None
    assert learned.edit.log_size == 0
    assert learned.left < 1e-5
    if name in ("warm", "negative"):  # each channel is taken to change for itself where all is grey
        greys = scene(500, colors=np.random.default_rng(0).uniform(size=(500, 1)))
        edit = learn_edit(greys, map_colors(greys, Affine(matrix, offset)), VIEW).edit
        np.testing.assert_allclose(edit.affine, np.column_stack([matrix, offset]), atol=1e-5)


@pytest.mark.parametrize("count", [1, 2, 500])
def test_of_one_color_that_color_is_right(count):
    before = scene(count, colors=(0.6, 0.4, 0.2))
    after = scene(count, colors=(0.3, 0.5, 0.7))
    edit = learn_edit(before, after, VIEW).edit
    assert error(edit, before, after) < 1e-4
    assert np.abs(edit.affine[:, :3] - np.eye(3)).max() < 1


@for_each(("num_levels", "low", "high"), [(4, 0.5, 0.95), (5, 0.05, 0.6)])
def test_an_edit_that_cannot_be_learnt_does_no_harm_to_other_scenes(num_levels, low, high):
    """A scene of few colors is posterised, and what is learned meets all colors."""
    rng = np.random.default_rng(1)
    few = np.clip(rng.uniform(low, high, (800, 1)) + rng.normal(0, 0.1, (800, 3)), 0, 1)
    before, other = scene(800, colors=few), scene(seed=3)
    after, wanted = (
        with_colors(one, np.floor(np.clip(colors_of(one), 0, 0.9999) * num_levels) / (num_levels - 1))
        for one in (before, other)
    )
    learned = learn_edit(before, after, VIEW, num_bumps=FEW)
    unchanged = np.sqrt(((colors_of(other) - colors_of(wanted)) ** 2).mean())
    assert error(learned.edit, other, wanted) < 1.1 * unchanged
    assert error(learned.edit, before, after) < 1.05 * learned.changed


def reds_to_blue(gaussians):
    rgb = colors_of(gaussians)
    share = np.clip((rgb[:, 0] - rgb[:, 1] - 0.2) / 0.3, 0, 1)[:, None]
    return with_colors(gaussians, (1 - share) * rgb + share * rgb[:, [2, 1, 0]])


def darker_upward(gaussians):
    height = np.clip(stroke_features(gaussians, VIEW, ("height",)).values, 0, 1)
    return with_colors(gaussians, colors_of(gaussians) * (1 - 0.7 * height))


@pytest.mark.parametrize(
    ("change", "names", "within"),
    [(reds_to_blue, {"lightness", "green_red", "blue_yellow"}, 0.03), (darker_upward, {"height"}, 0.01)],
)
def test_a_partial_edit_is_learnt_by_the_features_it_depends_on_and_holds_elsewhere(change, names, within):
    before, other = scene(1000), scene(1000, seed=5)
    learned = learn_edit(before, change(before), VIEW, num_bumps=FEW)
    assert learned.edit.residual is not None
    assert set(learned.edit.residual.features) <= names
    assert learned.held_out < 0.5 * learned.left
    assert error(learned.edit, other, change(other)) < within
    plain = learn_edit(before, change(before), VIEW, num_bumps=0)
    assert plain.edit.residual is None
    assert error(plain.edit, other, change(other)) > 2 * within


def test_sizes_are_learnt():
    before = scene(2000)
    grown = replace(before, scales=1.5 * before.scales)
    edit = learn_edit(before, grown, VIEW).edit
    assert edit.log_size == pytest.approx(np.log(1.5))
    np.testing.assert_allclose(edit.affine, np.eye(3, 4), atol=1e-9)
    assert edit.residual is None
    steps = np.clip(stroke_features(before, VIEW, ("height",)).values, 0, 1)
    higher = replace(before, scales=before.scales * np.exp(steps))
    edit = learn_edit(before, higher, VIEW, num_bumps=FEW).edit
    features = stroke_features(before, VIEW, needed_features([edit]))
    found = np.log(apply_edit(before, edit, features).scales / before.scales)
    assert np.sqrt(((found - steps) ** 2).mean()) < 0.06


def test_rows_are_paired_by_number_or_by_place():
    before = scene(400)
    pairs = pair_rows(before, before)
    assert pairs.are_rows
    np.testing.assert_array_equal(pairs.before, np.arange(400))
    order = np.random.default_rng(0).permutation(400)[:300]
    pairs = pair_rows(before, before.take(order))
    assert not pairs.are_rows
    np.testing.assert_array_equal(order[pairs.after], pairs.before)
    assert len(pairs.before) >= 300


def test_two_scenes_are_no_edit():
    before = scene(100)
    far = replaced(before, means=before.means + 50)
    with pytest.raises(ValueError, match=r"of the 100 Gaussians before the edit 0 lie .* two states of one"):
        learn_edit(before, far, VIEW)
    with pytest.raises(ValueError, match="scene after the edit must have at least one Gaussian"):
        learn_edit(before, before.take(slice(0, 0)), VIEW)
