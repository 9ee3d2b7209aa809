"""The view of a page as the command that paints it, and as a camera file."""

import shlex
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from brushgs import cli
from brushgs.cameras.framing import frame_scene
from brushgs.outlets.page.view import PageView
from brushgs.pipeline.steps import seeing
from tests.kit.for_each import for_each
from tests.outlets.page.kit import kit
from tests.outlets.page.page_file import SIZE, camera_of, pixels, scene, shown
from tests.scenes import save_upright

STROKES, FIRST = scene()
POINTS = FIRST.points[::5]
PLAIN = frame_scene(FIRST, **SIZE)
QUICK = ("--look", "plain", "--stroke", "ellipse", "--strokes", "60", "--see", "off", "--quiet")
HOSTILE = [
    "plain.ply", "two words.ply", "it's.ply", '"quoted".ply', "$(touch owned).ply", "`touch owned`.ply",
    "a;touch owned;.ply", "line\nbreak.ply", "tab\there.ply", "escape\x1b[201~\x03.ply", "back\\slash\\n.ply",
    "a\u202ebc\u2028d.ply", "!history & > owned.ply", "~.ply", "*.ply", "#.ply",
    "\u00e4\u00f6 \U0001f58c.ply", "-rf.ply", "",
]  # fmt: skip


@pytest.fixture(scope="module")
def tab(open_shared_page):
    return kit(open_shared_page)


@pytest.fixture(scope="module")
def scene_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "two pears.ply"
    save_upright(STROKES, path)
    return path


def header_of(camera=PLAIN, *, command=("pears.ply", QUICK), is_inside=False):
    view = replace(PageView.of(FIRST, camera), is_inside=is_inside)
    return dict(shown(camera, view=view, command=command).header)


def moved(tab, header, changes=(), *, width=320, height=240):
    """The command, the camera file and the camera of a page of this size after moves of its `Orbit`.

    `changes` are names of methods that change a state, and their arguments.
    """
    result = tab.evaluate(
        """([header, changes, width, height]) => {
          const orbit = new kit.Orbit(header), state = orbit.first.slice();
          for (const [name, ...values] of changes) orbit[name](state, ...values);
          const camera = orbit.aim(new kit.PageCamera({ ...orbit.lens, width, height }), state);
          return [kit.commandLine(header, camera), kit.cameraFile(header, camera), kit.facts(camera)];
        }""",
        [header, [list(change) for change in changes], width, height],
    )
    return result[0], result[1], camera_of(result[2], header)


def camera_used(monkeypatch, line, folder):
    """The camera with which a command line paints, run in this process in a folder."""
    cameras = []
    choose = seeing.choose_camera

    def choose_and_tell(*args, **kwargs):
        cameras.append(choose(*args, **kwargs))
        return cameras[-1]

    monkeypatch.setattr(seeing, "choose_camera", choose_and_tell)
    monkeypatch.chdir(folder)
    words = shlex.split(line)
    assert words[0] == "brushgs"
    assert cli.main([*words[1:], "-o", "picture.png"]) == 0
    (camera,) = cameras
    return camera


MOVES = [
    [("turn", 0.7, -0.35)],
    [("turn", -2.0, 0.2), ("zoom", 0.21, 0.3, -0.2)],
    [("zoom", 2.5, 0, 0), ("pan", 0.6, -0.3)],
    [("turn", 9.0, 3.0)],  # from above
]


@for_each("moves", MOVES)
def test_the_command_paints_the_view_of_the_page(tab, monkeypatch, scene_path, tmp_path, moves):
    header = header_of(command=(str(scene_path), QUICK))
    line, _, camera = moved(tab, header, moves, width=60, height=45)
    used = camera_used(monkeypatch, line, tmp_path)
    assert (used.width, used.height) == (60, 45)
    np.testing.assert_allclose(pixels(used, POINTS), pixels(camera, POINTS), atol=0.003)
    assert used.near == pytest.approx(camera.near, rel=1e-8)
    assert (tmp_path / "picture.png").exists()


def test_a_lens_that_flags_cannot_say_goes_to_a_camera_file(tab, monkeypatch, scene_path, tmp_path):
    K = np.array([[130.0, 0, 90], [0, 150, 80], [0, 0, 1]])
    header = header_of(replace(PLAIN, K=K, near=0.3), command=(str(scene_path), QUICK))
    line, text, camera = moved(tab, header, [("turn", 0.4, 0.1)])
    assert line.endswith(" --camera-file camera.json")
    assert "--azimuth" not in line
    (tmp_path / "camera.json").write_text(text)
    used = camera_used(monkeypatch, line, tmp_path)
    np.testing.assert_allclose(pixels(used, POINTS), pixels(camera, POINTS), atol=1e-6)
    assert used.near == pytest.approx(camera.near, rel=1e-12)


def test_the_view_takes_the_place_of_that_in_the_options(tab):
    options = "--look oil --size=64x48 --azimuth -30 --up +z --stroke-size 24px --from left --look-at=part"
    options += " --view 3 --zoom 2 --roll 4 --pan 0,1 --fov-deg 30 --elevation=5 --distance 3 --keep 0.5"
    more = ["--camera-file", "my cameras.json"]
    line, _, _ = moved(tab, header_of(command=("a.ply", [*more, *options.split()])))
    assert line.startswith("brushgs render a.ply --look oil --stroke-size 24px --keep 0.5 --size")
    words = shlex.split(line)
    assert words[9:13] == ["--size", "320x240", "--up", "-y"]
    assert all(words.count(flag) == 1 for flag in ("--size", "--up", "--azimuth", "--look-at", "--distance"))


@for_each("name", HOSTILE)
def test_a_hostile_name_is_one_word_for_the_shell(tab, tmp_path, name):
    line, _, _ = moved(tab, header_of(command=(name, ["--ground", name])))
    assert not any(ord(letter) < 32 or letter in "\x7f\u2028\u202e" for letter in line)
    script = "brushgs() { printf '%s\\0' \"$@\"; }\n" + line
    told = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, check=True)
    words = told.stdout.decode().split("\0")
    assert words[:2] == ["render", f"./{name}" if name.startswith("-") else name]
    assert words[2:4] == ["--ground", name]
    assert list(tmp_path.iterdir()) == [], "the line did something else"
