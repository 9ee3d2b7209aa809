"""The commands of README and docs do what they say: run on a small scene under the names that they use."""

import json
import re
import shlex
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.cli.parser import COMMANDS as NAMES
from brushgs.formats.pictures.images import write_frame
from brushgs.values.style import StyleEdit
from tests.clips import save_clip
from tests.io.moving.clips import encode_splatv, spacetime_columns
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of
from tests.test_examples import COMMANDS, ROOT


# What a page names and the test has; a command with other files is only read.
def named(text):
    return set(text.split())


SCENES = named("scene.ply scene.spz still_life.ply left.ply right.spz a.ply predicted.ply styled.ply")
PAINTINGS = named("painting.jpg monet.jpg starry.jpg photo.jpg")
FILES = SCENES | PAINTINGS | named("truck.splat a_edited.ply my_brush.png mask.png lines.obj monet.style")
FILES |= named("dusk.style styled.style mine.toml parts.toml cameras.json camera_path.json clip.splatv")
WRITTEN = named("both.png turn.mov looks.jpg strokes.ply strokes.exr painting.exr strokes.glb strokes.sog")
WRITTEN |= named("shot.%04d.exr draft.mp4 still_life.html small.html clip.mp4 clip.webm frames/%05d.exr")
WRITTEN.add("//example.org/still_life.html")
LONG = named("view bench stability refine compare batch completion demo")  # whose own tests run them
# What makes a command small; of a flag that is given twice the last counts.
SIZES = {"render": "48x36", "export": "48x36", "views": "32x24"}
SHAPES = {"equirect": "64x32", "vr180": "36x36"}
COUNTED = re.compile(r"--strokes |--stroke-size |--stroke gaussian")  # commands about their number
WITH_VIEWS = re.compile(r"--see|--preset|for[-_]view|--explain|dB")  # commands about strokes that see
FRAMES = re.compile(r"(?<=--orbit )\d+|(?<=--grow )\d+")
PART = re.compile(r"(?<=--crop )[\d,]+")


def files_of(words):
    """The words that name files."""
    named = (re.split(r"[:=,]", word)[-1] for word in words if re.search(r"\.[a-z]{2,6}$", word))
    return {name.removeprefix("./") for name in named}


def is_run(line):
    words = shlex.split(line, comments=True)[1:]
    is_small = words[0] not in LONG and not re.search(r"--passes|sparse/|--scheduler|masks/", line)
    return is_small and "looks.jpg" not in words and files_of(words) <= FILES | WRITTEN


def some_for_all(lines):
    """Of some commands those that bring a subcommand, flag, look or kind of file that none before has."""
    seen, found = set(), []
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        parts = {words[0], *(word.partition("=")[0] for word in words if word.startswith("-"))}
        parts |= {*re.findall(r"--(?:look|where|layers) \S+", line), *re.findall(r"\.[a-z]{2,6}\b", line)}
        if not parts <= seen or words[0] == "looks":  # which needs no file
            seen |= parts
            found.append(line)
    return found


RUN = some_for_all([line for line in COMMANDS if is_run(line)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("guides")
    scene = still_life_of(1000)
    for name in sorted(SCENES):
        save_upright(scene, path / name)
    with pytest.warns(bg.SceneWarning, match="does not hold colors that change with the view"):
        bg.save(scene, path / "truck.splat")
    save_upright(replace(scene, sh=0.8 * scene.sh), path / "a_edited.ply")  # one map: learned quickly
    marks = np.random.default_rng(0).random((96, 128, 3)).astype(np.float32)
    marks[:, ::4] = marks[:, :1]
    for name in PAINTINGS:
        write_frame(bg.Frame(marks, np.ones(marks.shape[:2], np.float32)), path / name, (1, 1, 1))
    ink = np.zeros((24, 64), np.float32)
    ink[6:18, 6:58] = 1
    write_frame(bg.Frame(np.zeros((24, 64, 3), np.float32), ink), path / "my_brush.png")
    light = np.tile(np.linspace(0, 1, 48, dtype=np.float32), (36, 1))
    write_frame(bg.Frame(np.repeat(light[..., None], 3, axis=2), np.ones_like(light)), path / "mask.png")
    for name in ("monet", "dusk"):
        bg.save_style(bg.Style(name, edit=StyleEdit(0.7 * np.eye(3, 4))), path / f"{name}.style")
    bg.save_style(bg.Style("styled", edit=StyleEdit(0.7 * np.eye(3, 4))), path / "styled.style")
    (path / "lines.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    (path / "mine.toml").write_bytes((ROOT / "brushgs" / "looks" / "oil.toml").read_bytes())
    (path / "parts.toml").write_text('[[region]]\nwhere = "height:..30%"\nbrushes = ["flat"]\n')
    save_clip(path / "frames")
    (path / "clip.splatv").write_bytes(encode_splatv(spacetime_columns(300)))
    write_cameras(path)
    return path


def write_cameras(folder):
    """Thirteen cameras before the still life, as Inria's trainer and as nerfstudio write them."""
    places = [[0.2 * step, -3.0, -10.0] for step in range(-6, 7)]
    size = {"width": 48, "height": 36, "fx": 80.0, "fy": 80.0}
    found = [{"position": place, "rotation": np.eye(3).tolist(), **size} for place in places]
    (folder / "cameras.json").write_text(json.dumps(found))
    poses = [[1, 0, 0, x, 0, -1, 0, y, 0, 0, -1, z, 0, 0, 0, 1] for x, y, z in places[:3]]
    path = [{"camera_to_world": pose, "fov": 25.0} for pose in poses]
    content = {"render_width": 48, "render_height": 36, "camera_path": path, "keyframes": []}
    (folder / "camera_path.json").write_text(json.dumps(content))


def test_many_commands_of_the_guides_are_run():
    assert len(RUN) >= 65


@pytest.mark.parametrize("line", RUN)
def test_a_command_of_the_guides_runs(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    line = PART.sub("9,8,20,10", line.partition(" > ")[0])
    line = FRAMES.sub("3", line).replace("0,1.6,0,0.4", "0,-0.2,0,1")  # a place in this scene
    line = line.replace("-o frames/", "-o painted/").replace("--jobs 8", "--jobs 2")
    line = line.replace("--start 1 ", "--start 10% ")
    words = shlex.split(line, comments=True)[1:]
    shape = next((size for word, size in SHAPES.items() if word in words), None)
    if words[0] in SIZES:
        paper = "@100" if re.search("--size [^ ]+@", line) else ""
        words += ["--size", shape or SIZES[words[0]] + paper]
    if words[0] in ("render", "export") and not COUNTED.search(line):
        words += ["--strokes", "60"]
    if words[0] in ("render", "export") and not WITH_VIEWS.search(line):
        words += ["--see", "off"]
    code = main(words)
    assert code == 0, capsys.readouterr().err


@for_each("line", [line for line in COMMANDS if line not in RUN])
def test_a_command_of_the_guides_that_is_not_run_is_understood(line, folder, capsys):
    """In a folder without its files it fails because of them, not because of its words."""
    words = shlex.split(line.replace("//host:", "//127.0.0.1:"), comments=True)[1:]
    if "--passes" in words:  # which needs no file
        with pytest.raises(SystemExit, match="0"):
            main(words)
        return
    assert main(words) == 2
    assert "--help" not in capsys.readouterr().err  # what an unknown flag or a wrong value refers to


def test_of_a_command_that_is_not_understood_the_help_is_named(capsys):
    """Else the test above would show nothing."""
    for name in NAMES:
        assert main([name, "--wrong"]) == 2
        assert "--help" in capsys.readouterr().err
