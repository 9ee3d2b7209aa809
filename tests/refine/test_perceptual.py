"""Networks that compare pictures: equal to reference implementations, and damaged weights are refused."""

import json
import pickle
import shutil
from io import BytesIO

import numpy as np
import pytest

from tests.kit import for_each, save_opaque

torch = pytest.importorskip("torch", reason="needs the extra [refine]")
pytest.importorskip("transformers", reason="needs the extra [text]")

from brushgs.cli import main  # noqa: E402
from brushgs.refine.perceptual import LPIPS_FILE, NETWORKS, ClipPictures, Dino, Dists, Lpips  # noqa: E402
from brushgs.refine.vgg import WIDTHS  # noqa: E402
from tests.passes.where.tiny_clip import SIDE, save_tiny_clip  # noqa: E402
from tests.refine.weights import random_vgg  # noqa: E402

NUM_DISTS = 3 + sum(WIDTHS)


@pytest.fixture(scope="module")
def network():
    return random_vgg()


@pytest.fixture(scope="module")
def folder(tmp_path_factory, network):
    """A folder with all weights, small or random; VGG-16 as safetensors."""
    from safetensors.torch import save_file
    from transformers import Dinov2Config, Dinov2Model

    path = tmp_path_factory.mktemp("weights")
    vgg = {f"features.{name}": value for name, value in network.state_dict().items()}
    save_file(vgg, path / "vgg16.safetensors")
    lins = {f"lin{row}.model.1.weight": torch.rand(1, width, 1, 1) for row, width in enumerate(WIDTHS)}
    torch.save(lins, path / "lpips_vgg.pth")
    torch.save({name: torch.rand(1, NUM_DISTS, 1, 1) for name in ("alpha", "beta")}, path / "dists.pt")
    save_tiny_clip(path / "clip")
    size = {"hidden_size": 16, "num_attention_heads": 2, "num_hidden_layers": 2}
    Dinov2Model(Dinov2Config(**size, patch_size=14, image_size=28)).save_pretrained(path / "dino")
    return path


def pictures(height, width, seed=0):
    rng = np.random.default_rng(seed)
    first = rng.random((height, width, 3)).astype(np.float32)
    return first, np.clip(first + rng.normal(0, 0.2, first.shape), 0, 1).astype(np.float32)


def tensors(*some):
    return [torch.from_numpy(one.transpose(2, 0, 1).copy())[None] for one in some]


def test_lpips_is_that_of_the_reference(folder, network, monkeypatch):
    reference = pytest.importorskip("torchmetrics.functional.image.lpips")
    monkeypatch.setattr(reference, "_get_tv_model_features", lambda net, pretrained: network)
    expected = reference._LPIPS(net="vgg", model_path=str(folder / "lpips_vgg.pth"))
    first, second = pictures(40, 53)
    found = expected(*(2 * one - 1 for one in tensors(first, second))).item()
    assert Lpips(folder)(first, second) == pytest.approx(found, rel=1e-5)
    assert Lpips(folder)(first, first) == 0


def test_dists_is_that_of_the_reference(folder, network, monkeypatch):
    reference = pytest.importorskip("torchmetrics.functional.image.dists")

    class Torchvision:
        features, DEFAULT = network, None

    monkeypatch.setattr(reference, "vgg16", lambda weights: Torchvision, raising=False)
    monkeypatch.setattr(reference, "VGG16_Weights", Torchvision, raising=False)
    monkeypatch.setattr(reference, "_TORCHVISION_AVAILABLE", True)
    monkeypatch.setattr(reference, "_PATH_WEIGHT_DISTS", folder / "dists.pt")
    first, second = pictures(40, 53)
    found = reference.DISTSNetwork()(*tensors(first, second)).item()
    assert Dists(folder)(first, second) == pytest.approx(found, abs=1e-5)
    assert Dists(folder)(first, first) == pytest.approx(0, abs=1e-6)


def test_clip_and_its_quality_are_those_of_the_library(folder):
    from transformers import CLIPModel, CLIPTokenizerFast

    own, (first, second) = ClipPictures(folder), pictures(SIDE, SIDE)
    model = CLIPModel.from_pretrained(folder / "clip").eval()
    tokenizer = CLIPTokenizerFast.from_pretrained(folder / "clip")
    tokens = tokenizer(["Good photo.", "Bad photo."], padding=True, return_tensors="pt")
    with torch.inference_mode():
        out = model(**tokens, pixel_values=(torch.cat(tensors(first, second)) - 0.5) / 0.25)
    a, b = out.image_embeds
    assert float(own.embed(first) @ own.embed(second)) == pytest.approx(float(a @ b), abs=1e-5)
    expected = (100 * out.text_embeds @ a).softmax(0)[0]
    assert own.quality(first) == pytest.approx(float(expected), abs=1e-5)


