"""The table of scene formats; `test_plugin` adds a line to it."""

import subprocess
import sys
from pathlib import Path

import pytest

import brushgs as bg
from brushgs.formats import registry
from brushgs.formats.format import begins_with, has_suffix
from tests.io.scenes import splat_format


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


def test_an_encoding_is_refused_that_is_unknown_or_where_the_format_fixes_it(tmp_path):
    (tmp_path / "a.splat").write_bytes(splat_format.encode(splat_format.make(3)))
    with pytest.raises(bg.SceneError, match="whose encoding is fixed; omit the encoding"):
        bg.load(tmp_path / "a.splat", bg.Encoding(scales="linear"))
    for name in ("scales", "opacities", "quats"):
        with pytest.raises(ValueError, match=f"Encoding: {name} must be one of .*, got 'odd'"):
            bg.Encoding(**{name: "odd"})
