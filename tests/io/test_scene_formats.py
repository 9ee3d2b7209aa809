"""The table of scene formats: one line there, and a format is read, written, and named in messages."""

import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene, registry
from brushgs.formats.format import Format, begins_with, has_suffix
from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.formats.scenes.stored import Stored
from tests.scenes import still_life_of


def open_toy(path: Path) -> SceneFile:
    """A format of its own: "TOY" and one byte a Gaussian; the first Gaussian has a NaN."""
    stored = path / "toy" if path.is_dir() else path
    count = len(stored.read_bytes()) - 3

    def decode(start: int, stop: int, out: Columns) -> None:
        for column in vars(out).values():
            if column is not None:
                column[:] = 0
        out.means[:, 0], out.quats[:, 0] = np.arange(start, stop), 1
        out.means[: start == 0, 1] = np.nan

    rows = RowSource(count, 1, lambda: nullcontext(decode), block_rows=10, is_logit=True)
    return SceneFile(path, "toy", count, 1, lambda: rows)


def write_toy(gaussians: bg.Gaussians, path: Path, known: Stored) -> None:
    Path(path).write_bytes(b"TOY" + b"." * len(gaussians))


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """One more format."""

    def matches(path: Path, begin: bytes) -> bool:
        return begin.startswith(b"TOY") or (path / "toy").is_file()

    row = Format("toy scene", "scene", (".toy",), matches, open_toy, write_toy)
    monkeypatch.setattr(registry, "_plugged", lambda: (row,))


@pytest.mark.usefixtures("toy")
def test_a_format_of_the_table_is_written_and_read_by_content(tmp_path):
    bg.save(still_life_of(1000), tmp_path / "a.toy")
    (tmp_path / "a.toy").rename(tmp_path / "a.ply")
    with pytest.warns(bg.SceneWarning, match=r"a\.ply: 1 of \d+ rows were dropped: .*row 0, y = nan"):
        gaussians, notes = read_scene(tmp_path / "a.ply")
    assert (notes.format, notes.rows_dropped, len(gaussians)) == ("toy", 1, notes.rows_read - 1)


@pytest.mark.usefixtures("toy")
def test_an_encoding_is_refused_where_the_format_fixes_it(tmp_path):
    (tmp_path / "toy").write_bytes(b"TOY...")
    with pytest.raises(bg.SceneError, match="is a toy, whose encoding is fixed; omit the encoding"):
        bg.load(tmp_path, Encoding(scales="linear"))


def test_a_format_is_recognised_by_first_bytes_or_by_suffix():
    assert begins_with(b"ab", b"cd")(Path("x"), b"cde")
    assert not begins_with(b"ab", b"cd")(Path("x.ab"), b"")
    assert has_suffix(".splat")(Path("a.SPLAT"), b"anything")


def test_the_table_loads_nothing_heavy():
    """Help texts read it before anything else is loaded."""
    code = "import brushgs.formats.registry, sys; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"numpy", "dataclasses", "OpenImageIO", "av", "hashlib"} & set(found.split())


def test_the_readme_names_every_format_of_scenes():
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    for row in (*registry.SCENE_FORMATS, *registry.MOVING_FORMATS):
        own = [suffix for suffix in row.suffixes if suffix not in (".json", ".ftgs.ply")]
        for suffix in own:
            assert f"`{suffix}`" in readme or f"{suffix}`" in readme, f"{row.name}: {suffix}"
