import struct
from pathlib import Path

import numpy as np
import pytest

from brushgs import SceneError
from brushgs.formats import load, read_scene
from tests.io.ply_maker import scene_columns, write_scene
from tests.io.scenes import splat_format as splat
from tests.io.scenes.witness import as_gaussforge_reads, assert_alike, convert
from tests.scenes import real_scene


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_a_file_equals_a_decode_row_by_row(tmp_path: Path) -> None:
    data = splat.encode(splat.make(5000))
    gaussians, notes = read_scene(write(tmp_path / "a.splat", data))
    for name, expected in splat.decode(data).items():
        # Scales pass through their logarithms in float32.
        np.testing.assert_allclose(getattr(gaussians, name), expected, rtol=2e-6, atol=3e-7, err_msg=name)
    assert (notes.format, notes.rows_read, notes.sh_degree_stored) == (".splat", 5000, 0)


def test_the_ends_of_opacities_and_the_identity_are_exact(tmp_path: Path) -> None:
    scene = splat.make(2)
    scene["opacities"] = np.array([0.0, 1.0])
    scene["quats"] = np.array([[1.0, 0, 0, 0], [-1, 0, 0, 0]])
    gaussians = load(write(tmp_path / "a.splat", splat.encode(scene)))
    assert gaussians.opacities.tolist() == [0, 1]
    assert not gaussians.quats[:, 1:].any()
    assert gaussians.quats[1, 0] == -1


@pytest.mark.parametrize("place", [0, 12, 28])
def test_a_file_of_another_name_and_implausible_rows_is_not_taken(tmp_path: Path, place: int) -> None:
    """A position that is NaN, a negative scale, a rotation of twice the length."""
    data = bytearray(splat.encode(splat.make(300)))
    bad = {0: struct.pack("<f", np.nan), 12: struct.pack("<f", -1), 28: b"\0\0\0\0"}[place]
    start = 32 * 150 + place
    data[start : start + 4] = bad
    with pytest.raises(SceneError, match="is of no scene format that is read"):
        load(write(tmp_path / "a.bin", bytes(data)))


@pytest.mark.parametrize("size", [31, 33, 96 - 1])
def test_a_size_of_no_whole_rows_is_refused(tmp_path: Path, size: int) -> None:
    data = splat.encode(splat.make(3))[:size]
    sentence = (
        f"must be a multiple of 32, got {size}, {size % 32} more than whole Gaussians take; it is cut off"
    )
    with pytest.raises(SceneError, match=sentence):
        load(write(tmp_path / "a.splat", data))


def test_gaussforge_reads_and_writes_the_same(tmp_path: Path) -> None:
    data = convert(write_scene(tmp_path / "a.ply", scene_columns(200)).read_bytes(), "ply", "splat")
    path = write(tmp_path / "a.splat", data)
    assert_alike(load(path), as_gaussforge_reads(data, "splat", tmp_path))


@pytest.mark.parametrize(
    ("name", "num_rows"), [("truck.splat", 116544), ("chair.splat", 111650), ("plant.splat", 14007)]
)
def test_a_real_scene_is_known_by_its_content(name: str, num_rows: int, tmp_path: Path) -> None:
    link = tmp_path / "renamed"
    link.symlink_to(real_scene(name).resolve())
    assert len(load(link)) == num_rows
