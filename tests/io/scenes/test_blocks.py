"""Rows of a scene file a block at a time are those of the whole file."""

from collections.abc import Callable
from pathlib import Path
from warnings import catch_warnings, simplefilter

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.scenes import rows
from brushgs.formats.scenes.columns import Columns, Dropped
from brushgs.formats.scenes.open_file import open_file
from brushgs.formats.scenes.read import read_raw_parts
from brushgs.formats.scenes.rows import read_blocks, sample_rows
from tests.io import test_compressed_ply
from tests.io.ply_maker import scene_columns, write_scene
from tests.io.scenes import ksplat_format
from tests.kit.for_each import for_each

NUM = 700
NAMES = ("means", "quats", "scales", "opacities", "sh")


def saved(path: Path) -> Path:
    """A scene as brushgs writes it in the format of the suffix."""
    degree = 0 if path.suffix == ".splat" else 1
    with catch_warnings():
        simplefilter("ignore", bg.SceneWarning)  # .splat clips colors
        bg.save(bg.load(write_scene(path.parent / "from.ply", scene_columns(NUM, degree))), path)
    return path


def ksplat(path: Path) -> Path:
    scenes = [ksplat_format.make(NUM - 300, 1), ksplat_format.make(300, 1, seed=1)]
    path.write_bytes(ksplat_format.encode(scenes, 1))
    return path


FILES: dict[str, Callable[[Path], Path]] = {
    "scene.ply": saved,
    "ascii.ply": lambda path: write_scene(path, scene_columns(NUM, 1), "ascii"),
    "scene.compressed.ply": lambda path: test_compressed_ply.encode(path, test_compressed_ply.make(NUM, 1)),
    "scene.splat": saved,
    "scene.ksplat": ksplat,
    "scene.spz": saved,
    "scene.sog": saved,
}


def joined(path: Path, block_rows: int) -> tuple[Columns, Dropped]:
    """All blocks of a file behind each other."""
    file = open_file(path, None)
    parts, dropped = [], Dropped()
    for columns, some in read_blocks(file.open_rows(), 0, file.num_rows, block_rows):
        assert len(columns.means) + some.num_rows <= block_rows
        parts.append(columns)
        dropped.add(some)
    return Columns.joined(parts), dropped


@for_each("block_rows", [77, 256, 1000])
@for_each("name", FILES)
def test_blocks_are_the_rows_of_the_file(tmp_path, name, block_rows):
    path = FILES[name](tmp_path / name)
    whole, (blocks, dropped) = bg.load(path), joined(path, block_rows)
    assert dropped.num_rows == 0
    for column in NAMES:
        expected, actual = getattr(whole, column), getattr(blocks, column)
        if column == "sh":  # bands that are zero are not dropped here
            assert not actual[:, expected.shape[1] :].any()
            actual = actual[:, : expected.shape[1]]
        # Where all rows are decoded at once, opacities pass through their logits.
        np.testing.assert_allclose(actual, expected, rtol=1e-5, atol=1e-7, err_msg=column)


def test_a_file_that_is_cut_off_is_refused_before_the_first_block(tmp_path):
    path = write_scene(tmp_path / "a.ply", scene_columns(NUM))
    file = open_file(path, None)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(bg.SceneError, match="cut off"):
        open_file(path, None).open_rows()
    with pytest.raises(bg.SceneError, match="became shorter while it was read"):
        list(read_blocks(file.open_rows(), 0, NUM))


def test_a_sample_is_spread_over_the_whole_file(tmp_path):
    columns = scene_columns(20_000)
    columns["x"][:] = np.arange(20_000)
    rows = open_file(write_scene(tmp_path / "a.ply", columns), None).open_rows()
    sample = sample_rows(rows, 8192).means[:, 0]
    assert len(sample) == 8192
    assert (sample[0], sample[-1]) == (0, 19_999)
    assert len(sample_rows(rows, 1 << 30).means) >= 20_000


@pytest.mark.parametrize("name", [*FILES, "scene.glb"])
def test_raw_rows_are_log_scales_and_logits_of_what_any_number_of_threads_reads(tmp_path, name, monkeypatch):
    monkeypatch.setitem(globals(), "NUM", 5000)  # more than a block of any decoder
    path = FILES.get(name, saved)(tmp_path / name)
    read = []
    for num_threads in (1, 3):
        monkeypatch.setattr(rows, "_count_threads", lambda _, count=num_threads: count)
        read.append(bg.load(path))
    for column in NAMES:
        np.testing.assert_array_equal(*(getattr(one, column) for one in read), err_msg=column)
    ((raw, file),) = read_raw_parts(path)
    assert (len(raw.means), file.num_terms) == (len(read[0]), raw.sh.shape[1])
    opacities = read[0].opacities.astype(np.float64)
    with np.errstate(divide="ignore"):
        logits = np.log(opacities) - np.log1p(-opacities)
        sizes = np.log(read[0].scales)
    np.testing.assert_allclose(raw.scales, sizes, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(raw.opacities, logits, rtol=2e-5, atol=2e-5)
