"""Options by name are the words that one would type: each flag of `render`, and what no flag takes."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from brushgs.by_keywords import _namespace
from brushgs.cli.option_words import OptionError, named_actions, option_words
from brushgs.cli.parser import COMMANDS, command_parser
from tests.kit.for_each import for_each

# Option of `brushgs render` -> (value of a keyword or a file, words that one types for the same).
EXAMPLES = {
    "scene": (["a.ply", Path("b.ply")], ["a.ply", "b.ply"]),
    "lod": (2, ["--lod", "2"]),
    "time": ("40%", ["--time", "40%"]),
    "moments-per-second": (12.5, ["--moments-per-second", "12.5"]),
    "memory": ("8GB", ["--memory", "8GB"]),
    "output": (Path("out") / "a.png", ["-o", "out/a.png"]),
    "preset": ("paper", ["--preset", "paper"]),
    "look": ("ink", ["--look", "ink"]),
    "ground": ("toned", ["--ground", "toned"]),
    "backdrop": (True, ["--backdrop", "on"]),
    "stage-tone": ("#7a6a58,#9aa4b0", ["--stage-tone", "#7a6a58,#9aa4b0"]),
    "shadow": ("40%", ["--shadow", "0.4"]),
    "pigments": (np.int64(12), ["--pigments", "12"]),
    "chroma": (np.float32(1.5), ["--chroma", "1.5"]),
    "relief": (0.25, ["--relief", "25%"]),
    "lamp": ([-20, 45.5], ["--lamp=-20,45.5"]),
    "sun": ("-20,45..80,10", ["--sun=-20,45..80,10"]),
    "key": ("50%", ["--key", "0.5"]),
    "values": (0.5, ["--values", "0.5"]),
    "economy": (1, ["--economy", "1"]),
    "edges": (0.25, ["--edges", "0.25"]),
    "depth-of-field": ("60%", ["--depth-of-field", "0.6"]),
    "gloss": (0.01, ["--gloss", "0.01"]),
    "canvas": ("linen", ["--canvas", "linen"]),
    "stroke": (["flat", "dab"], ["--stroke", "flat,dab"]),
    "filter": ("nearest", ["--filter", "nearest"]),
    "extent": ("paper", ["--extent", "paper"]),
    "order": ("soft", ["--order", "soft"]),
    "underpaint": (False, ["--underpaint", "off"]),
    "streaks": (Fraction(1, 4), ["--streaks", "0.25"]),
    "background": ("#aabbcc", ["--background", "#aabbcc"]),
    "threads": (1, ["--threads", "1"]),
    "keep": ("70%", ["--keep", "0.7"]),
    "weight": ("paper", ["--weight", "paper"]),
    "clean": ("off", ["--clean", "off"]),
    "strokes": (2000, ["--strokes", "2000"]),
    "stroke-color": ("own", ["--stroke-color", "own"]),
    "hold": (2, ["--hold", "2"]),
    "hold-camera": (True, ["--hold-camera"]),
    "boil": (Fraction(1, 4), ["--boil", "0.25"]),
    "boil-every": (3, ["--boil-every", "3"]),
    "redraw": (0.5, ["--redraw", "0.5"]),
    "redraw-from": ("left", ["--redraw-from", "left"]),
    "smear": (0.5, ["--smear", "0.5"]),
    "stroke-size": (24, ["--stroke-size", "24px"]),
    "features": ("paper", ["--features", "paper"]),
    "merge": ("paper", ["--merge", "paper"]),
    "method": ("lloyd", ["--method", "lloyd"]),
    "seed": (7, ["--seed", "7"]),
    "strokes-for": ("view", ["--strokes-for", "view"]),
    "see": ("off", ["--see", "off"]),
    "focus": ((-1.5, 0, 2, 0.5), ["--focus=-1.5,0,2,0.5"]),
    "solid": (True, ["--solid", "on"]),
    "direction": ("own", ["--direction", "own"]),
    "broken-color": (1e-3, ["--broken-color", "0.001"]),
    "palette": ("a.png", ["--palette", "a.png"]),
    "palette-strength": (0.5, ["--palette-strength", "50%"]),
    "palette-space": ("srgb", ["--palette-space", "srgb"]),
    "style": ({"a.style": 0.5, "b.style": 0.25}, ["--style", "a.style:0.5,b.style:0.25"]),
    "adjust": ({"contrast": 1.2, "brightness": -0.5}, ["--adjust", "contrast=1.2,brightness=-0.5"]),
    "swap": (
        ["#ff0000:#00ff00", "#000000:#ffffff"],
        ["--swap", "#ff0000:#00ff00", "--swap", "#000000:#ffffff"],
    ),
    "rules": ("r.toml", ["--rules", "r.toml"]),
    "where": ("subject and not part:1", ["--where", "subject and not part:1"]),
    "where-soft": (0.1, ["--where-soft", "0.1"]),
    "text-model": ("model", ["--text-model", "model"]),
    "size": ((640, 360), ["--size", "640x360"]),
    "crop": ((0, 8, 640, 360), ["--crop", "0,8,640,360"]),
    "up": ("-y", ["--up=-y"]),
    "azimuth": (-30.5, ["--azimuth=-30.5"]),
    "elevation": (-1e-3, ["--elevation=-1e-3"]),
    "from": ("left", ["--from", "left"]),
    "look-at": (np.array([0.0, -1.5, 2.0]), ["--look-at", "0,-1.5,2"]),
    "distance": (3, ["--distance", "3"]),
    "pan": ((-0.1, 0), ["--pan=-0.1,0"]),
    "roll": (5, ["--roll", "5"]),
    "fov-deg": (35, ["--fov-deg", "35"]),
    "zoom": (2.0, ["--zoom", "2"]),
    "camera-file": ("cameras.json", ["--camera-file", "cameras.json"]),
    "view": (3, ["--view", "3"]),
    "views": (True, ["--views"]),
    "explain": (True, ["--explain"]),
    "orbit": (12, ["--orbit", "12"]),
    "sway": (15, ["--sway", "15"]),
    "path": ("path.json", ["--path", "path.json"]),
    "frames": (30, ["--frames", "30"]),
    "seconds": (2.5, ["--seconds", "2.5"]),
    "fps": (25, ["--fps", "25"]),
    "loop": (True, ["--loop"]),
    "lock": ("anchor", ["--lock", "anchor"]),
    "colorspace": ("acescg", ["--colorspace", "acescg"]),
    "grow": (8, ["--grow", "8"]),
    "first": ("30%", ["--first", "0.3"]),
    "resume": (True, ["--resume"]),
    "jobs": (2, ["--jobs", "2"]),
    "scheduler": ("tcp://host:8786", ["--scheduler", "tcp://host:8786"]),
    "workers-timeout": (5, ["--workers-timeout", "5"]),
    "start": (0.5, ["--start", "0.5"]),
    "end": ("80%", ["--end", "80%"]),
    "speed": (0.5, ["--speed", "0.5"]),
    "cross-fade": (0.5, ["--cross-fade", "0.5"]),
    "projection": ("equirect", ["--projection", "equirect"]),
    "stereo": ("vr180", ["--stereo", "vr180"]),
    "ipd": (0.065, ["--ipd", "0.065"]),
    "layers": (("depth", "normal"), ["--layers", "depth,normal"]),
    "deep": (True, ["--deep"]),
    "no-clobber": (True, ["--no-clobber"]),
    "no-metadata": (True, ["--no-metadata"]),
    "codec": ("vp9", ["--codec", "vp9"]),
    "bits": (16, ["--bits", "16"]),
    "json": (True, ["--json"]),
    "quiet": (True, ["--quiet"]),
    "verbose": (True, ["--verbose"]),
    "debug": (True, ["--debug"]),
    "config": ("c.toml", ["--config", "c.toml"]),
}
RENDER = command_parser("render")


def namespace(words):
    has_scene = any(word.endswith(".ply") for word in words)
    return vars(RENDER.parse_args([*([] if has_scene else ["scene.ply"]), *words]))


@for_each("name", named_actions(RENDER))
def test_every_option_of_render_is_what_one_types(name):
    value, typed = EXAMPLES[name]
    if name not in ("scene", "config"):  # what Python gives is stored as it is
        assert repr(vars(_namespace({name: value})) | {"scene": []}) == repr(namespace(typed) | {"scene": []})
    if isinstance(value, str | int | float | list | dict | Path) and "numpy" not in str(type(value)):
        words = option_words(RENDER, {name: value})  # what a file has becomes words
        assert repr(namespace(words)) == repr(namespace(typed))
        assert option_words(RENDER, {name.replace("-", "_") + "_": value}) == words


def test_none_and_false_are_options_that_are_omitted():
    assert option_words(RENDER, {"size": None, "loop": False, "scene": None}) == []


def test_arguments_come_first_and_are_never_taken_for_flags():
    words = option_words(RENDER, {"size": "64x48", "scene": ["-a.ply", "b.ply"]})
    assert words == ["./-a.ply", "b.ply", "--size=64x48"]


def test_several_values_of_one_flag_stay_its_values():
    looks = command_parser("looks")
    args = looks.parse_args(option_words(looks, {"looks": ["ink"], "scene": ["a.ply", "b.ply"], "time": 1}))
    assert (args.looks, args.scene) == (["ink"], [Path("a.ply"), Path("b.ply")])


def test_a_flag_with_an_optional_value_is_a_switch_too():
    parser = command_parser("strokes")
    assert option_words(parser, {"sheet": True}) == ["--sheet"]
    assert option_words(parser, {"sheet": False}) == []
    assert option_words(parser, {"sheet": "a.png"}) == ["--sheet=a.png"]


@for_each(
    ("name", "value", "message"),
    [
        ("strokez", 3, "strokez is no option of `brushgs render`; did you mean 'stroke'"),
        ("qqqq", 3, "lists them"),
        ("help", True, "help is no option"),
        ("size", 12, "size must be WIDTHxHEIGHT in pixels"),
        ("size", (0, 5), "size must be"),
        ("size", [], r"must be text or a number as its flag takes, got \[\]"),
        ("pan", (1, 2, 3), "pan must be 2 numbers separated by commas, got '1,2,3'"),
        ("strokes", 0.5, "strokes must be a count of 1 or more, a share such as 10%"),
        ("strokes", True, "must be text or a number"),
        ("azimuth", float("nan"), "must be text or a number"),
        ("loop", 1, "loop must be true or false, got 1"),
        ("filter", "mipp", "filter must be one of mip, bilinear, nearest, got 'mipp'; did you mean 'mip'"),
        ("solid", "yes", "solid must be on or off, got 'yes'"),
        ("swap", [["#ff0000", "#00ff00"]], "swap must be"),
        ("look", {"name": "oil"}, "look must be text or a number"),
        ("adjust", {"contrast": 9}, "adjust contrast must be 0 to 3, got 9"),
        ("look", object(), "must be text or a number"),
    ],
)
def test_what_a_flag_does_not_take_is_refused_by_name(name, value, message):
    with pytest.raises(OptionError, match=message) as caught:
        option_words(RENDER, {name: value})
    assert caught.value.name == name


@for_each("command", COMMANDS)
def test_flags_of_all_commands_have_names(command):
    actions = named_actions(command_parser(command))
    assert "debug" in actions
    assert all(name.replace("-", "").isalnum() for name in actions)
