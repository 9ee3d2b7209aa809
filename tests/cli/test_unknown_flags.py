"""Flags are written in full, everywhere; one that there is not gets a sentence with the nearest."""

from pathlib import Path

import pytest

from brushgs import cli
from brushgs.cli.parser import COMMANDS, UsageError, command_parser, parse
from brushgs.cli.unknown_flags import with_nearest_flag

JOB = """
[[job]]
scene = "a.ply"
output = "a.png"
{option} = 30
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["render", "a.ply", "--loo", "oil"], "--loo oil; flags are written in full: did you mean --look, "),
        (["render", "a.ply", "--azim=30"], "--azim=30; flags are written in full: did you mean --azimuth?"),
        (["bench", "a.ply", "--stroke-s", "9"], "--stroke-s 9; did you mean --strokes?"),
        (["bench", "a.ply", "--quic"], "--quic; flags are written in full: did you mean --quick?"),
        (["stability", "a.ply", "--skip", "--look", "oil"], "--skip; .* did you mean --skip-alone?"),
        (["views", "a.ply", "--look", "oil"], "--look oil; .* did you mean --look-at?"),
        (["render", "a.ply", "--orbt", "9"], "--orbt 9; did you mean --orbit?"),
        (["render", "--azim", "30"], "--azim; flags are written in full"),
        (["render", "a.ply", "--qqq"], "--qqq .see brushgs render --help.$"),
        (["render", "a.ply", "--conf", "a.toml"], "--conf a.toml; .* did you mean --config?"),
        (["batch", "jobs.toml", "--res"], "--res; .* did you mean --resume?"),
        (["--ver"], "--ver; flags are written in full: did you mean --version"),
    ],
)
def test_a_flag_that_there_is_not_is_refused_with_the_nearest(words, sentence, capsys):
    with pytest.raises(UsageError, match=f"^unrecognized arguments: {sentence.replace('?', '[?]')}"):
        parse(words)
    assert cli.main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_takes_a_shortened_flag(command):
    parser = command_parser(command)
    assert not parser.allow_abbrev
    whole = [flag for action in parser._actions for flag in action.option_strings]
    assert "--debug" in whole
    with pytest.raises(UsageError, match=r"--debu; flags are written in full: did you mean --debug[?]"):
        parse([command, "a.ply", "--debu"])


def test_a_file_of_options_takes_whole_names_only(capsys):
    Path("mine.toml").write_text("azim = 30\n")
    assert cli.main(["render", "a.ply", "--config", "mine.toml"]) == 2
    assert "azim is no option; did you mean 'azimuth'?" in capsys.readouterr().err
    Path("mine.toml").write_text("[bench]\nquic = true\n")
    assert cli.main(["bench", "a.ply", "--config", "mine.toml"]) == 2
    assert "quic is no option of `brushgs bench`; did you mean 'quick'?" in capsys.readouterr().err


def test_a_job_takes_whole_names_only(capsys):
    Path("jobs.toml").write_text(JOB.format(option="azim"))
    assert cli.main(["batch", "jobs.toml"]) == 2
    assert "azim is no option of `brushgs render`; did you mean 'azimuth'?" in capsys.readouterr().err


def test_what_is_wrong_otherwise_is_said_as_before():
    sentence = "--size must be two numbers (see brushgs render --help)"
    assert with_nearest_flag(sentence, ["render", "--size", "3"], ["--size"]) == sentence
    assert with_nearest_flag(sentence, ["render", "--", "--siz"], ["--size"]) == sentence
    with pytest.raises(UsageError, match="invalid choice: 'blur'"):
        parse(["render", "a.ply", "--filter", "blur"])
