"""Losses: equal to those of others, with their gradients; nought where nothing is wrong."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs.refine.distil import (  # noqa: E402
    color_distance,
    photometric,
    roundness,
    ssim,
    total_variation,
)
from tests.kit.for_each import for_each  # noqa: E402
from tests.refine import photometric_reference as reference  # noqa: E402

SHAPES = [(1, 1, 1), (2, 7, 3), (3, 4, 1), (12, 5, 3), (33, 71, 3), (60, 80, 1)]  # (height, width, channels)


def pair(height=60, width=80, channels=3, dtype=torch.float64):
    shape = height, width, channels
    first = torch.rand(shape, generator=torch.Generator().manual_seed(0), dtype=dtype)
    noise = torch.rand(shape, generator=torch.Generator().manual_seed(1), dtype=dtype)
    return first, (0.7 * first + 0.3 * noise)


def loss_and_gradient(function, first, second, *options):
    painted = first.clone().requires_grad_()
    loss = function(painted, second, *options)
    loss.backward()
    return loss.detach(), painted.grad


def test_similarity_is_that_of_others():
    from skimage.metrics import structural_similarity

    first, second = pair()
    how = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "full": True}
    pictures = first.numpy(), second.numpy()
    expected, whole = structural_similarity(*pictures, channel_axis=-1, data_range=1, **how)
    # Every second window, and other rims: close to the mean over all windows.
    assert float(ssim(first, second)) == pytest.approx(expected, abs=5e-3)
    assert whole.std() > 0.02  # the agreement is not that of a constant


@for_each("shape", SHAPES)
def test_loss_and_gradient_are_those_of_the_definition(shape):
    first, second = pair(*shape)
    loss, gradient = loss_and_gradient(photometric, first, second)
    expected_loss, expected = loss_and_gradient(reference.photometric, first, second)
    assert float(loss) == pytest.approx(float(expected_loss), rel=1e-12)
    torch.testing.assert_close(gradient, expected, rtol=1e-9, atol=1e-12 * float(expected.abs().max()))
    torch.testing.assert_close(ssim(first, second), reference.similarity(first, second).mean())


@for_each("shape", SHAPES[1:])
def test_float32_is_close_to_float64(shape):
    """Measured: 3e-7 of the loss and 1e-6 of the largest derivative, 6e-5 in the smallest pictures."""
    single, double = pair(*shape, dtype=torch.float32), pair(*shape, dtype=torch.float32)
    loss, gradient = loss_and_gradient(photometric, *single)
    expected_loss, expected = loss_and_gradient(reference.photometric, *(p.double() for p in double))
    assert gradient.dtype == loss.dtype == torch.float32
    assert float(loss) == pytest.approx(float(expected_loss), rel=1e-4)
    assert float((gradient - expected).abs().max()) < 3e-4 * float(expected.abs().max())


@for_each("dtype", [torch.float32, torch.float64])
def test_threads_change_no_bit(dtype):
    first, second = pair(dtype=dtype)
    one, *others = (loss_and_gradient(photometric, first, second, threads) for threads in (1, 2, 3, 16))
    for other in others:
        assert torch.equal(other[0], one[0])
        assert torch.equal(other[1], one[1])


def test_pictures_of_other_shapes_are_refused():
    for channels in (2, 4):
        with pytest.raises(ValueError, match="photometric: pictures must have 1 or 3 channels"):
            photometric(*pair(6, 5, channels))
    first, second = pair()
    with pytest.raises(ValueError, match=r"photometric: target must have shape \[60, 80, 3\]"):
        photometric(first, second[1:])


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
