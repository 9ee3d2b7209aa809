"""Commands that read one moment of a moving scene."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from brushgs.outlets.page.export import command_of
from tests.io.moving.params_maker import write_params
from tests.scenes import real_scene, save_upright, still_life_of

SMALL = ["--strokes", "40", "--size", "48x36", "--see", "off"]


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
        ("folder", ["render", *SMALL, "-o", "out.png"]),
        ("params", ["export", *SMALL, "-o", "out.html"]),
        ("folder", ["doctor", "--fix", "out.ply"]),
        ("params", ["info"]),
    ],
    indirect=["clip"],
)
def test_every_command_takes_a_moment(clip, capsys, words):
    code, _, err = run(capsys, words[0], clip, "--time", "0.05", *words[1:])
    assert code == 0, err
    assert words[0] == "info" or next(Path().glob("out.*")).stat().st_size > 0
    code, _, err = run(capsys, words[0], clip, "--time", "9", *words[1:])
    assert code == 2
    assert "is after its end; choose another moment (--time)" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("clip", "times"),
    [
        ("folder", ("0", "0.0417", "50%", "100%")),
        ("params", ("0", "50%", "0.05", "100%")),
    ],  # 24 and 30 a second
    indirect=["clip"],
)
def test_moments_differ(clip, times, capsys):
    for time in times:
        assert run(capsys, "prune", clip, "--keep", "1", "--time", time, "-o", f"{time}.ply")[0] == 0
    lefts = [bg.load(f"{time}.ply").means[:, 0].mean() for time in times]
    np.testing.assert_allclose(np.diff(lefts), [0.1, 0.05, 0.05], atol=1e-4)


@pytest.mark.parametrize(
    ("clip", "words", "seconds", "rate"),
    [
        ("folder", [], 0.125, 24),
        ("folder", ["--moments-per-second", "2"], 1.5, 2),
        ("params", [], 0.0666667, None),
    ],
    indirect=["clip"],
)
def test_info_tells_of_the_motion(clip, words, seconds, rate, capsys):
    code, out, err = run(capsys, "info", clip, *words, "--json")
    assert code == 0, err
    facts = json.loads(out)
    expected = {"duration": seconds, "moments": 3, "rows_correspond": True, "resting_share": "not known"}
    assert {name: facts[name] for name in expected} == expected
    assert facts["seconds_are"].startswith("nominal")
    assert facts.get("moments_per_second") == rate
    assert rate is None or f"{rate} moments a second" in facts["seconds_are"]
    assert facts["format"].endswith(f"moment 0.00 s of {seconds:.2f} s")


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


@pytest.mark.parametrize("command", ["render", "info"])
def test_a_moment_of_a_scene_at_rest_is_refused(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    bg.save(still_life_of(1000), "still.ply")
    code, _, err = run(capsys, command, "still.ply", "--time", "0.4")
    assert (code, err) == (
        2,
        "brushgs: still.ply: is a scene at rest, which has no moments; omit the time (--time)\n",
    )


@pytest.mark.parametrize("command", ["render", "view"])
def test_a_rate_of_moments_is_refused_where_there_are_none(clips, tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    bg.save(still_life_of(1000), "still.ply")
    for name in ("tile_0.ply", "tile_1.ply"):
        Path("tiles").mkdir(exist_ok=True)
        bg.save(still_life_of(1000), f"tiles/{name}")
    rate, omit = (
        ["--moments-per-second", "12"],
        "which has no moments; omit their rate (--moments-per-second)",
    )
    for words, sentence in (
        (["still.ply"], f"still.ply: is a scene at rest, {omit}\n"),
        (
            ["tiles"],
            f"tiles: is a scene at rest, {omit}, or call files that are moments frame_0, frame_1 and so on\n",
        ),
        (
            [clips["folder"], "--time", "all"],
            f"{clips['folder']}: is a scene at rest, {omit} or --time all\n",
        ),
        (
            [clips["params"]],
            f"{clips['params']}: is a params.npz of Dynamic3DGaussians, one file that moves, not numbered "
            "moments; omit their rate (--moments-per-second)\n",
        ),
    ):
        code, out, err = run(capsys, command, *words, *rate)
        assert (code, out, err) == (2, "", f"brushgs: {sentence}")


@pytest.mark.parametrize("text", ["0", "-3", "nan", "inf", "1e999", "fast"])
def test_a_rate_of_moments_is_above_0(clips, capsys, text):
    code, out, err = run(capsys, "info", clips["folder"], f"--moments-per-second={text}")
    assert (code, out) == (2, "")
    assert "moments-per-second" in err
    assert "must be" in err


def test_python_takes_a_rate_of_moments(clips, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    moving = bg.load_moving(clips["folder"], moments_per_second=0.5)
    assert (moving.duration, moving.times.tolist()) == (6, [0, 2, 4])
    source = SceneSource.of(clips["folder"], moments_per_second=0.5)
    assert bg.load_moving(source).duration == 6
    assert bg.load_moving(source, moments_per_second=3).duration == 1
    assert SceneSource.of(source).moments_per_second == 0.5
    options = {"strokes": 40, "size": (32, 24), "look": "plain"}
    third = bg.paint(clips["folder"], time=4, moments_per_second=0.5, **options)
    np.testing.assert_array_equal(third.rgb, bg.paint(clips["folder"] / "frame_2.ply", **options).rgb)
    with pytest.raises(ValueError, match="moments-per-second must be above 0, got 0"):
        bg.load_moving(clips["folder"], moments_per_second=0)
    with pytest.raises(ValueError, match="belongs to scene files; omit it with Gaussians"):
        bg.paint(still_life_of(1000), moments_per_second=12)


@pytest.mark.parametrize("scene", ["nothing.splatv", "nothing/*.ply"])
def test_a_moment_of_what_is_not_there_is_refused_as_that(tmp_path, monkeypatch, capsys, scene):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, "render", scene, "--time", "0.4")
    assert (code, err) == (2, f"brushgs: {scene}: there is no such file; check the path\n")


@pytest.mark.parametrize("text", ["soon", "-1", "120%"])
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
