import numpy as np
import pytest

from brushgs.still_life import still_life
from brushgs.still_life.light import fit_views, view_dome
from brushgs.values.sh import sh_basis


def test_equal_seeds_give_equal_scenes_and_others_do_not():
    one, same, other = still_life(1000, seed=1), still_life(1000, seed=1), still_life(1000, seed=2)
    for name in ("means", "quats", "scales", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    assert len(one) != len(other) or not np.array_equal(one.sh, other.sh)


def test_too_few_gaussians_are_refused():
    with pytest.raises(ValueError, match="at least 1000, got 999"):
        still_life(999)


def test_the_fit_gives_back_a_function_of_degree_three():
    dome = view_dome()
    truth = np.random.default_rng(0).normal(0, 0.05, (4, 16, 3))
    colors = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), truth)
    fitted = fit_views(colors, dome)
    again = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), fitted)
    # The ridge that keeps unseen views tame costs this much; without it the fit is exact to 1e-12.
    assert np.abs(again - colors).max() < 0.02