def test_dino_is_the_class_token_of_the_library(folder):
    from transformers import Dinov2Model

    first, _ = pictures(28, 28)
    mean, std = (torch.tensor(v).view(1, 3, 1, 1) for v in ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)))
    model = Dinov2Model.from_pretrained(folder / "dino").eval()
    with torch.inference_mode():
        token = model((tensors(first)[0] - mean) / std).pooler_output[0]
    np.testing.assert_allclose(Dino(folder).embed(first), token / token.norm(), atol=1e-5)


def test_the_command_prints_every_measure_and_the_hashes(folder, tmp_path, capsys):
    for name in ("painted", "plain"):
        (tmp_path / name).mkdir()
        for row in range(2):
            save_opaque(tmp_path / name / f"{row}.png", pictures(20, 30, seed=row)[name == "plain"])
    words = [str(tmp_path / "painted"), "--plain", str(tmp_path / "plain"), "--weights", str(folder)]
    assert main(["compare", *words, "--style", str(tmp_path / "plain" / "0.png"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    values = {figure["name"]: figure["values"] for figure in found["figures"]}
    assert set(values) == {"psnr", "ssim", "flip", "uiqm", *(network.name for network in NETWORKS)}
    assert set(values["lpips"]) == {"plain", "next"}
    assert set(values["clip"]) == {"plain", "next", "style"}
    assert not found["missing"]
    assert {"vgg16.safetensors", "clip/model.safetensors"} < set(found["weights"])
    assert all(digest.startswith("sha256 ") for digest in found["weights"].values())


def test_what_is_missing_is_one_sentence_and_the_rest_is_measured(tmp_path, capsys):
    save_opaque(tmp_path / "a.png", pictures(20, 20)[0])
    assert main(["compare", str(tmp_path / "a.png"), "--weights", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("uiqm")
    missing = [line for line in lines if "not measured" in line]
    assert len(missing) == len(NETWORKS)
    assert "lacks vgg16-397923af.pth (or .safetensors)" in missing[0]
    assert "https://download.pytorch.org/models/vgg16-397923af.pth" in missing[0]


class Code:
    """A pickle that runs code when it is opened."""

    def __reduce__(self):
        return (print, ("code ran",))


LIN = "lin0.model.1.weight"


def saved(value):
    """The bytes of a file of torch."""
    torch.save(value, file := BytesIO())
    return file.getvalue()


DAMAGES = [  # and what is saved in place of the weights
    ("cannot be read as weights", lambda weights: pickle.dumps(Code())),
    ("cannot be read as weights", lambda weights: {LIN: Code()}),
    ("cannot be read as weights", lambda weights: saved(weights)[:1000]),
    ("is not a state dict of tensors", lambda weights: [1, 2]),
    (f"{LIN} must have shape [1, 64, 1, 1], got [3]", lambda weights: weights | {LIN: torch.zeros(3)}),
    (f"{LIN} must hold finite floats", lambda weights: weights | {LIN: np.nan * weights[LIN]}),
]


@for_each(("sentence", "damage"), DAMAGES)
def test_damaged_weights_end_with_one_sentence(sentence, damage, folder, tmp_path, capsys):
    if not (tmp_path / "vgg16.safetensors").exists():
        (tmp_path / "vgg16.safetensors").symlink_to(folder / "vgg16.safetensors")
    path = tmp_path / LPIPS_FILE.names[0]
    damaged = damage(dict(torch.load(folder / path.name, weights_only=True)))
    path.write_bytes(damaged if isinstance(damaged, bytes) else saved(damaged))
    save_opaque(tmp_path / "a.png", pictures(20, 20)[0])
    words = [str(tmp_path / "a.png"), "--plain", str(tmp_path / "a.png"), "--weights", str(tmp_path)]
    assert main(["compare", *words]) == 2
    out, error = capsys.readouterr()
    assert "code ran" not in out + error
    assert f"{path}: " in error
    assert sentence in error.strip().splitlines()[-1]
    assert "Traceback" not in error


def test_damaged_models_end_with_one_sentence(folder, tmp_path, capsys):
    from safetensors.torch import load_file, save_file

    save_opaque(tmp_path / "a.png", pictures(20, 20)[0])
    words = ["compare", str(tmp_path / "a.png"), "--plain", str(tmp_path / "a.png")]
    shutil.copytree(folder / "dino", tmp_path / "dino")
    path = tmp_path / "dino" / "model.safetensors"
    nan = {name: torch.full_like(value, torch.nan) for name, value in load_file(path).items()}
    save_file(nan, path, metadata={"format": "pt"})
    assert main([*words, "--weights", str(tmp_path)]) == 2
    assert "gives numbers that are not finite" in capsys.readouterr().err
    path.rename(path.with_name("pytorch_model.bin"))
    assert main([*words, "--weights", str(tmp_path)]) == 2
    assert "pytorch_model.bin can be a pickle that runs code" in capsys.readouterr().err
