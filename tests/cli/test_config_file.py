"""`--config FILE`: options of a file, below those of the command line."""

from pathlib import Path

import pytest

from brushgs.cli import main
from brushgs.cli.config_file import located_text
from brushgs.cli.configs import paint_config
from brushgs.cli.parser import parse
from tests.kit.for_each import for_each

pytestmark = pytest.mark.usefixtures("folder")


def config(text, name="mine.toml"):
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(text, encoding="utf-8")
    return name


def parsed(text, *words, command="render", scene=("scene.ply",)):
    return parse([command, *scene, "--config", config(text), *words])


def options_of(args):
    """What decides the painting, without the words."""
    return {name: value for name, value in vars(args).items() if name not in ("words", "config")}


def test_a_file_is_as_good_as_flags():
    text = 'size = "64x48"\nazimuth = -30\nsolid = true\n[render]\nlook = "ink"\nlayers = ["depth", "uv"]\n'
    flags = ["--size", "64x48", "--azimuth", "-30", "--solid", "on", "--look", "ink", "--layers", "depth,uv"]
    assert options_of(parsed(text)) == options_of(parse(["render", "scene.ply", *flags]))


def test_the_table_of_the_command_wins_over_what_is_above_it_and_flags_over_both():
    text = "seed = 1\nkeep = 0.5\nsize = [64, 48]\n[render]\nseed = 2\n[cluster]\nseed = 3\nwhatever = 4\n"
    args = vars(parsed(text))
    assert (args["cluster.seed"], args["prune.keep"], args["view.size"]) == (2, 0.5, (64, 48))
    assert vars(parsed(text, "--seed", "5"))["cluster.seed"] == 5


@for_each(
    ("text", "words", "gone"),
    [
        ("strokes = 100", ["--stroke-size", "9"], None),
        ("azimuth = 30", ["--from", "left"], "view.azimuth"),
        ('ground = "toned"', ["--background", "white"], "ground.ground"),
        ("orbit = 12", ["--path", "a.json"], "path.orbit"),
        ("verbose = true", ["--quiet"], None),
        ('look = "ink"', ["--stroke", "gaussian"], None),
        ('stroke = "gaussian"', ["--look", "ink"], "draw.stroke"),
        ('preset = "paper"', ["--look", "ink"], None),
        ('swap = ["#000000:#ffffff"]', ["--swap", "#ff0000:#00ff00"], None),
    ],
)
def test_a_flag_takes_the_place_of_what_it_excludes(text, words, gone):
    args = parsed(text, *words)
    assert options_of(args) == options_of(parse(["render", "scene.ply", *words]))
    assert gone not in vars(args)
    paint_config(args)


def test_options_above_the_tables_are_for_the_commands_that_have_them():
    args = parsed("orbit = 12\nseed = 4", command="prune")
    assert not hasattr(args, "path.orbit")
    assert parsed("orbit = 12\nseed = 4", command="cluster")


def test_a_scene_may_stand_in_the_file_and_that_of_the_command_line_takes_its_place():
    text = 'scene = ["a.ply", "b.ply"]'
    assert parsed(text, scene=()).scene == [Path("a.ply"), Path("b.ply")]
    assert parsed(text).scene == [Path("scene.ply")]


def test_files_are_sought_beside_the_file_and_outputs_are_not():
    text = 'stroke = "brush.png,flat"\npalette = "here.png"\noutput = "brush.png"\n'
    text += 'direction = "painting:brush.png"'
    path = config(text, "sub/mine.toml")
    Path("sub/brush.png").touch()
    Path("here.png").touch()
    args = vars(parse(["render", "scene.ply", "--config", path]))
    assert (args["draw.stroke"], args["palette.file"]) == ("sub/brush.png,flat", Path("here.png"))
    assert (str(args["strokes.direction"]), args["output"]) == ("painting:sub/brush.png", "brush.png")


def test_words_that_are_no_files_stay_as_they_are():
    Path("0.7").touch()
    assert located_text("/etc/a.png", Path("x")) == "/etc/a.png"
    assert located_text("oil", Path()) == "oil"
    assert located_text("a\0.b", Path()) == "a\0.b"


@for_each(
    ("text", "message"),
    [
        ("\nstrokez = 3", "mine.toml: line 2: strokez is no option; did you mean 'stroke'"),
        ("[render]\nsize = '12'", "line 2: size must be WIDTHxHEIGHT"),
        ("[render]\nhost = 'x'", r"line 2: \[render\] host is no option of `brushgs render`"),
        ("[render]\nlook = oil", "mine.toml: is not TOML"),
        ("config = 'other.toml'", "line 1: a file of options names no other; remove config"),
        ("strokes = 3\nstroke-size = 4", "cannot be combined with .*; some options are those of --config"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_with_its_line(text, message):
    with pytest.raises(ValueError, match=message):
        parsed(text)


def test_a_file_that_is_missing_is_told(capsys):
    assert main(["render", "scene.ply", "--config", "nope.toml"]) == 2
    assert capsys.readouterr().err == "brushgs: nope.toml: cannot be read: no such file or directory\n"
