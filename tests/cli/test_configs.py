"""Flags become frozen configuration, and every flag explains itself."""

import re
from pathlib import Path

import pytest

from brushgs.cli.commands import refine, render
from brushgs.cli.configs import grow_config, paint_config, path_config
from brushgs.cli.flags import CLASSES, Fields
from brushgs.cli.parser import COMMANDS, build_parser, parse
from brushgs.options.direction import Direction
from brushgs.options.experiments import RefineConfig
from brushgs.options.focus import Focus
from brushgs.options.painting import ClusterConfig, DrawConfig, PruneConfig, StrokesConfig, ViewConfig
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.options.where import Where, WhereConfig
from tests.kit.for_each import for_each

# Of the drawing and the clustering of presets.
GAUSSIAN = {"stroke": "gaussian", "underpaint": False, "streaks": 0.0}
ON_PAPER = GAUSSIAN | {"stroke": "swirl", "filter": "bilinear", "extent": "paper", "lock": "off"}
ON_PAPER |= {"order": "depth"}
OF_PAPER = {"strokes": 7000, "features": "paper", "merge": "paper", "method": "minibatch"}


@for_each(
    ("words", "prune", "cluster", "draw"),
    [
        ("--look plain", {}, {}, {}),
        ("--stroke gaussian", {"keep": 1.0}, {"strokes": None}, GAUSSIAN),
        ("--stroke gaussian --strokes 50 --keep 0.5", {"keep": 0.5}, {"strokes": 50}, GAUSSIAN),
        ("--preset paper", {"weight": "paper"}, OF_PAPER, ON_PAPER),
        ("--preset paper --merge cover", {"weight": "paper"}, OF_PAPER | {"merge": "cover"}, ON_PAPER),
        ("--preset paper --lock anchor", {"weight": "paper"}, OF_PAPER, ON_PAPER | {"lock": "anchor"}),
        ("--strokes 10% --seed 4 --threads 2", {}, {"strokes": 0.1, "seed": 4}, {"threads": 2}),
        ("--strokes all --background black", {}, {"strokes": None}, {"background": "black"}),
    ],
)
def test_flags_become_configuration(words, prune, cluster, draw):
    config = paint_config(parse(["render", "a.ply", *words.split()]))
    expected = PruneConfig(**prune), ClusterConfig(**cluster), DrawConfig(**draw)
    assert (config.prune, config.cluster, config.draw) == expected


@for_each(
    ("words", "expected"),
    [
        ("", StrokesConfig()),
        ("--preset paper", StrokesConfig.off()),
        ("--stroke gaussian", StrokesConfig.off()),
        ("--stroke gaussian --solid on", StrokesConfig("off", None, True, Direction("own"), 0.0)),
        ("--focus -1,2,-3,0.5", StrokesConfig(focus=Focus((-1.0, 2.0, -3.0, 0.5)))),
        ("--direction guides:a.obj", StrokesConfig(direction=Direction("guides", Path("a.obj")))),
        ("--broken-color 0.1", StrokesConfig(broken_color=0.1)),
        ("--focus subject", StrokesConfig(focus=Focus())),
        ("--focus eyes.png", StrokesConfig(focus=Focus(mask=Path("eyes.png")))),
    ],
)
def test_flags_of_strokes_become_configuration(words, expected):
    words = words.split()
    assert paint_config(parse(["render", "a.ply", "--look", "plain", *words])).strokes == expected
    if not {"--preset", "--stroke"} & set(words):
        for command in ("cluster", "refine", "stability", "bench"):
            assert paint_config(parse([command, "a.ply", *words])).strokes == expected


