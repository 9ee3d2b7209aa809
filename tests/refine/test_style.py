"""Features without weights, VGG from a file, and matching them tile by tile."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

import brushgs as bg  # noqa: E402
from brushgs.refine import nnfm  # noqa: E402
from brushgs.refine.filter_bank import _KINDS, FilterBank  # noqa: E402
from brushgs.refine.vgg import Vgg  # noqa: E402
from tests.kit.for_each import for_each  # noqa: E402
from tests.refine.weights import save_vgg  # noqa: E402


def stripes(angle, height=96, width=128, period=6.0):
    """[3, H, W] a grey pattern of stripes that run in a direction."""
    y, x = np.mgrid[:height, :width]
    wave = 0.5 + 0.4 * np.sin(2 * np.pi * (np.cos(angle) * y - np.sin(angle) * x) / period)
    return torch.from_numpy(np.stack([wave] * 3)).float()


def noise(height=96, width=128, seed=0):
    return torch.rand(3, height, width, generator=torch.Generator().manual_seed(seed))


@pytest.fixture(scope="module")
def vgg_file(tmp_path_factory):
    """Gives a file of torchvision's layout with random weights."""
    folder = tmp_path_factory.mktemp("vgg")
    return lambda depth: save_vgg(folder / "w.pth", depth)


@for_each("angle", [0.0, np.pi / 8, np.pi / 2, -np.pi / 4])
def test_stripes_answer_to_the_filter_of_their_direction(angle):
    edges = FilterBank(noise())(stripes(angle))[0][_KINDS[3]][:8].mean(dim=(1, 2))
    # A filter at k pi / 8 bends across that direction: stripes along `angle` bend at a right angle to it.
    assert int(edges.argmax()) == round((angle + np.pi / 2) / (np.pi / 8)) % 8


def test_the_style_image_is_at_distance_nought_from_itself_and_turned_stripes_are_not():
    painting = stripes(0.3)
    style = nnfm.NearestStyle(FilterBank(painting), painting)
    same, _, _ = nnfm.style_gradient(painting, style, None, 0.0)
    turned, _, _ = nnfm.style_gradient(stripes(0.3 + np.pi / 2), style, None, 0.0)
    assert same < 1e-5
    assert turned > 0.1


def test_tiles_change_neither_losses_nor_gradient(monkeypatch):
    picture, content = noise(60, 100, 1), noise(60, 100, 2)
    style = nnfm.NearestStyle(FilterBank(noise()), noise())
    whole = nnfm.style_gradient(picture, style, content, 0.5)
    monkeypatch.setattr(nnfm, "TILE", 48)
    tiled = nnfm.style_gradient(picture, style, content, 0.5)
    assert tiled[:2] == pytest.approx(whole[:2], rel=1e-5)
    np.testing.assert_allclose(tiled[2], whole[2], atol=2e-5 * float(whole[2].abs().max()))


def test_the_gradient_is_that_of_finite_differences():
    picture, content = noise(40, 48, 1).double(), noise(40, 48, 2).double()
    style = nnfm.NearestStyle(FilterBank(noise()), noise())
    style._sets = [own.double() for own in style._sets]
    _, _, gradient = nnfm.style_gradient(picture, style, content, 0.5)
    way = torch.randn(picture.shape, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    losses = []
    for sign in (1, -1):
        near, kept, _ = nnfm.style_gradient(picture + sign * 1e-5 * way, style, content, 0.5)
        losses.append(near + 0.5 * kept)
    assert float((gradient * way).sum()) == pytest.approx((losses[0] - losses[1]) / 2e-5, rel=1e-3)


@for_each(("depth", "channels"), [(16, 768), (19, 1024)])
def test_vgg_reads_torchvisions_file(vgg_file, depth, channels):
    path = vgg_file(depth)
    features = Vgg(path)
    assert features.depth == depth
    (group,) = features(noise(64, 96))
    assert group.shape == (channels, 16, 24)
    # The first layers by hand.
    state = torch.load(path, weights_only=True)
    mean, std = torch.tensor(((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)))
    x = (noise(64, 96) - mean[:, None, None]) / std[:, None, None]
    for place in (0, 2, "pool", 5, 7, "pool", 10):
        if place == "pool":
            x = torch.nn.functional.max_pool2d(x[None], 2)[0]
        else:
            names = f"features.{place}.weight", f"features.{place}.bias"
            x = torch.relu(torch.nn.functional.conv2d(x[None], *(state[n] for n in names), padding=1))[0]
    np.testing.assert_allclose(group[:256], x, rtol=1e-4, atol=1e-4)


@for_each(
    ("damage", "sentence"),
    [
        (lambda state: state.pop("features.10.weight"), r"10\.weight must have shape .*got nothing"),
        (lambda state: state.update({"features.0.bias": torch.zeros(3)}), r"features\.0\.bias .* got \[3\]"),
        (lambda state: state["features.5.bias"].fill_(np.nan), r"features\.5\.bias must hold finite"),
    ],
)
def test_a_file_of_other_weights_is_refused(vgg_file, damage, sentence, tmp_path):
    state = torch.load(vgg_file(16), weights_only=True)
    damage(state)
    torch.save(state, tmp_path / "w.pth")
    with pytest.raises(bg.SceneError, match=sentence):
        Vgg(tmp_path / "w.pth")
    with pytest.raises(bg.SceneError, match="there is no such file; check the path of the weights"):
        Vgg(tmp_path / "none.pth")


@pytest.mark.parametrize("is_tiled", [False, True])
def test_the_gram_loss_and_its_gradient_are_those_of_the_formula(is_tiled, monkeypatch):
    if is_tiled:
        monkeypatch.setattr(nnfm, "TILE", 48)
    painting, picture = noise(), noise(60, 100, 1).double()
    features = FilterBank(painting)
    style = nnfm.GramStyle(features, painting)
    style._grams = [gram.double() for gram in style._grams]
    loss, _, gradient = nnfm.style_gradient(picture, style, None, 0.0)

    def gram(pixels):
        return [(f.flatten(1) @ f.flatten(1).T) / f[0].numel() for f in features(pixels)]

    whole = picture.clone().requires_grad_()
    terms = zip(gram(whole), gram(painting.double()), strict=True)
    expected = torch.stack([(a - b).square().sum() / b.square().sum() for a, b in terms]).mean()
    expected.backward()
    assert loss == pytest.approx(expected.item(), rel=1e-5)
    np.testing.assert_allclose(gradient, whole.grad, atol=1e-5 * float(whole.grad.abs().max()))
    assert nnfm.style_gradient(painting.double(), style, None, 0.0)[0] < 1e-6


def test_layers_are_groups_by_block_for_nnfm_and_each_alone_for_gram(vgg_file):
    path, layers = vgg_file(16), ("conv2", "conv3_1")
    joined, split = (Vgg(path, layers, is_split=is_split) for is_split in (False, True))
    assert joined.strides == (2, 4)
    assert [group.shape[0] for group in joined(noise(64, 96))] == [256, 256]
    assert split.strides == (2, 2, 4)
    pairs = zip(joined(noise(64, 96)), (split(noise(64, 96))[:2], split(noise(64, 96))[2:]), strict=True)
    assert all(torch.equal(whole, torch.cat(parts)) for whole, parts in pairs)
    with pytest.raises(ValueError, match="block 3 of VGG-16 has 3 layers"):
        Vgg(path, ["conv3_4"])
