"""The commands of README and docs do what they say: run on a small scene under the names that they use."""

import re
import shlex

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.io.pictures.images import write_frame
from brushgs.values.frame import Frame
from tests.scenes import still_life_of
from tests.test_examples import COMMANDS

# What a page names and the test has; a command with other files is only read, see test_examples.py.
FILES = {
    "scene.ply",
    "scene.spz",
    "still_life.ply",
    "truck.splat",
    "left.ply",
    "right.spz",
    "a.ply",
    "a_edited.ply",
}
FILES |= {
    "painting.jpg",
    "monet.jpg",
    "starry.jpg",
    "my_brush.png",
    "monet.style",
    "dusk.style",
    "mine.toml",
    "lines.obj",
}
WRITTEN = {"both.png", "turn.mov", "looks.jpg", "strokes.ply", "strokes.exr", "painting.exr", "strokes.glb"}
WRITTEN |= {"strokes.sog", "cured.ply", "shot.%04d.exr"}
LONG = {"view", "bench", "stability", "refine", "batch", "completion", "demo"}
# What makes a command small: pictures, strokes and frames. The last flag counts.
SMALL = {"render": ["--size", "48x36", "--strokes", "60"], "export": ["--size", "48x36", "--strokes", "60"]}
SMALL |= {"looks": ["--size", "48x36"], "views": ["--size", "32x24"]}
NUMBER = re.compile(r"(?<=--orbit )\d+|(?<=--grow )\d+")


def files_of(words):
    """The words that name files."""
    named = (re.split(r"[:=,]", word)[-1] for word in words if re.search(r"\.[a-z]{2,6}$", word))
    return {name.removeprefix("./") for name in named}


def is_run(line):
    words = shlex.split(line, comments=True)[1:]
    is_small = words[0] not in LONG and not re.search(r"> |--passes|frames/|sparse/|--scheduler", line)
    return is_small and files_of(words) <= FILES | WRITTEN


RUN = [line for line in COMMANDS if is_run(line)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("guides")
    scene = still_life_of(1500)
    for name in ("scene.ply", "scene.spz", "still_life.ply", "truck.splat", "left.ply", "right.spz", "a.ply"):
        bg.save(scene, path / name)
    bg.save(
        bg.recolor(scene, bg.Palette.of_colors(np.array([[0.2, 0.1, 0.3], [0.9, 0.6, 0.3]]))),
        path / "a_edited.ply",
    )
    marks = np.random.default_rng(0).random((96, 128, 3)).astype(np.float32)
    marks[:, ::4] = marks[:, :1]
    for name in ("painting.jpg", "monet.jpg", "starry.jpg"):
        write_frame(Frame(marks, np.ones(marks.shape[:2], np.float32)), path / name, (1, 1, 1))
    ink = np.zeros((24, 64), np.float32)
    ink[6:18, 6:58] = 1
    write_frame(Frame(np.zeros((24, 64, 3), np.float32), ink), path / "my_brush.png")
    for name, darker in (("monet.style", 0.8), ("dusk.style", 0.5)):
        edit = bg.Style("dusk", edit=_edit(darker))
        bg.save_style(edit, path / name)
    (path / "mine.toml").write_text('title = "mine"\n')
    (path / "lines.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    return path


def _edit(darker):
    from brushgs.values.style import StyleEdit

    return StyleEdit(darker * np.eye(3, 4))


def test_most_commands_of_the_guides_are_run():
    assert len(RUN) >= 40


@pytest.mark.parametrize("line", RUN)
def test_a_command_of_the_guides_runs(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    line = line.replace("0,1.6,0,0.4", "0,-0.2,0,1")  # a place in this scene
    words = shlex.split(NUMBER.sub("3", line), comments=True)[1:]
    strokes = [] if re.search(r"--strokes? (gaussian|auto|\d+%|\d+dB)|--stroke-size|cluster", line) else None
    small = SMALL.get(words[0], [])
    if strokes is not None:
        small = [word for word in small if word not in ("--strokes", "60")]
    code = main([*words, *small])
    assert code == 0, capsys.readouterr().err
