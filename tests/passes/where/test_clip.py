"""CLIP from a folder: the real code path with random weights, and each folder that is not one."""

import json
import socket
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("transformers", reason="the extra `text` is not installed")

from brushgs.errors import SceneError
from brushgs.passes.where.clip import ClipEncoder
from tests.kit.for_each import for_each
from tests.passes.where.tiny_clip import PATCH, SIDE, save_tiny_clip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return save_tiny_clip(tmp_path_factory.mktemp("clip"))


@pytest.fixture
def own(folder, tmp_path):
    """A copy that a test may spoil."""
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


@pytest.fixture
def no_network(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("the network was asked")

    for name in ("connect", "connect_ex", "sendto"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)


def test_words_and_patches_are_unit_vectors_of_one_space(folder, no_network):
    encoder = ClipEncoder(folder)
    assert (encoder.side, encoder.patch) == (SIDE // PATCH, PATCH)
    words = encoder.of_words(["red", "a blue truck"])
    patches = encoder.of_windows(np.random.default_rng(0).random((11, SIDE, SIDE, 3)).astype(np.float32))
    assert (words.shape, patches.shape) == ((2, 8), (11, 4, 4, 8))
    for vectors in (words, patches):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1)
    with pytest.raises(ValueError, match="at most 12 tokens"):
        encoder.of_words(["one two three four five six"])


def test_words_agree_with_the_library_itself(folder):
    import torch
    from transformers import CLIPModel, CLIPTokenizerFast

    model, tokens = CLIPModel.from_pretrained(folder), CLIPTokenizerFast.from_pretrained(folder)("red truck")
    with torch.inference_mode():
        found = model.get_text_features(**{name: torch.tensor([ids]) for name, ids in tokens.items()})
    found = getattr(found, "pooler_output", found)[0].numpy()
    expected = found / np.linalg.norm(found)
    np.testing.assert_allclose(ClipEncoder(folder).of_words(["red truck"])[0], expected, atol=1e-5)


def test_a_patch_speaks_through_the_values_of_the_last_layer(folder):
    """By hand, from what the library says goes into the last layer."""
    import torch
    from transformers import CLIPModel

    window = np.random.default_rng(1).random((1, SIDE, SIDE, 3)).astype(np.float32)
    pixels = torch.from_numpy(((window - 0.5) / 0.25).transpose(0, 3, 1, 2).copy())
    model = CLIPModel.from_pretrained(folder).eval()
    vision = model.vision_model
    with torch.inference_mode():
        hidden = vision.pre_layrnorm(vision.embeddings(pixels))
        hidden = vision.encoder.layers[0](hidden, attention_mask=None)
        hidden = hidden[0] if isinstance(hidden, tuple) else hidden
        last = vision.encoder.layers[1]
        hidden = last.self_attn.out_proj(last.self_attn.v_proj(last.layer_norm1(hidden)))
        hidden = model.visual_projection(vision.post_layernorm(hidden))[0, 1:].reshape(4, 4, 8).numpy()
    expected = hidden / np.linalg.norm(hidden, axis=-1, keepdims=True)
    np.testing.assert_allclose(ClipEncoder(folder).of_windows(window)[0], expected, atol=1e-5)


def test_a_tokenizer_in_one_file_says_the_same(folder, own):
    from transformers import CLIPTokenizerFast

    CLIPTokenizerFast.from_pretrained(folder).save_pretrained(own)
    for name in ("vocab.json", "merges.txt"):
        (own / name).unlink(missing_ok=True)
    assert (own / "tokenizer.json").exists()
    words = ["red", "a truck"]
    np.testing.assert_array_equal(ClipEncoder(own).of_words(words), ClipEncoder(folder).of_words(words))


PICKLE = b"\x80\x04cos\nsystem\n(S'touch hacked'\ntR."
WEIGHTS = "model.safetensors"
# Files that are taken away (None), changed (a dictionary, of JSON), or written.
REFUSED = [
    ({"config.json": None}, r"has no config\.json; bring CLIP as"),
    ({WEIGHTS: None}, "has no weights: model.safetensors is missing"),
    ({"vocab.json": None}, r"no tokenizer\.json, and no vocab\.json with merges\.txt"),
    ({WEIGHTS: None, "pytorch_model.bin": PICKLE}, "pytorch_model.bin, which can be a pickle .*safetensors"),
    ({WEIGHTS: None, "ViT-B-32.pt": PICKLE}, "ViT-B-32.pt, which can be a pickle .*safetensors"),
    ({"config.json": {"model_type": "siglip"}}, "must be the configuration .* 'clip', got \"siglip\""),
    ({"config.json": b"[1]"}, r"must be a JSON object, got \[1\]; bring CLIP as"),
    ({"config.json": b"{"}, "is not JSON"),
    ({"config.json": {"vision_config": {"patch_size": 0}}}, "patch_size must be 1 to 64"),
    ({"config.json": {"vision_config": {"image_size": 1e6}}}, "image_size must be 1 to 1024"),
    ({"config.json": {"vision_config": {"patch_size": 32, "image_size": 16}}}, "patch_size exceeds"),
    ({"adapter_config.json": b"{}"}, "is an adapter to another model"),
    ({WEIGHTS: "visual_projection.weight"}, "lacks 1 of the weights of CLIP, first visual_projection.weight"),
    ({WEIGHTS: b"cut short"}, "cannot be opened as CLIP"),
    ({"config.json": {"projection_dim": 16}}, "cannot be opened as CLIP"),
    ({"preprocessor_config.json": b'{"image_mean": [1, 2]}'}, "image_mean must be 3 numbers"),
    ({"preprocessor_config.json": b'{"image_std": [1, 1, 0]}'}, r"image_std\[2\] must be a number above 0"),
]


def spoil(path, change):
    if change is None:
        path.unlink()
    elif isinstance(change, bytes):
        path.write_bytes(change)
    elif isinstance(change, dict):
        path.write_text(json.dumps(json.loads(path.read_text()) | change))
    else:
        from safetensors.torch import load_file, save_file

        weights = load_file(path)
        del weights[change]
        save_file(weights, path, metadata={"format": "pt"})


@pytest.mark.parametrize(("files", "message"), REFUSED)
def test_what_is_no_clip_is_refused_with_the_cure(own, no_network, files, message):
    for name, change in files.items():
        spoil(own / name, change)
    before = set(Path.cwd().iterdir())
    with pytest.raises(SceneError, match=message) as caught:
        ClipEncoder(own)
    message = str(caught.value)
    assert str(own) in message
    assert ";" in message
    assert "\n" not in message
    assert set(Path.cwd().iterdir()) == before, "nothing was run"


@for_each("name", ["nowhere", "openai/clip-vit-base-patch32", "file.txt", "zero\0byte"])
def test_what_is_no_folder_is_refused(tmp_path, no_network, name):
    (tmp_path / "file.txt").write_text("")
    with pytest.raises(SceneError, match=r"is no folder|is a file, not the folder"):
        ClipEncoder(tmp_path / name)
