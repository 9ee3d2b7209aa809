"""Commands that run here, processes and what they tell, and the scene file that most of them are given."""

import json
from pathlib import Path

import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.pipeline.report import Report
from tests.scenes import save_upright, still_life_of


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A still life whose header says that up is -y; it is not to be changed."""
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    save_upright(still_life_of(1000), path)
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of one command."""
    capsys.readouterr()
    code = main([str(word) for word in words])
    return code, *capsys.readouterr()


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """The one sentence with which a command ends."""
    code, out, err = run(capsys, *words)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("brushgs: ")
    return err


def is_alive(pid: int) -> bool:
    """Whether a process runs: a zombie does not."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def stages_of(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, dict]:
    """The stages of one command by name, as its JSON has them."""
    code, out, err = run(capsys, *words, "--json")
    assert code == 0, err
    return {stage["name"]: stage for stage in json.loads(out)["stages"]}


def stages(report: Report) -> dict:
    """The stages of a report by name."""
    return {stage.name: stage for stage in report.stages}


def names(folder: str | Path = ".") -> list[str]:
    """What lies in a folder, hidden files too."""
    return sorted(path.name for path in Path(folder).iterdir())


def save_opaque(path: str | Path, rgb) -> None:
    """Write a picture [H, W, 3] without transparency."""
    bg.save(bg.Frame(rgb.astype("float32"), rgb[..., 0].astype("float32") * 0 + 1), path)
