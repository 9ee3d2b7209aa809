"""Looks on the command line: which of them a painting is in, and what takes the place of which part."""

import re
from dataclasses import replace
from math import radians

import pytest

from brushgs.cli.commands.render import VIEW
from brushgs.cli.configs import paint_config, painting_name
from brushgs.cli.parser import parse
from brushgs.options.choices import DEFAULT_BACKDROP, LOOKS
from brushgs.options.look import Look
from brushgs.options.painting import CleanConfig, ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.stroke_target import UsualCount
from tests.kit.commands import run
from tests.kit.for_each import for_each

OIL = Look.open("oil").config
COMMANDS = {"render": ["a.ply"], "demo": []}


def config_of(*words, command="render"):
    return paint_config(parse([command, *COMMANDS[command], *words]))


def test_oil_is_painted_where_nothing_is_named_and_other_commands_are_plain():
    for command in COMMANDS:
        assert config_of(command=command) == OIL == config_of("--look", "oil", command=command)
    for command in ("prune", "cluster", "refine", "stability", "bench", "views"):
        assert paint_config(parse([command, "a.ply"])) == PaintConfig()


@for_each("words", [["--preset", "paper"], ["--stroke", "gaussian"]])
def test_the_published_method_and_the_plain_picture_have_no_look(words):
    config = config_of(*words)
    plain = PaintConfig()
    for step in ("brushes", "color", "ground", "light", "media"):
        assert getattr(config, step) == getattr(plain, step)
    assert config == config_of("--look", "plain", *words)
    with pytest.raises(ValueError, match=f"--look ink cannot be combined with {' '.join(words)}, which is"):
        config_of("--look", "ink", *words)


def test_a_stroke_takes_the_place_of_the_brushes_and_the_rest_stays():
    config = config_of("--stroke", "swirl")
    assert config == PaintConfig(
        cluster=ClusterConfig(UsualCount(6000)),
        draw=DrawConfig("swirl"),
        ground=OIL.ground,
        light=OIL.light,
        color=OIL.color,
        strokes=OIL.strokes,
    )
    assert config_of("--look", "plain", "--stroke", "swirl") == PaintConfig(draw=DrawConfig("swirl"))


@for_each("background", ["white", "transparent"])
def test_a_background_takes_the_place_of_ground_and_backdrop(background):
    config = config_of("--background", background)
    assert (config.ground.ground, config.ground.backdrop, config.draw.background) == ("none", 0, background)
    assert (config.brushes, config.light) == (OIL.brushes, OIL.light)
    with_strokes = config_of("--background", background, "--backdrop", "on").ground
    assert (with_strokes.ground, with_strokes.backdrop) == ("none", OIL.ground.backdrop)
    with pytest.raises(ValueError, match="--ground cannot be combined with --background, which takes its"):
        config_of("--background", background, "--ground", "paper")


@for_each(
    ("words", "stage", "backdrop", "is_always"),
    [
        (["--backdrop", "on"], True, OIL.ground.backdrop, True),
        (["--backdrop", "on", "--look", "plain"], True, 0, True),
        (["--backdrop", "loose"], False, OIL.ground.backdrop, True),
        (["--backdrop", "loose", "--look", "ink"], False, DEFAULT_BACKDROP, True),
        (["--backdrop", "off"], False, 0, False),
        (["--backdrop", "1"], False, 1, True),
        ([], True, OIL.ground.backdrop, False),
        (["--preset", "0.1"], False, OIL.ground.backdrop, False),
        (["--background", "transparent"], False, 0, False),
    ],
)
def test_a_backdrop_is_a_stage_or_loose_or_none(words, stage, backdrop, is_always):
    ground = config_of(*words).ground
    assert (ground.stage, ground.backdrop, ground.backdrop_always) == (stage, backdrop, is_always)


@for_each(
    ("words", "step", "name", "value"),
    [
        (["--ground", "#123456"], "ground", "ground", "#123456"),
        (["--lamp", "-45,30"], "light", "lamp", (radians(-45), radians(30))),
        (["--focus", "off"], "strokes", "focus", None),
        (["--strokes", "auto"], "cluster", "strokes", "auto"),
        (["--underpaint", "off"], "draw", "underpaint", False),
        (["--keep", "0.5"], "prune", "keep", 0.5),
    ],
)
@for_each("look", ["oil", "ink"])
def test_every_flag_overrides_its_part_of_a_look_and_nothing_else(look, words, step, name, value):
    base = Look.open(look).config
    step_of_it = replace(getattr(base, step), **{name: value})
    assert config_of("--look", look, *words) == replace(base, **{step: step_of_it})


