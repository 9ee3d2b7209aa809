"""`brushgs render` of scenes that move."""

import json
from pathlib import Path

import av
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from tests.scenes import save_upright, still_life_of

SMALL = ["--look", "plain", "--stroke", "ellipse", "--strokes", "80", "--size", "64x48"]
SMALL += ["--see", "off", "--fps", "6"]
NUM_MOMENTS = 24  # a second
CAMERA = still_life_camera(width=64, height=48)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A still scene, and a folder with the moments of one that moves."""
    folder = tmp_path_factory.mktemp("scene")
    save_upright(still_life_of(1000), folder / "pears.ply")
    (folder / "clip").mkdir()
    scene = still_life_moving(1000, seconds=1.0)
    for index in range(NUM_MOMENTS):
        save_upright(scene.at(index / 24), folder / "clip" / f"frame_{index:03d}.ply")
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return made


def run(capsys, *words):
    """Exit code, stdout and stderr of `brushgs render`."""
    code = cli.main(["render", *[str(word) for word in words]])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def num_frames(path):
    with av.open(str(path)) as video:
        return sum(1 for _ in video.decode(video=0))


def test_a_moving_scene_becomes_a_video(folder, capsys):
    code, out, err = run(capsys, folder / "clip", *SMALL)
    assert (code, out) == (0, "clip-ellipse.mp4\n")
    assert "24 moments at 24 a second" in err
    assert num_frames("clip-ellipse.mp4") == 6


def test_flags_of_a_film(folder, capsys):
    part = "--start", "0.2", "--end", "60%", "--speed", "0.5", "--loop"
    code, out, _ = run(capsys, folder / "clip", *SMALL, *part, "-o", "f/%02d.png", "--json")
    assert code == 0
    stages = {stage["name"]: stage for stage in json.loads(out)["stages"]}
    assert stages["paint"]["counts"]["frames"] == 2 * round(0.4 * 6 / 0.5)
    assert len(list(Path("f").glob("*.png"))) == 10


@pytest.mark.parametrize(
    ("scene", "words", "message"),
    [
        ("clip", ["-o", "x.png"], "x.png is one picture, and CLIP moves; add --time, one moment of it, or"),
        ("clip", ["--grow", "3"], "--grow needs a still scene, and CLIP moves; add --time"),
        ("clip", ["--cross-fade", "0.2"], "cross-fade needs loop"),
        ("clip", ["--start", "2"], "start must be in the 1 s of CLIP, got 2 s"),
        ("clip", ["--start", "0.5", "--end", "0.2"], "end must not be before start"),
        (
            "clip",
            ["--start", "soon"],
            "--start must be seconds such as 0.4, a share such as 40%, or all, got 'soon'",
        ),
        ("clip", ["--speed", "1e-5"], "at most 99,999 can be painted; show less of it, --end"),
        ("pears.ply", ["--start", "0.1"], "--start needs a moving scene, and CLIP is still; omit it"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(scene, words, message, folder, capsys):
    flags = SMALL if "--fps" in words or scene == "clip" else SMALL[:-2]
    code, out, err = run(capsys, folder / scene, *flags, *words)
    assert (code, out) == (2, "")
    assert message.replace("CLIP", str(folder / scene)) in err
    assert not list(Path().iterdir())


def test_python_paints_the_same_film(folder, tmp_path):
    look = bg.Look.open("plain")
    report = bg.paint_film(folder / "clip", "f/%02d.png", look, camera=CAMERA, clip=bg.ClipConfig(fps=3))
    assert [stage.name for stage in report.stages][-2:] == ["paint", "write"]
    assert len(list(Path("f").glob("*.png"))) == 3


def test_a_still_scene_is_a_film_of_one_frame(folder):
    bg.paint_film(folder / "pears.ply", "f/%02d.png", camera=CAMERA)
    assert len(list(Path("f").glob("*.png"))) == 1


def test_a_note_is_told_once(folder, capsys):
    save_upright(still_life_of(1000), "point_cloud.ply")
    Path("deformation.pth").write_bytes(b"a network")
    code, _, err = run(capsys, "point_cloud.ply", *SMALL[:-2])
    assert (code, err.count("are moved by the network beside them")) == (0, 1)
