"""The loss of a painted picture: equal to that of others, with its gradient, in bands or not."""

from concurrent.futures import ThreadPoolExecutor

import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs.refine import photometric as module  # noqa: E402
from brushgs.refine.photometric import photometric, ssim  # noqa: E402


@pytest.fixture(autouse=True)
def _one_thread():
    """As in a fit: torch's own threads wait busily for each other."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def pair(height=60, width=80, dtype=torch.float64):
    first = torch.rand(height, width, 3, generator=torch.Generator().manual_seed(0), dtype=dtype)
    noise = torch.rand(height, width, 3, generator=torch.Generator().manual_seed(1), dtype=dtype)
    return first, (0.7 * first + 0.3 * noise)


def test_similarity_is_that_of_others():
    from skimage.metrics import structural_similarity

    first, second = pair()
    expected, whole = structural_similarity(
        first.numpy(),
        second.numpy(),
        channel_axis=-1,
        data_range=1,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    # Every second window, and other rims: close to the mean over all windows.
    assert float(ssim(first, second)) == pytest.approx(expected, abs=5e-3)
    assert whole.std() > 0.02  # the agreement is not that of a constant


def test_equal_pictures_have_no_loss_and_others_do():
    first, second = pair()
    assert float(photometric(first, first)) == pytest.approx(0, abs=1e-12)
    assert float(photometric(first, second)) > 0.05


def test_the_gradient_is_that_of_finite_differences(monkeypatch):
    monkeypatch.setattr(module, "BAND", 2)  # windows of several bands see each pixel
    for height, width in ((10, 5), (3, 4)):
        first, second = (picture[..., :1].contiguous() for picture in pair(height, width))
        first.requires_grad_()
        assert torch.autograd.gradcheck(lambda x, y=second: photometric(x, y), first)


def test_windows_that_are_clipped_are_means_of_what_they_see():
    grey = torch.full((9, 12, 1), 0.5, dtype=torch.float64)
    # Of two plain pictures only the mean differs, in windows at the border as elsewhere.
    expected = (2 * 0.5 * 0.25 + 0.01**2) / (0.5**2 + 0.25**2 + 0.01**2)
    assert float(ssim(grey, 0.5 * grey)) == pytest.approx(expected, rel=1e-12)


def test_threads_change_no_bit(monkeypatch):
    monkeypatch.setattr(module, "BAND", 5)
    first, second = pair(dtype=torch.float32)
    found = []
    with ThreadPoolExecutor(3) as threads:
        for executor in (None, threads):
            painted = first.clone().requires_grad_()
            loss = photometric(painted, second, executor)
            loss.backward()
            found.append((loss.detach(), painted.grad))
    assert torch.equal(found[0][0], found[1][0])
    assert torch.equal(found[0][1], found[1][1])
