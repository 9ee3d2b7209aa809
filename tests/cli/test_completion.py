"""`brushgs completion` prints scripts that shells take, with the flags of every command."""

import shutil
import subprocess
import sys

import pytest

from brushgs.cli import main
from brushgs.cli.commands.completion import SHELLS
from brushgs.cli.option_words import named_actions
from brushgs.cli.parser import COMMANDS, command_parser

pytest.importorskip("shtab")
# What reads a script without running it.


@pytest.fixture
def script(tmp_path, capsys):
    def script(shell):
        assert main(["completion", shell]) == 0
        path = tmp_path / f"brushgs.{shell}"
        path.write_text(capsys.readouterr().out, encoding="utf-8")
        return path

    return script


def completed(path, *words):
    """What bash offers for the last word."""
    lines = f'source "{path}"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
    lines += '_shtab_brushgs; echo "${COMPREPLY[@]}"'
    words = ["bash", "-c", lines, "bash", "brushgs", *words]
    return set(subprocess.run(words, capture_output=True, text=True, cwd=path.parent).stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes_commands_flags_values_and_files(script):
    path = script("bash")
    assert completed(path, "re") == {"render", "recolor", "refine"}
    assert completed(path, "render", "--filter", "") == {"mip", "bilinear", "nearest"}
    assert completed(path, "render", "brushgs.b") == {"brushgs.bash"}
    assert completed(path, "render", "--palette", "brush") == {"brushgs.bash"}
    assert completed(path, "completion", "") == set(SHELLS)
    for command in COMMANDS:
        actions = named_actions(command_parser(command)).items()
        flags = {f"--{name}" for name, action in actions if action.option_strings}
        assert flags <= completed(path, command, "--")


def test_what_is_not_installed_is_told(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["completion", "bash"]) == 2
    said = "brushgs: completion needs shtab, which is not installed; pip install 'brushgs[completion]'\n"
    assert capsys.readouterr().err == said
