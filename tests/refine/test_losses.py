"""Losses: equal to those of others where others have them, nought where nothing is wrong."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs.refine.distil import (  # noqa: E402
    color_distance,
    roundness,
    total_variation,
)


def pair(height=60, width=80, dtype=torch.float64):
    first = torch.rand(height, width, 3, generator=torch.Generator().manual_seed(0), dtype=dtype)
    noise = torch.rand(height, width, 3, generator=torch.Generator().manual_seed(1), dtype=dtype)
    return first, (0.7 * first + 0.3 * noise)


def test_gradients_are_those_of_finite_differences():
    scales = torch.tensor([[0.1, 1.0, 30.0], [1.0, 1.0, 1.2]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda s: roundness(s, 5.0), scales)


def test_what_is_thin_pays_and_what_is_round_does_not():
    round_ones = torch.tensor([[0.001, 1.0, 4.9], [2.0, 2.0, 2.0]])  # flat strokes are not thin ones
    assert float(roundness(round_ones, 5.0)) == 0
    thin = torch.tensor([[0.1, 0.1, 10.0]])
    assert float(roundness(thin, 5.0)) == pytest.approx(np.log(20) ** 2, rel=1e-5)


def test_a_plain_color_does_not_vary():
    assert float(total_variation(torch.full((5, 6, 3), 0.3))) == 0
    steps = torch.arange(6.0)[None, :, None].expand(5, 6, 3)
    assert float(total_variation(steps)) == pytest.approx(1)


def test_colors_of_the_target_mean_and_covariance_have_distance_zero():
    rgb, _ = pair()
    alpha = torch.rand(rgb.shape[:2], dtype=torch.float64) * 0.9 + 0.1
    points, weights = rgb.reshape(-1, 3).numpy(), alpha.reshape(-1).numpy()
    mean = np.average(points, axis=0, weights=weights)
    covariance = np.cov(points.T, aweights=weights, ddof=0)
    target = torch.from_numpy(mean), torch.from_numpy(covariance)
    painted = rgb * alpha[..., None]
    assert float(color_distance(painted, alpha, *target)) < 1e-12
    assert float(color_distance(painted, alpha, target[0] + 0.1, target[1])) == pytest.approx(0.03)
