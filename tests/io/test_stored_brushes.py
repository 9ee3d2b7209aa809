"""The brushes of strokes in a PLY file: a column of bytes, and their names in the header."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.scenes.write import write_scene
from tests.io.test_write_ply import make

NAMES = ("flat", "flat_2", "/brushes/Käfer, \N{KOALA}.png")


def strokes_of(num=300, *, terms=4, count=3, dtype=np.float32):
    brushes = np.random.default_rng(num).integers(0, count, num).astype(np.uint8)
    return replace(make(num, terms, dtype=dtype), brushes=brushes)


def test_rows_that_are_dropped_take_their_brushes_with_them(tmp_path):
    strokes = strokes_of()
    path = tmp_path / "a.ply"
    write_scene(strokes, path, brushes=NAMES)
    begin, rows = path.read_bytes().split(b"end_header\n", 1)
    table = np.frombuffer(rows, np.uint8).reshape(300, -1).copy()
    table[[3, 70], :4] = np.frombuffer(np.float32(np.nan).tobytes(), np.uint8)
    path.write_bytes(begin + b"end_header\n" + table.tobytes())
    with pytest.warns(bg.SceneWarning, match="2 of 300 rows were dropped"):
        read = bg.load(path)
    np.testing.assert_array_equal(read.brushes, np.delete(strokes.brushes, [3, 70]))


def test_brushes_that_the_header_does_not_name_are_dropped_and_told(tmp_path):
    path = tmp_path / "a.ply"
    write_scene(strokes_of(), path, brushes=NAMES)
    path.write_bytes(path.read_bytes().replace(b'"flat","flat_2",', b'"flat, flat__2",'))
    with pytest.warns(bg.SceneWarning, match="have brush 2 and the header names 2; brushes are dropped"):
        read, _ = read_scene(path)
    assert read.brushes is None
    with pytest.raises(ValueError, match=r"^save: brushes must be rows of the 2 that are named, got 2"):
        write_scene(strokes_of(), tmp_path / "b.ply", brushes=NAMES[:2])
    with pytest.raises(ValueError, match=r"^save: names of brushes must take at most 65,536 characters"):
        write_scene(strokes_of(), tmp_path / "b.ply", brushes=["a" * 30_000] * 3)
    assert not (tmp_path / "b.ply").exists()


def test_several_files_are_painted_with_one_set_of_brushes(tmp_path):
    paths = [tmp_path / "a.ply", tmp_path / "b.ply"]
    for path in paths:
        write_scene(strokes_of(), path, is_strokes=True, brushes=NAMES)
    with pytest.warns(bg.SceneWarning, match=r"a\.ply: the brushes of its strokes are dropped"):
        read, notes = read_scene(paths)
    assert (len(read), read.brushes, notes.brushes) == (600, None, ())
