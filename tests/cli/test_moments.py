"""Commands that read one moment of a moving scene."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.scene_source import SceneSource
from brushgs.outlets.page.export import command_of
from tests.io.moving.params_maker import write_params
from tests.kit.commands import refused, run
from tests.kit.for_each import for_each
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


@for_each(
    ("kind", "words"),
    [
        ("params", ["cluster", "--strokes", "50", "-o", "out.ply"]),
        ("folder", ["render", *SMALL, "-o", "out.png"]),
        ("params", ["export", *SMALL, "-o", "out.html"]),
        ("folder", ["doctor", "--fix", "out.ply"]),
        ("folder", ["looks", "plain", "--size", "32x24", "-o", "out.png", "--scene"]),
        ("params", ["info"]),
    ],
)
def test_every_command_takes_a_moment(clips, folder, kind, words, capsys):
    code, _, err = run(capsys, *words, clips[kind], "--time", "0.05")
    assert code == 0, err
    for path in folder.glob("out.*"):
        assert path.stat().st_size > 0
        path.unlink()
    error = refused(capsys, *words, clips[kind], "--time", "9")
    assert "is after its end; choose another moment (--time)" in error


@for_each(
    ("kind", "words", "seconds", "rate"),
    [
        ("folder", [], 0.125, 24),
        ("folder", ["--moments-per-second", "2"], 1.5, 2),
        ("params", [], 0.0666667, None),
    ],
)
def test_info_tells_of_the_motion(clips, kind, words, seconds, rate, capsys):
    code, out, err = run(capsys, "info", clips[kind], *words, "--json")
    assert code == 0, err
    facts = json.loads(out)
    expected = {"duration": seconds, "moments": 3, "rows_correspond": True, "resting_share": "not known"}
    assert {name: facts[name] for name in expected} == expected
    assert facts["seconds_are"].startswith("nominal")
    assert facts.get("moments_per_second") == rate
    assert rate is None or f"{rate} moments a second" in facts["seconds_are"]
    assert facts["format"].endswith(f"moment 0.00 s of {seconds:.2f} s")


def test_the_page_names_the_moment_in_its_command():
    for time in ("0.4", "40%", "all"):
        source = SceneSource((Path("clip"),), time=bg.Moment.parse(time))
        assert command_of(source, ["--look", "ink"]) == ("clip", ["--time", time, "--look", "ink"])


@for_each("command", ["render", "view", "info"])
def test_times_and_rates_of_moments_are_refused_where_there_are_none(clips, folder, scene, capsys, command):
    Path("tiles").mkdir(exist_ok=True)
    for name in ("still.ply", "tiles/tile_0.ply", "tiles/tile_1.ply"):
        Path(name).write_bytes(scene.read_bytes())
    omit = "which has no moments; omit their rate (--moments-per-second)"
    named = "call files that are moments frame_0, frame_1 and so on"
    rate = ["--moments-per-second", "12"]
    for words, sentence in (
        (["still.ply", "--time", "0.4"], "is a scene at rest, which has no moments; omit the time (--time)"),
        (["still.ply", *rate], f"is a scene at rest, {omit}"),
        (["tiles", *rate], f"is a scene at rest, {omit}, or {named}"),
        ([clips["folder"], "--time", "all", *rate], f"is a scene at rest, {omit} or --time all"),
        (
            [clips["params"], *rate],
            "is a params.npz of Dynamic3DGaussians, one file that moves, not numbered moments; omit their "
            "rate (--moments-per-second)",
        ),
        (["nothing/*.ply", "--time", "0.4"], "there is no such file; check the path"),
    ):
        assert refused(capsys, command, *words) == f"brushgs: {words[0]}: {sentence}\n"
    assert "must be" in refused(capsys, command, clips["folder"], "--moments-per-second=0")
    assert "must be" in refused(capsys, command, clips["folder"], "--time=120%")


def test_python_takes_a_rate_of_moments(clips):
    moving = bg.load_moving(clips["folder"], moments_per_second=0.5)
    assert (moving.duration, moving.times.tolist()) == (6, [0, 2, 4])
    source = SceneSource.of(clips["folder"], moments_per_second=0.5)
    assert bg.load_moving(source).duration == 6
    assert bg.load_moving(source, moments_per_second=3).duration == 1
    assert SceneSource.of(source).moments_per_second == 0.5
    options = {"strokes": 40, "size": (32, 24), "look": "plain", "see": "off"}
    third = bg.paint(clips["folder"], time=4, moments_per_second=0.5, **options)
    np.testing.assert_array_equal(third.rgb, bg.paint(clips["folder"] / "frame_2.ply", **options).rgb)
    with pytest.raises(ValueError, match="belongs to scene files; omit it with Gaussians"):
        bg.paint(still_life_of(1000), moments_per_second=12)


def test_files_that_lie_in_one_place_are_told_with_the_cure(folder, scene, capsys):
    Path("scans").mkdir()
    for index in range(3):
        Path(f"scans/scan_{index}.ply").write_bytes(scene.read_bytes())
    facts = json.loads(run(capsys, "info", "scans", "--json")[1])
    assert facts["moments"] == 3
    assert [note for note in facts["notes"] if "add --time all" in note]
    whole = json.loads(run(capsys, "info", "scans", "--time", "all", "--json")[1])
    assert (whole["gaussians"], whole["notes"]) == (3 * facts["gaussians"], [])
    assert "moments" not in whole


def test_a_real_clip_has_a_moment(folder, capsys):
    clip = real_scene("moving/cook_spinach.splatv")
    facts = json.loads(run(capsys, "info", clip, "--time", "50%", "--json")[1])
    assert (facts["moments"], facts["rows_correspond"]) == ("any", True)
    assert 50_000 < facts["gaussians"] < 62_442
    assert run(capsys, "prune", clip, "--time", "50%", "-o", "a.ply", "--quiet")[0] == 0
