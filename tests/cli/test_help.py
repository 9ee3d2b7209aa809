"""Help for people: the options that matter, one group, options by people's words, and what was meant."""

from pathlib import Path

import pytest

import brushgs as bg
from brushgs import cli
from brushgs.cli.parser import COMMANDS, command_parser, parse
from brushgs.still_life import still_life

MATTER = {"look", "size", "from", "up", "zoom", "strokes", "stroke", "stroke-size"}
MATTER |= {"palette", "style", "lamp", "ground", "orbit", "output", "preset"}


def asked(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    assert stop.value.code == 0
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


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_short_help(command, capsys):
    assert asked(capsys, command, "-h").startswith(f"usage: brushgs {command}")


def test_a_group_is_shown_by_its_name(capsys):
    light = flags_in(asked(capsys, "help", "light"))
    assert light == {"relief", "lamp", "key", "sun", "gloss", "canvas"}
    assert {"strokes", "seed"} < flags_in(asked(capsys, "help", "clustering"))


@pytest.mark.parametrize(
    ("words", "flags"),
    [
        (["brush", "size"], {"stroke-size"}),
        (["brush size"], {"stroke-size"}),
        (["stroke-size"], {"stroke-size"}),
        (["rotate"], {"azimuth", "from", "up", "roll", "orbit", "elevation"}),
        (["background"], {"ground", "backdrop", "background"}),
        (["quality"], {"size", "strokes", "codec", "bits"}),
        (["portrait"], {"size", "from", "look-at"}),
        (["crop"], {"crop", "zoom", "pan", "size", "look-at", "where"}),
        (["how", "to", "change", "the", "resolution"], {"size"}),
    ],
)
def test_options_are_found_by_the_words_that_people_have(words, flags, capsys):
    assert flags_in(asked(capsys, "help", *words)) == flags


@pytest.mark.parametrize(
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
    ],
)
def test_what_was_meant_is_asked(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("truck.ply").touch()
    assert cli.main(words) == 2
    assert sentence in capsys.readouterr().err


def test_a_scene_alone_is_rendered(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bg.save(still_life(1000), "a.ply")
    Path("folder").mkdir()
    for name in ("a.ply", "folder", "missing.spz"):
        args = parse([name, "--look", "plain"])
        assert (args.command, args.scene, args.look) == ("render", [Path(name)], "plain")
    assert cli.main(["a.ply", "--strokes", "50", "--look", "plain", "--size", "32x24", "--quiet"]) == 0
    assert Path("a-plain.png").exists()
