"""`brushgs render` of scenes that move."""

from pathlib import Path

import av
import pytest

import brushgs as bg
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from tests.io.styles import example
from tests.kit.commands import refused, run, stages_of
from tests.kit.for_each import for_each
from tests.scenes import save_upright

SMALL = ["--look", "plain", "--stroke", "ellipse", "--strokes", "80", "--size", "64x48"]
SMALL += ["--see", "off", "--fps", "6"]
CAMERA = still_life_camera(width=64, height=48)


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A folder with the moments of a scene that moves."""
    folder = tmp_path_factory.mktemp("scene") / "clip"
    folder.mkdir()
    moving = still_life_moving(1000, seconds=1.0)
    for index in range(24):  # a second
        save_upright(moving.at(index / 24), folder / f"frame_{index:03d}.ply")
    return folder


def test_a_moving_scene_becomes_a_video(clip, folder, capsys):
    code, out, err = run(capsys, "render", clip, *SMALL)
    assert (code, out) == (0, "clip-ellipse.mp4\n")
    assert "24 moments at 24 a second" in err
    with av.open("clip-ellipse.mp4") as video:
        assert sum(1 for _ in video.decode(video=0)) == 6
    part = "--start", "0.2", "--end", "60%", "--speed", "0.5", "--loop"
    stages = stages_of(capsys, "render", clip, *SMALL, *part, "-o", "f/%02d.png")
    assert stages["paint"]["counts"]["frames"] == 2 * round(0.4 * 6 / 0.5)
    assert len(list(Path("f").glob("*.png"))) == 10


@for_each(
    ("moves", "words", "message"),
    [
        (True, ["-o", "x.png"], "x.png is one picture, and CLIP moves; add --time, one moment of it, or"),
        (True, ["--grow", "3"], "--grow needs a still scene, and CLIP moves; add --time"),
        (True, ["--cross-fade", "0.2"], "cross-fade needs loop"),
        (True, ["--start", "2"], "start must be in the 1 s of CLIP, got 2 s"),
        (True, ["--start", "0.5", "--end", "0.2"], "end must not be before start"),
        (True, ["--start", "soon"], "--start must be seconds such as 0.4, a share such as 40%, or all, got"),
        (True, ["--speed", "1e-5"], "at most 99,999 can be painted; show less of it, --end"),
        (False, ["--start", "0.1"], "--start needs a moving scene, and CLIP is still; omit it"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(moves, words, message, clip, scene, folder, capsys):
    path, flags = (clip, SMALL) if moves else (scene, SMALL[:-2])
    assert message.replace("CLIP", str(path)) in refused(capsys, "render", path, *flags, *words)
    assert not list(Path().iterdir())


def test_python_paints_films_too_a_still_scene_as_one_frame(clip, scene, folder):
    look = bg.Look.open("plain")
    report = bg.paint_film(clip, "f/%02d.png", look, camera=CAMERA, clip=bg.ClipConfig(fps=3))
    assert [stage.name for stage in report.stages][-2:] == ["paint", "write"]
    assert len(list(Path("f").glob("*.png"))) == 3
    bg.paint_film(scene, "g/%02d.png", look, camera=CAMERA)
    assert len(list(Path("g").glob("*.png"))) == 1


def test_a_note_is_told_once(scene, folder, capsys):
    Path("point_cloud.ply").write_bytes(scene.read_bytes())
    Path("deformation.pth").write_bytes(b"a network")
    code, _, err = run(capsys, "render", "point_cloud.ply", *SMALL[:-2])
    assert (code, err.count("are moved by the network beside them")) == (0, 1)


def test_a_film_in_a_style_has_its_stage(scene, folder, capsys):
    bg.save_style(example.painting(), "evening.style")
    oil = "--look", "oil", "--strokes", "80", "--size", "64x48", "--orbit", "3", "--backdrop", "stage"
    stages = stages_of(capsys, "render", scene, *oil, "--style", "evening.style", "-o", "evening/%d.png")
    assert stages["backdrop"]["counts"]["strokes"] > 0
    assert stages["paint"]["counts"]["frames"] == 3
