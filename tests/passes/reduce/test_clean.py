"""Cleaning drops what floats in the air, and nothing else."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.passes.reduce.clean import find_floaters
from tests.doctor.scenes import ball
from tests.passes.reduce.test_floaters import blobs, joined
from tests.passes.scenes import assert_same, replaced

SPECKS = blobs([(0, 2.5, 0), (2.5, 0, 0)], 0.1)  # far from the ball
FUZZ = blobs((0, 0, 1.1), 0.003)  # hovers close above it


def test_sure_floaters_go_and_the_others_keep_their_order():
    scene = joined(ball(), SPECKS, FUZZ)
    order = np.random.default_rng(1).permutation(len(scene))
    kept = order[~np.isin(order, [len(ball()), len(ball()) + 1])]
    assert_same(bg.clean(scene.take(order)), scene.take(kept))


def test_each_level_drops_more_and_specks_too_small_to_be_seen_last():
    scene = joined(ball(), SPECKS, FUZZ)
    for floaters, dropped in (("off", 0), ("sure", 2), ("strong", 3)):
        assert len(bg.clean(scene, floaters)) == len(scene) - dropped
    scene = joined(ball(), blobs((0, 2.5, 0), 0.001))
    assert bg.clean(scene) is scene
    assert len(bg.clean(scene, "strong")) == len(ball())
    assert bg.clean(ball()) is ball()
    with pytest.raises(ValueError, match="clean: floaters must be off, floaters, sure, strong, got 'all'"):
        bg.clean(scene, "all")


def test_haze_and_too_few_to_tell_are_kept():
    scene = joined(ball(), SPECKS)
    faint = replaced(scene, opacities=scene.opacities * np.float32(0.05))
    for kept in (faint, *(scene.take(slice(len(scene) - count, None)) for count in (0, 1, 2, 50))):
        assert bg.clean(kept, "strong") is kept


def test_copies_at_one_place_are_judged_together():
    found = find_floaters(joined(ball(), *[blobs((0, 2.5, 0), 0.1)] * 40))
    assert found.sure.rows[len(ball()) :].all()
    assert not found.sure.rows[: len(ball())].any()


def test_rows_that_repeat_others_until_no_picture_shows_them_are_dropped():
    scene = ball()
    faint = replaced(scene, opacities=np.full_like(scene.opacities, 0.01))  # many are seen through another
    rows = np.concatenate([np.arange(len(scene)), np.full(6000, 7)])
    repeated = faint.take(np.random.default_rng(0).permutation(rows))
    cleaned = bg.clean(repeated)
    assert len(cleaned) == len(scene) - 1 + _core.MOST_COPIES
    camera = bg.frame_scene(faint, width=96, height=64)
    before, after = (bg.render(one, camera, "gaussian") for one in (repeated, cleaned))
    np.testing.assert_array_equal(before.rgb, after.rgb)
    np.testing.assert_array_equal(before.alpha, after.alpha)
    assert bg.clean(repeated, "off") is repeated
    fewer = faint.take(rows[:-4000])
    assert bg.clean(fewer) is fewer
