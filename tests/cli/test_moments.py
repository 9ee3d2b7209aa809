"""Commands that read one moment of a moving scene."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.io import read_scene
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from brushgs.page.export import command_of
from tests.io.moving.params_maker import write_params
from tests.scenes import real_scene, save_upright, still_life_of

SMALL = ["--strokes", "40", "--size", "48x36"]


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    """Three moments of a still life that slides, as a folder of files and as one archive."""
    place = tmp_path_factory.mktemp("clips")
    scene = still_life_of(1000).take(slice(None, None, 3))
    moments = [replace(scene, means=scene.means + np.float32([0.1 * index, 0, 0])) for index in range(3)]
    (place / "clip").mkdir()
    for index, moment in enumerate(moments):
        save_upright(moment, place / "clip" / f"frame_{index}.ply")
    return {"folder": place / "clip", "params": write_params(place / "clip.npz", moments)}


@pytest.fixture(params=["folder", "params"])
def clip(request, clips, tmp_path, monkeypatch):
    """The path of one of these; the current folder is empty."""
    monkeypatch.chdir(tmp_path)
    return clips[request.param]


def run(capsys, *words):
    code = main(list(map(str, words)))
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.parametrize(
    ("clip", "words"),
    [
        ("params", ["cluster", "--strokes", "50", "-o", "out.ply"]),
        ("folder", ["prune", "-o", "out.ply"]),
        ("params", ["recolor", "--palette", "palette.png", "-o", "out.ply"]),
        ("folder", ["render", *SMALL, "-o", "out.png"]),
        ("params", ["render", *SMALL, "-o", "out.png"]),
        ("folder", ["views", "--size", "32x24", "-o", "out.png"]),
        ("params", ["export", "--strokes", "40", "-o", "out.html"]),
        ("folder", ["doctor", "--fix", "out.ply"]),
        ("params", ["info"]),
    ],
    indirect=["clip"],
)
def test_every_command_takes_a_moment(clip, capsys, words):
    bg.save(bg.Frame(np.full((8, 8, 3), 0.5, np.float32), np.ones((8, 8), np.float32)), "palette.png")
    code, _, err = run(capsys, words[0], clip, "--time", "0.05", *words[1:])
    assert code == 0, err
    assert words[0] == "info" or next(Path().glob("out.*")).stat().st_size > 0
    code, _, err = run(capsys, words[0], clip, "--time", "9", *words[1:])
    assert code == 2
    assert "is after its end; choose another moment (--time)" in err
    assert err.count("\n") == 1


def test_moments_differ(clip, capsys):
    for time in ("0", "50%", "0.05", "100%"):
        assert run(capsys, "prune", clip, "--keep", "1", "--time", time, "-o", f"{time}.ply")[0] == 0
    lefts = [bg.load(f"{time}.ply").means[:, 0].mean() for time in ("0", "50%", "0.05", "100%")]
    np.testing.assert_allclose(np.diff(lefts), [0.1, 0.05, 0.05], atol=1e-4)


def test_info_tells_of_the_motion(clip, capsys):
    code, out, err = run(capsys, "info", clip, "--json")
    assert code == 0, err
    facts = json.loads(out)
    expected = {"duration": 0.0666667, "moments": 3, "rows_correspond": True, "resting_share": "not known"}
    assert {name: facts[name] for name in expected} == expected
    assert facts["seconds_are"].startswith("nominal")
    assert facts["format"].endswith("moment 0.00 s of 0.07 s")


@pytest.mark.parametrize("clip", ["folder"], indirect=True)
def test_looks_paints_a_moment(clip, capsys):
    sheet = ["--size", "48x36", "-o", "sheet.png"]
    code, _, err = run(capsys, "looks", "oil", "--scene", clip, "--time", "50%", *sheet)
    assert (code, Path("sheet.png").exists()) == (0, True), err
    code, _, err = run(capsys, "looks", "oil", "--time", "50%")
    assert code == 2
    assert "--time needs --scene" in err


def test_the_page_names_the_moment_in_its_command():
    for time in ("0.4", "40%", "all"):
        source = SceneSource((Path("clip"),), time=Moment.parse(time))
        assert command_of(source, ["--look", "ink"]) == ("clip", ["--time", time, "--look", "ink"])


def test_the_page_of_a_clip_names_the_moment_that_it_shows(clip):
    for scene, expected in ((SceneSource((clip,)), "0"), (SceneSource((clip,), time=Moment(0.05)), "0.05")):
        _, notes = read_scene(scene)
        assert command_of(scene, [], notes)[1] == ["--time", expected]
    bg.save(still_life_of(1000), "still.ply")
    assert command_of(SceneSource((Path("still.ply"),)), [], read_scene("still.ply")[1])[1] == []


@pytest.mark.parametrize("command", ["render", "cluster", "prune", "info", "doctor", "export"])
def test_a_moment_of_a_scene_at_rest_is_refused(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    bg.save(still_life_of(1000), "still.ply")
    code, _, err = run(capsys, command, "still.ply", "--time", "0.4")
    assert (code, err) == (
        2,
        "brushgs: still.ply: is a scene at rest, which has no moments; omit the time (--time)\n",
    )


@pytest.mark.parametrize("scene", ["nothing.splatv", "nothing/*.ply"])
def test_a_moment_of_what_is_not_there_is_refused_as_that(tmp_path, monkeypatch, capsys, scene):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, "render", scene, "--time", "0.4")
    assert (code, err) == (2, f"brushgs: {scene}: there is no such file; check the path\n")


@pytest.mark.parametrize("text", ["soon", "-1", "120%", "1,5"])
def test_what_is_no_moment_is_refused_by_its_flag(capsys, text):
    code, _, err = run(capsys, "info", "a.ply", f"--time={text}")
    assert code == 2
    assert "--time" in err
    assert "must be" in err


def test_files_that_lie_in_one_place_are_told_with_the_cure(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("scans").mkdir()
    for index in range(3):
        bg.save(still_life_of(1000), f"scans/scan_{index}.ply")
    code, out, _ = run(capsys, "info", "scans", "--json")
    facts = json.loads(out)
    assert (code, facts["moments"]) == (0, 3)
    num_rows = facts["gaussians"]
    assert [note for note in facts["notes"] if "add --time all" in note]
    code, out, _ = run(capsys, "info", "scans", "--time", "all", "--json")
    facts = json.loads(out)
    assert (code, facts["gaussians"], facts["notes"]) == (0, 3 * num_rows, [])
    assert "moments" not in facts


def test_a_real_clip_has_a_moment(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    clip = real_scene("moving/cook_spinach.splatv")
    code, out, err = run(capsys, "info", clip, "--time", "50%", "--json")
    assert code == 0, err
    facts = json.loads(out)
    assert (facts["moments"], facts["rows_correspond"]) == ("any", True)
    assert 50_000 < facts["gaussians"] < 62_442
    assert run(capsys, "doctor", clip, "--time", "50%", "--quiet")[0] in (0, 3)
    assert run(capsys, "prune", clip, "--time", "50%", "-o", "a.ply", "--quiet")[0] == 0
