"""Flags are written in full, everywhere; one that there is not gets a sentence with the nearest."""

from pathlib import Path

import pytest

from brushgs import cli
from brushgs.cli.parser import UsageError, parse

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
        (["--ver"], "--ver; flags are written in full: did you mean --version"),
    ],
)
def test_a_flag_that_there_is_not_is_refused_with_the_nearest(words, sentence, capsys):
    with pytest.raises(UsageError, match=f"^unrecognized arguments: {sentence.replace('?', '[?]')}"):
        parse(words)
    assert cli.main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_job_takes_whole_names_only(capsys):
    Path("jobs.toml").write_text(JOB.format(option="azim"))
    assert cli.main(["batch", "jobs.toml"]) == 2
    assert "azim is no option of `brushgs render`; did you mean 'azimuth'?" in capsys.readouterr().err
