"""Help for people: the options that matter, one group, options by people's words, and what was meant."""

from pathlib import Path

import pytest

from brushgs import cli
from brushgs.cli.parser import COMMANDS, command_parser, parse
from tests.kit.commands import refused
from tests.kit.for_each import for_each

MATTER = {"look", "size", "from", "up", "zoom", "strokes", "stroke", "stroke-size"}
MATTER |= {"palette", "style", "lamp", "ground", "orbit", "output", "preset"}


def asked(capsys, *words):
    with pytest.raises(SystemExit, match=r"^0$"):
        cli.main(words)
    return capsys.readouterr().out


def flags_in(text):
    return {line.split()[0].removeprefix("--") for line in text.splitlines() if line.startswith("  --")}


def test_the_short_help_of_render_is_fifteen_options_with_an_example_each(capsys):
    text = asked(capsys, "render", "-h")
    assert flags_in(text) == MATTER
    assert "--look charcoal " in text
    assert "`brushgs render --help` lists all" in text
    assert max(map(len, text.splitlines())) <= 96
    parser = command_parser("render")
    for line in text.splitlines():
        if line.startswith("  --"):
            flag, example = line.split()[:2]
            parser.parse_args(["scene.ply", f"{flag}={example}"])


@for_each("command", COMMANDS)
def test_every_command_has_short_help(command, capsys):
    assert asked(capsys, command, "-h").startswith(f"usage: brushgs {command}")


def test_a_group_is_shown_by_its_name(capsys):
    light = flags_in(asked(capsys, "help", "light"))
    assert light == {"relief", "lamp", "key", "sun", "gloss", "canvas"}
    assert {"strokes", "seed"} < flags_in(asked(capsys, "help", "clustering"))


@for_each(
    ("words", "flags"),
    [
        (["brush", "size"], {"stroke-size"}),
        (["rotate"], {"azimuth", "from", "up", "roll", "orbit", "elevation"}),
        (["background"], {"ground", "backdrop", "background"}),
        (["crop"], {"crop", "zoom", "pan", "size", "look-at", "where"}),
        (["how", "to", "change", "the", "resolution"], {"size"}),
    ],
)
def test_options_are_found_by_the_words_that_people_have(words, flags, capsys):
    assert flags_in(asked(capsys, "help", *words)) == flags


@for_each(
    ("words", "sentence"),
    [
        (["help", "colr"], "help finds no command, group or option by 'colr'; did you mean 'color'?"),
        (["help", "the"], "help finds no command, group or option by ''"),
        (["rendr", "a.ply"], "'rendr' is no command, and no file; did you mean 'render'?"),
        (["xyzzy"], "'xyzzy' is no command, and no file; `brushgs help` lists commands (see brushgs --help)"),
        (["trukc.ply"], "trukc.ply: there is no such file; check the path; did you mean truck.ply?"),
        (["info", "trukc.ply"], "did you mean truck.ply?"),
        (["info", "sub/trukc.ply"], "sub/trukc.ply: there is no such file; check the path\n"),
        (["prune", "a.ply", "--kep", "1"], "did you mean --keep? (see brushgs prune --help)"),
        (["render", "a.ply", "--loo", "oil"], "--loo oil; flags are written in full: did you mean --look, "),
        (["render", "a.ply", "--azim=30"], "--azim=30; flags are written in full: did you mean --azimuth?"),
        (["--ver"], "--ver; flags are written in full: did you mean --version"),
    ],
)
def test_what_was_meant_is_asked(words, sentence, folder, capsys):
    Path("truck.ply").touch()
    assert sentence in refused(capsys, *words)


def test_a_scene_alone_is_rendered(scene, folder):
    Path("folder").mkdir()
    for name in (str(scene), "folder", "missing.spz"):
        args = parse([name, "--look", "plain"])
        assert (args.command, args.scene, args.look) == ("render", [Path(name)], "plain")
    words = ["--strokes", "50", "--stroke", "ellipse", "--see", "off", "--size", "32x24", "--quiet"]
    assert cli.main([str(scene), *words]) == 0
    assert Path("pears-ellipse.png").exists()