def test_a_look_lies_between_the_defaults_of_a_command_and_a_preset(tmp_path):
    (tmp_path / "mine.toml").write_text('[draw]\nstroke = "dab"\nbackground = "teal"\n')
    args = parse(["render", "a.ply", "--look", str(tmp_path / "mine.toml")])
    config = paint_config(args, draw={"background": "black", "filter": "nearest"})
    assert config == PaintConfig(draw=DrawConfig("dab", background="teal", filter="nearest"))


@for_each("look", LOOKS)
def test_the_preset_of_a_version_keeps_its_defaults_in_any_look(look):
    words = ["render", "a.ply", "--look", look, "--preset", "0.1"]
    config = paint_config(parse(words), view=VIEW)
    now = Look.open(look).config
    assert config == replace(
        now,
        clean=CleanConfig("floaters"),
        view=ViewConfig(),
        ground=replace(now.ground, stage=False),
        light=replace(now.light, key=0.0),
        color=replace(now.color, values=0.0),
        strokes=replace(now.strokes, focus=None, economy=0.0, edges=0.0),
    )
    again = paint_config(parse([*words, "--size", "auto", "--clean", "off"]), view=VIEW)
    assert (again.view.size, again.clean.floaters) == ("auto", "off")


@for_each(
    ("words", "name"),
    [
        ([], "oil"),
        (["--look", "ink"], "ink"),
        (["--look", "plain"], "plain"),
        (["--strokes", "50"], "oil"),
        (["--stroke", "swirl"], "swirl"),
        (["--look", "ink", "--stroke", "brushes/my.png"], "my"),
        (["--stroke", "flat, brushes/my dab.png"], "flat-my dab"),
        (["--stroke", "flat,dab,ink,fan"], "flat-and-3-more"),
        (["--stroke", "gaussian"], "gaussian"),
        (["--preset", "paper"], "swirl"),
        (["--look", "looks/mine.toml"], "mine"),
    ],
)
def test_a_painting_is_called_after_its_stroke_or_its_look(words, name):
    args = parse(["render", "a.ply", *words])
    draw = DrawConfig(words[words.index("--stroke") + 1]) if "--stroke" in words else DrawConfig("swirl")
    assert painting_name(args, PaintConfig(draw=draw)) == name


@for_each(
    ("words", "sentence"),
    [
        (["--look", ""], ": is a folder, not a look"),
        (["--lamp", "225"], "--lamp must be 2 numbers separated by commas, got '225'"),
        (["--lamp", "225,0"], "lamp must have an elevation above 0 and at most 90 degrees, got 0"),
        (["--pigments", "1"], "pigments must be 2 to 256, or 0 for any color, got 1"),
        (["--sun", "10,-5"], "sun must have an elevation above 0 and at most 90 degrees, got -5"),
        (["--sun", "0,20..90,91"], "sun must have an elevation above 0 and at most 90 degrees, got 91"),
        (["--backdrop", "many"], "--backdrop must be stage, loose, on, off or a whole number, got 'many'"),
        (["--ground", ""], "ground must be toned, canvas, paper, none"),
    ],
)
def test_what_the_flags_of_a_look_do_not_take_gets_one_sentence(words, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        config_of(*words)


@for_each(
    ("words", "strokes", "strokes_for", "economy"),
    [
        (["--quality", "good"], UsualCount(6000), "scene", 1.0),
        (["--quality", "draft"], UsualCount(1500), "view", 0.0),
        (["--quality", "final"], UsualCount(12000), "scene", 1.0),
        (["--quality", "draft", "--strokes", "99", "--economy", "0.5"], 99, "view", 0.5),
        (["--quality", "draft", "--look", "plain"], UsualCount(500), "view", 0.0),
        (["--quality", "final", "--look", "plain"], "auto:frame", "scene", 0.0),
        (["--quality", "final", "--preset", "paper"], 7000, "scene", 0.0),
        (["--quality", "final", "--stroke", "gaussian"], None, "scene", 0.0),
    ],
)
def test_a_quality_lies_between_a_look_and_what_is_given(words, strokes, strokes_for, economy):
    config = config_of(*words)
    found = config.cluster.strokes, config.cluster.strokes_for, config.strokes.economy
    assert found == (strokes, strokes_for, economy)


def test_a_quality_says_first_how_long_it_takes(scene, tmp_path, capsys):
    words = ["render", scene, "--look", "plain", "--size", "64x48", "-o", tmp_path / "a.png"]
    said = run(capsys, *words, "--quality", "draft")[2]
    assert re.search(r"note: this takes about [0-9.]+ seconds on this machine", said)
    assert "this takes" not in run(capsys, *words)[2]
