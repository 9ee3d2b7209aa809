"""`brushgs export -o FILE.glb`: paintings of scenes as rectangles."""

import json
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.formats.pictures.images import read_image
from brushgs.outlets.glb.write import omitted
from brushgs.rendering.canvas import Painting
from brushgs.rendering.light import Lamp
from tests.outlets.glb.draw import picture_of
from tests.outlets.glb.glb import Glb
from tests.outlets.glb.rules import check_rules
from tests.outlets.page.paintings import CAMERA, some_coat, some_strokes
from tests.scenes import save_upright, still_life_of

# Without what takes most of the time of a small painting, and is no matter of files.
SMALL = ["--strokes", "150", "--size", "96x64", "--threads", "1", "--see", "off", "--focus", "off"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    save_upright(still_life_of(2000), path)
    return str(path)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(capsys, *words):
    code = cli.main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def read(name):
    glb = Glb(Path(name).read_bytes())
    check_rules(glb)
    return glb


LOOKS = ["oil", "oil --for-view", "watercolour", "charcoal --for-view", "ink", "ink --for-view"]


@pytest.mark.parametrize("words", LOOKS)
def test_every_kind_of_look_becomes_a_model(scene, capsys, words):
    look, *more = words.split()
    words = "export", scene, "-o", "a.glb", "--look", look, "--json", "--title", "Pears", *more, *SMALL
    code, out, _ = run(capsys, *words)
    assert code == 0
    report = json.loads(out)
    assert report["output"] == "a.glb"
    counts = {stage["name"]: stage["counts"] for stage in report["stages"]}["quads"]
    glb = read("a.glb")
    assert glb.top["scenes"][0]["name"] == "Pears"
    assert counts["bytes"] == Path("a.glb").stat().st_size
    meshes = list(glb.meshes())
    assert counts["coats"] == len(meshes)
    assert counts["quads"] == sum(len(vertices) // 4 for _, vertices, *_ in meshes)
    assert counts["for_view"] == bool(more)


def test_the_first_view_is_that_of_render(scene, capsys):
    words = ["--look", "plain", "--stroke", "flat", "--background", "transparent", *SMALL]
    assert run(capsys, "render", scene, "-o", "a.png", "--underpaint", "on", *words)[0] == 0
    assert run(capsys, "export", scene, "-o", "a.glb", "--for-view", "--underpaint", "on", *words)[0] == 0
    wanted = read_image("a.png").astype(np.float64)
    wanted[..., :3] *= wanted[..., 3:]
    found = picture_of(read("a.glb"), 96, 64)
    assert np.abs(found - wanted).mean() < 0.01  # 0.0072 was measured, on edges and in streaks


def test_what_is_lost_is_told(scene, capsys):
    code, out, _ = run(capsys, "export", scene, "-o", "a.glb", "--look", "oil", *SMALL, "--json")
    assert code == 0
    told = json.loads(out)["stages"][-1]["skipped"]
    assert "the file has no lamp: that of the program lights the ridges of the paint" in told
    coats = some_coat(some_strokes(4, degree=1), "flat", underpaint=True, streaks=0.1, border=0.1)
    lit = Painting((coats,), lamp=Lamp())
    for word in ("lamp", "streaks", "colours", "border"):
        assert sum(word in sentence for sentence in omitted(lit, CAMERA, for_view=False)) == 1
    assert not any("colours" in sentence for sentence in omitted(lit, CAMERA, for_view=True))
    glaze = some_coat(some_strokes(4), "flat", blend="glaze")
    (sentence,) = omitted(Painting((glaze, glaze)), CAMERA, for_view=True)
    assert "multiply" in sentence
    assert omitted(Painting((some_coat(some_strokes(4)),)), CAMERA, for_view=False) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.gltf"], "output must end in .html, .glb"),
        (["-o", "a.html", "--for-view"], "--for-view needs -o FILE.glb"),
        (["--for-view"], "--for-view needs -o FILE.glb"),
        (["-o", "a.glb", "--stroke", "no_such"], "no_such"),
    ],
)
def test_bad_input_is_one_sentence_and_no_file(scene, capsys, words, said):
    code, out, err = run(capsys, "export", scene, *words)
    assert (code, out, list(Path().iterdir())) == (2, "", [])
    assert said in err
    assert err.count("\n") == 1


def test_a_scene_is_not_replaced(capsys):
    bg.save(some_strokes(30), "scene.ply")
    Path("link.glb").symlink_to("scene.ply")
    content = Path("scene.ply").read_bytes()
    assert "is the input" in run(capsys, "export", "scene.ply", "-o", "link.glb", "--quiet")[2]
    assert Path("scene.ply").read_bytes() == content
