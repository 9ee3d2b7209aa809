"""The view of a page as the command that paints it, and as a camera file."""

import shlex
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from brushgs import cli
from brushgs.cameras.framing import frame_scene
from brushgs.cameras.orbit import orbit
from brushgs.outlets.page.view import PageView
from brushgs.pipeline.steps import seeing
from tests.outlets.page.kit import kit
from tests.outlets.page.page_file import SIZE, camera_of, pixels, scene, shown
from tests.scenes import save_upright

STROKES, FIRST = scene()
POINTS = FIRST.points[::5]
PLAIN = frame_scene(FIRST, **SIZE)
QUICK = ("--look", "plain", "--stroke", "ellipse", "--strokes", "60", "--see", "off", "--quiet")
HOSTILE = [
    "plain.ply",
    "two words.ply",
    "it's.ply",
    '"quoted".ply',
    "$(touch owned).ply",
    "`touch owned`.ply",
    "a;touch owned;.ply",
    "line\nbreak.ply",
    "tab\there.ply",
    "escape\x1b[201~\x03.ply",
    "back\\slash\\n.ply",
    "a\u202ebc\u2028d.ply",
    "!history & > owned.ply",
    "~.ply",
    "*.ply",
    "#.ply",
    "\u00e4\u00f6 \U0001f58c.ply",
    "-rf.ply",
    "",
]


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
    """The command, the camera file and the camera of a page after moves of its `Orbit`.

    Args:
        tab: of `kit`.
        header: of the page.
        changes: (name, arguments) of methods of `Orbit` that change a state.
        width: of the picture.
        height: of the picture.
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


MOVES = {
    "first": (),
    "turned": [("turn", 0.7, -0.35)],
    "near": [("turn", -2.0, 0.2), ("zoom", 0.21, 0.3, -0.2)],
    "far and aside": [("zoom", 2.5, 0, 0), ("pan", 0.6, -0.3)],
    "from above": [("turn", 9.0, 3.0)],
}


@pytest.mark.parametrize("name", MOVES)
def test_the_command_paints_the_view_of_the_page(tab, monkeypatch, scene_path, tmp_path, name):
    header = header_of(command=(str(scene_path), QUICK))
    line, _, camera = moved(tab, header, MOVES[name], width=200, height=150)
    used = camera_used(monkeypatch, line, tmp_path)
    assert (used.width, used.height) == (200, 150)
    np.testing.assert_allclose(pixels(used, POINTS), pixels(camera, POINTS), atol=0.01)
    assert used.near == pytest.approx(camera.near, rel=1e-8)
    assert (tmp_path / "picture.png").exists()


KINDS = {
    "rolled": (frame_scene(FIRST, **SIZE, roll=0.35, elevation=-0.4), False),
    "another up": (frame_scene(FIRST, **SIZE, up=(0.1, -0.9, 0.2)), False),
    "inside": (PLAIN, True),
    "wide picture": (frame_scene(FIRST, width=500, height=200), False),
    "on an orbit": (orbit(FIRST, 7, **SIZE)[3], False),
    "straight from above": (frame_scene(FIRST, **SIZE, elevation=np.pi / 2, azimuth=1.0), False),
}


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
    options = [
        *("--look", "oil", "--size=64x48", "--azimuth", "-30", "--up", "+z", "--stroke-size", "24px"),
        *(
            "--from",
            "left",
            "--look-at=part",
            "--camera-file",
            "my cameras.json",
            "--view",
            "3",
            "--zoom",
            "2",
        ),
        *(
            "--roll",
            "4",
            "--pan",
            "0,1",
            "--fov-deg",
            "30",
            "--elevation=5",
            "--distance",
            "3",
            "--keep",
            "0.5",
        ),
    ]
    line, _, _ = moved(tab, header_of(command=("a.ply", options)))
    words = shlex.split(line)
    assert words[:9] == [
        "brushgs",
        "render",
        "a.ply",
        "--look",
        "oil",
        "--stroke-size",
        "24px",
        "--keep",
        "0.5",
    ]
    assert words[9:13] == ["--size", "320x240", "--up", "-y"]
    assert all(words.count(flag) == 1 for flag in ("--size", "--up", "--azimuth", "--look-at", "--distance"))


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_is_one_word_for_the_shell(tab, tmp_path, name):
    line, _, _ = moved(tab, header_of(command=(name, ["--ground", name])))
    assert not any(ord(letter) < 32 or letter in "\x7f\u2028\u202e" for letter in line)
    script = "brushgs() { printf '%s\\0' \"$@\"; }\n" + line
    told = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, check=True)
    words = told.stdout.decode().split("\0")
    assert words[0] == "render"
    assert words[1] == (f"./{name}" if name.startswith("-") else name)
    assert words[2:4] == ["--ground", name]
    assert list(tmp_path.iterdir()) == [], "the line did something else"
