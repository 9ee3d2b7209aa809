"""`--where text:words`: by a model of the user's, with random weights here; refused where there is none."""

import json
import sys

import pytest

import brushgs as bg
from brushgs.cli import main

pytest.importorskip("transformers", reason="the extra `text` is not installed")

from tests.kit.commands import refused
from tests.passes.where.tiny_clip import save_tiny_clip
from tests.scenes import still_life_of


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("text")
    bg.save(still_life_of(1000), folder / "a.ply")
    save_tiny_clip(folder / "clip")
    return folder


@pytest.fixture(autouse=True)
def here(place, monkeypatch):
    monkeypatch.chdir(place)
    monkeypatch.delenv("BRUSHGS_CLIP", raising=False)
    monkeypatch.setattr("brushgs.passes.where.text.VIEW", 64)  # pixels: still some windows of 32


def where_of(capsys, *words):
    assert main(["info", "a.ply", "--json", "--where", *words]) == 0
    facts = json.loads(capsys.readouterr().out)
    return {name: value for name, value in facts.items() if name.startswith("where_")}


def test_words_are_found_by_a_model_from_a_folder(capsys, monkeypatch):
    found = where_of(capsys, "text:red jug or box:-9,-9,-9,0,9,9", "--text-model", "clip")
    box = where_of(capsys, "box:-9,-9,-9,0,9,9")
    assert box["where_gaussians"] <= found["where_gaussians"]
    monkeypatch.setenv("BRUSHGS_CLIP", "clip")
    assert where_of(capsys, "text:red jug or box:-9,-9,-9,0,9,9") == found


def test_rules_name_their_model_beside_them(capsys, place):
    (place / "rules").mkdir(exist_ok=True)
    rules = place / "rules" / "r.toml"
    region = '[[region]]\nwhere = "text:red or subject"\nadjust = {saturation = 0}\n'
    rules.write_text(f'clip = "../clip"\n{region}')
    words = ["render", "a.ply", "--rules", str(rules), "--look", "plain", "--see", "off"]
    words += ["--strokes", "50", "--size", "32x24"]
    assert main([*words, "-o", "a.png", "--quiet"]) == 0
    rules.write_text('[[region]]\nwhere = "text:red"\nsize = 0.5\n')
    assert main([*words, "-o", "b.png"]) == 2
    message = capsys.readouterr().err
    assert "[[region]] 1 where has text:red, which needs a CLIP model" in message
    assert 'text_model = "folder"' in message


def refused_without(capsys, *words):
    return refused(capsys, "prune", "a.ply", "--where", "text:red jug", "-o", "b.ply", "--quiet", *words)


def test_words_without_a_model_are_refused_before_anything_is_loaded(capsys, monkeypatch):
    monkeypatch.setattr("brushgs.formats.read_scene", None)
    assert "where has text:red jug, which needs --text-model FOLDER, a CLIP model" in refused_without(capsys)


def test_what_is_no_model_is_refused(capsys):
    for name in ("nowhere", "a.ply"):
        assert f"{name}: is " in refused_without(capsys, "--text-model", name)


def test_a_pickle_is_refused_with_the_cure(capsys, tmp_path, place):
    for path in (place / "clip").iterdir():
        name = path.name.replace("model.safetensors", "pytorch_model.bin")
        (tmp_path / name).write_bytes(path.read_bytes())
    message = refused_without(capsys, "--text-model", str(tmp_path))
    assert "pytorch_model.bin, which can be a pickle" in message
    assert "save_pretrained" in message


def test_a_missing_library_is_refused_with_the_cure(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "transformers", None)
    assert "pip install 'brushgs[text]'" in refused_without(capsys, "--text-model", "clip")