@for_each(
    ("words", "sentence"),
    [
        (["--see", "all"], "--see: invalid choice: 'all'"),
        (["--focus", "1,2,3"], "--focus must be auto, off, subject, x,y,z,radius in world units"),
        (["--focus", "1,2,3,0"], "--focus must be four finite numbers, the radius above 0"),
        (["--focus", "1,2,nan,1"], "--focus must be four finite numbers, the radius above 0"),
        (["--focus", ""], "--focus must be auto, off, subject"),
        (["--direction", "up"], "--direction must be own, form, color, style, painting:FILE or guides:FILE"),
    ],
)
def test_what_flags_of_strokes_do_not_take_gets_one_sentence(words, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        paint_config(parse(["render", "a.ply", *words]))


@for_each(
    ("words", "path", "sequence"),
    [
        ("--orbit 120", PathConfig(orbit=120), {}),
        ("--path p --seconds 2.5 --loop", PathConfig(file=Path("p"), seconds=2.5, loop=True), {}),
        ("--path p --frames 9 --resume", PathConfig(file=Path("p"), frames=9), {"is_resumed": True}),
        ("--orbit 9 --scheduler tcp://host:1", PathConfig(orbit=9), {"scheduler": "tcp://host:1"}),
        ("--grow 8 --fps 12 --jobs 2", GrowConfig(8.0, fps=12), {"jobs": 2}),
        ("", None, {}),
    ],
)
def test_path_flags_become_configuration(words, path, sequence):
    args = parse(["render", "a.ply", *words.split()])
    found = grow_config(args) or path_config(args), render.sequence_config(args)
    assert found == (path, SequenceConfig(**sequence))


def test_view_flags_become_radians_and_keep_their_signs():
    for up in ("-y", "-0.1,-1,0", "-.5 1 0"):
        words = ["render", "a.ply", "--up", up, "--azimuth", "-90", "--elevation", "-10", "--fov-deg", "60"]
        view = paint_config(parse([*words, "--zoom", "2", "--size", "30x20"])).view
        assert (view.azimuth, view.elevation) == pytest.approx((-1.5707963, -0.1745329))
        assert (view.fov_y, view.zoom, view.size) == (pytest.approx(1.0471976), 2.0, (30, 20))


def test_a_size_is_chosen_where_it_is_asked_for():
    for words, size in (([], None), (["--size", "auto"], "auto"), (["--size", "30x20"], (30, 20))):
        for command in ("render", "export", "bench"):
            view = paint_config(parse([command, "a.ply", *words])).view
            assert (view.size, view.fixed_size) == (size, None if size == "auto" else size)
    of_render = paint_config(parse(["render", "a.ply"]), view=render.VIEW).view
    assert of_render == ViewConfig(size="auto")
    assert paint_config(parse(["render", "a.ply", "--size", "30x20"]), view=render.VIEW).view.size == (30, 20)


def test_refine_sizes_its_views_and_not_a_picture():
    words = ["--size", "64x48", "--up", "+z", "--seed", "3", "--where", "sphere:0,0,0,1", "--resume"]
    args = parse(["refine", "a.ply", *words])
    region = WhereConfig(Where.parse("sphere:0,0,0,1"))
    assert refine.refine_config(args) == RefineConfig(size=(64, 48), seed=3, where=region, is_resumed=True)
    paint = paint_config(args)
    assert (paint.view.size, paint.view.up, paint.cluster.seed) == (None, "+z", 3)


def actions(command):
    """The flags of a command."""
    return build_parser([command])._subparsers._group_actions[0].choices[command]._actions


@for_each("command", sorted(COMMANDS))
def test_every_flag_of_a_step_fills_one_of_its_fields(command):
    for action in actions(command):
        step, dot, name = action.dest.partition(".")
        if dot and not isinstance(action, Fields):  # whose value is several of them, by name
            fields = {name for kind in CLASSES[step] for name in kind.__struct_fields__}
            assert name in fields, action.option_strings


@for_each("command", sorted(COMMANDS))
def test_every_flag_has_help_and_every_number_its_default(command, capsys):
    with pytest.raises(SystemExit, match=r"^0$"):
        parse([command, "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for action in actions(command):
        assert action.help, action.option_strings
        is_value = action.nargs is None and action.option_strings and action.dest not in ("preset", "help")
        if is_value and Path not in getattr(getattr(action, "row", None), "kinds", ()):
            assert "default" in action.help, f"{action.option_strings} does not say its default"
    assert "usage: brushgs" in text
