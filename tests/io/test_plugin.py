"""Other packages add formats and looks by entry points, as the one in examples does."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main, parser
from brushgs.formats import read_scene, registry
from brushgs.options import look
from tests.kit.refusals import refuse
from tests.scenes import still_life_of

EXAMPLE = Path(__file__).parents[2] / "examples" / "format_plugin"


def install(folder: Path, points: dict[str, dict[str, str]]) -> None:
    """What pip writes of entry points."""
    text = ""
    for group, some in points.items():
        text += f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in some.items())
    info = folder / "added-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: added\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(text)


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """Entry points are looked up once in a process."""
    for cached in (registry._plugged, look.added_looks, parser._parsers):
        cached.cache_clear()
    yield
    for cached in (registry._plugged, look.added_looks, parser._parsers):
        cached.cache_clear()


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of examples, as if it were installed."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    install(tmp_path / "site", project["entry-points"])
    monkeypatch.syspath_prepend(EXAMPLE)
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("example")
def test_a_format_of_another_package_is_written_and_read(tmp_path):
    scene = still_life_of(1000)
    bg.save(scene, "a.csv")
    (tmp_path / "a.csv").rename("b")
    loaded, notes = read_scene(tmp_path / "b")
    assert notes.format == "comma-separated text"
    np.testing.assert_allclose(loaded.means, scene.means, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(loaded.sh[:, 0], scene.sh[:, 0], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(loaded.opacities, scene.opacities, rtol=1e-6)
    (tmp_path / "b").write_text("x,y,z,size,r,g,b,opacity\n1,2,3\n")
    with pytest.raises(bg.SceneError, match="b: must hold 8 numbers a line"):
        bg.load("b")


@pytest.mark.usefixtures("example")
def test_commands_take_it_and_list_it(capsys):
    bg.save(still_life_of(1000), "a.ply")
    assert main(["prune", "a.ply", "-o", "a.csv", "--quiet"]) == 0
    assert main(["info", "a.csv"]) == 0
    assert "comma-separated text" in capsys.readouterr().out
    with pytest.raises(SystemExit) as end:
        main(["info", "--formats"])
    assert not end.value.code
    assert "scene   read, written  .csv" in capsys.readouterr().out


@pytest.mark.usefixtures("example")
def test_a_look_of_another_package_has_a_name(capsys):
    assert bg.Look.open("dusk").config.light.lamp is not None
    assert main(["looks"]) == 0
    assert "dusk" in capsys.readouterr().out
    Path("mine.toml").write_text('base = "dusk"\n')
    assert bg.Look.open("mine.toml").values == bg.Look.open("dusk").values
    with pytest.raises(bg.SceneError, match=r"which are oil, .*, plain, dusk; did you mean 'dusk'\?"):
        bg.Look.open("dusc")


CANNOT = [("no_such_package:A", "No module named"), ("json:dumps", "not iterable"), ("os:sep", "must be a")]


@pytest.mark.parametrize(("value", "why"), CANNOT)
def test_what_cannot_be_used_is_named_and_passed_over(tmp_path, monkeypatch, value, why):
    install(tmp_path / "site", {"brushgs.formats": {"bad": value}})
    monkeypatch.syspath_prepend(tmp_path / "site")
    (tmp_path / "a").write_bytes(b"nothing of any format")
    with pytest.warns(bg.SceneWarning, match=f"'bad' of brushgs.formats cannot be used.*{why}"):
        refuse(tmp_path / "a", "is of no scene format that is read")
