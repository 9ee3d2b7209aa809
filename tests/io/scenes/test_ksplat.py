import struct
from pathlib import Path

import numpy as np
import pytest

from brushgs.formats import load, read_scene
from brushgs.formats.scenes.read import read_raw_parts
from tests.io.scenes import ksplat_format as ksplat
from tests.io.scenes.witness import as_gaussforge_reads, assert_alike
from tests.kit.refused import refuse

LEVELS = (0, 1, 2)
DEGREES = (0, 1, 2, 3)


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def check(path: Path, data: bytes) -> None:
    """What is read equals the decode row by row."""
    gaussians = load(write(path, data))
    for name, expected in ksplat.decode(data).items():
        actual = getattr(gaussians, name)
        # Scales pass through their logarithms in float32.
        np.testing.assert_allclose(actual, expected, rtol=2e-6, atol=3e-7, err_msg=name)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("degree", DEGREES)
def test_a_file_equals_a_decode_row_by_row(tmp_path: Path, level: int, degree: int) -> None:
    data = ksplat.encode([ksplat.make(300, degree)], level)
    check(tmp_path / "a.ksplat", data)
    notes = read_scene(tmp_path / "a.ksplat")[1]
    assert (notes.format, notes.rows_read) == (f".ksplat, compression level {level}", 300)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (degree, degree)


@pytest.mark.parametrize("level", LEVELS)
def test_sections_may_differ_in_degree_and_have_room_to_spare(tmp_path: Path, level: int) -> None:
    scenes = [ksplat.make(count, degree, seed=count) for count, degree in ((5, 1), (100, 2), (37, 0), (1, 1))]
    check(tmp_path / "a.ksplat", ksplat.encode(scenes, level, room=3, num_sections=6))


@pytest.mark.parametrize("level", [1, 2])
@pytest.mark.parametrize("partial", [(), (1, 5, 14), (15,), (4, 0, 0, 16), (20,)])
def test_the_last_buckets_are_partly_filled(tmp_path: Path, level: int, partial: tuple[int, ...]) -> None:
    data = ksplat.encode([ksplat.make(16 * 3 + sum(partial), 1)], level, partial=partial)
    check(tmp_path / "a.ksplat", data)


@pytest.mark.parametrize("level", [1, 2])
def test_another_range_of_offsets(tmp_path: Path, level: int) -> None:
    check(tmp_path / "a.ksplat", ksplat.encode([ksplat.make(50)], level, offsets=1000))


def test_a_range_of_0_means_the_usual_coefficients(tmp_path: Path) -> None:
    data = ksplat.encode([ksplat.make(50, 2)], 2, limits=(-1.5, 1.5))
    assert struct.unpack_from("<2f", data, 36) == (0, 0)
    check(tmp_path / "a.ksplat", data)


@pytest.mark.parametrize("level", [0, 1])
def test_bands_that_are_zero_are_dropped(tmp_path: Path, level: int) -> None:
    scene = ksplat.make(400, 3)
    scene["rest"][:, :, 3:] = 0
    gaussians, notes = read_scene(write(tmp_path / "a.ksplat", ksplat.encode([scene], level)))
    assert (gaussians.sh_degree, notes.sh_degree_stored, notes.sh_degree_used) == (1, 3, 1)
    assert read_raw_parts(tmp_path / "a.ksplat")[0][0].sh.shape == (400, 16, 3)


def patched(data: bytes, place: int, form: str, value: float) -> bytes:
    changed = bytearray(data)
    struct.pack_into(form, changed, place, value)
    return bytes(changed)


@pytest.mark.parametrize(
    ("place", "form", "value", "sentence"),
    [
        (0, "<H", 0x0201, "is a .ksplat scene that must have version 0.1, got 1.2; convert it"),
        (16, "<I", 2**32 - 1, "must count the 100 Gaussians of its sections, got 4294967295; it is damaged"),
        (20, "<H", 3, "the compression level must be 0 to 2, got 3"),
        (4096, "<I", 2**32 - 1, "section 0 is said to have 4294967295 Gaussians in the room of 100"),
        (4096, "<I", 0, "holds no Gaussians: its sections are empty"),
        (4104, "<I", 1, "section 0 is said to have 100 Gaussians in buckets for 10; copy"),
        (4108, "<I", 3, "section 0 is said to have 6 full and 1 other buckets of 3"),
        (4116, "<H", 16, "section 0 is said to have buckets of 16 bytes in place of 12"),
        (4136, "<H", 4, "section 0 is said to have spherical harmonics of degree 4"),
    ],
)
def test_a_bad_header_is_refused(tmp_path: Path, place: int, form: str, value: int, sentence: str) -> None:
    refuse(
        write(tmp_path / "a.ksplat", patched(ksplat.encode([ksplat.make(100)], 1), place, form, value)),
        sentence,
    )


@pytest.mark.parametrize("level", LEVELS)
def test_a_file_cut_off_is_refused(tmp_path: Path, level: int) -> None:
    data = ksplat.encode([ksplat.make(40, 1), ksplat.make(9)], level)
    for size in (1, 40, 4095, 4096, 5000, 6144, 6145, len(data) // 2 + 3200, len(data) - 1):
        refuse(write(tmp_path / "a.ksplat", data[:size]), f"is cut off: {size} bytes do not hold")


def test_gaussforge_reads_the_same_of_level_1_except_positions(tmp_path: Path) -> None:
    """It takes stored offsets for signed numbers of 16 bits: some positions are off by a whole block."""
    data = ksplat.encode([ksplat.make(64)], 1)
    actual = load(write(tmp_path / "a.ksplat", data))
    expected = as_gaussforge_reads(data, "ksplat", tmp_path)
    assert_alike(actual, expected, "quats", "scales", "opacities", "sh")
    blocks = (actual.means - expected.means) / (ksplat.BLOCK * 65536 / 65534)
    np.testing.assert_allclose(blocks, np.round(blocks), atol=1e-5)
