import gzip
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
import zstandard

from brushgs import Gaussians, SceneWarning
from brushgs.formats import load, read_scene
from brushgs.values.sh import sh_basis
from tests.io.scenes import spz_format as spz
from tests.io.scenes.witness import NAMES, as_gaussforge_reads, assert_alike
from tests.kit.refused import refuse

VERSIONS = (1, 2, 3, 4)
DEGREES = (0, 1, 2, 3)


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def columns_of(scene: spz.Scene) -> dict[str, np.ndarray]:
    """Values as the reader returns them."""
    sh0, rest = np.array(scene["sh0"]), np.array(scene["rest"])
    return {
        "means": np.array(scene["means"]),
        "quats": np.array(scene["quats"]),
        "scales": np.exp(scene["log_scales"]),
        "opacities": np.array(scene["opacities"]),
        "sh": np.concatenate([sh0[:, None], rest.reshape(len(sh0), -1, 3)], axis=1),
    }


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("degree", DEGREES)
def test_a_file_equals_a_decode_row_by_row_of_the_specification(
    tmp_path: Path, version: int, degree: int
) -> None:
    data = spz.encode(spz.make(300, degree), version)
    gaussians, notes = read_scene(write(tmp_path / "a.spz", data))
    for name, expected in columns_of(spz.decode(data)).items():
        np.testing.assert_allclose(getattr(gaussians, name), expected, rtol=1e-6, atol=3e-7, err_msg=name)
    assert (notes.format, notes.rows_read) == (f"SPZ, version {version}", 300)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (degree, degree)
    assert (notes.up, notes.training, notes.unknown) == (None, "default", ())


@pytest.mark.parametrize("version", VERSIONS)
def test_the_ends_of_opacities_are_exact_and_positions_are_signed(tmp_path: Path, version: int) -> None:
    scene = spz.make(2)
    scene["opacities"] = np.array([0.0, 1.0])
    scene["means"] = np.array([[-1.5, 2.0, -0.25], [0.0, -2.0, 1.0]])
    gaussians = load(write(tmp_path / "a.spz", spz.encode(scene, version)))
    assert gaussians.opacities.tolist() == [0, 1]
    assert gaussians.means.tolist() == scene["means"].tolist()


@pytest.mark.parametrize("version", [1, 2, 3])
def test_early_versions_are_read_without_gzip_too(tmp_path: Path, version: int) -> None:
    scene = spz.make(20, 1)
    first, second = (
        load(write(tmp_path / "a.spz", spz.encode(scene, version, packed=packed))) for packed in (True, False)
    )
    assert_equal(first, second)


def assert_equal(first: Gaussians, second: Gaussians) -> None:
    for name in NAMES:
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=name)


@pytest.mark.parametrize("version", [2, 3, 4])
def test_degree_4_is_named_as_not_read(tmp_path: Path, version: int) -> None:
    scene = spz.make(60, 4)
    gaussians, notes = read_scene(write(tmp_path / "a.spz", spz.encode(scene, version)))
    assert notes.unknown == ("spherical harmonics of degree 4",)
    assert notes.sh_degree_stored == 3
    np.testing.assert_allclose(gaussians.sh[:, 1:], scene["rest"][:, :15], atol=0.5 / 128 + 1e-6)


@pytest.mark.parametrize("version", VERSIONS)
def test_an_antialiased_scene_is_told_by_its_flag(tmp_path: Path, version: int) -> None:
    data = spz.encode(spz.make(3), version, flags=spz.ANTIALIASED)
    assert read_scene(write(tmp_path / "a.spz", data))[1].training == "antialiased"


# Extensions. What the axes of each coordinate system point to, from its name.
SYSTEMS = (
    *("LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF"),
    *("LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"),
)
DIRECTIONS = {
    "R": (1, 0, 0),
    "U": (0, 1, 0),
    "B": (0, 0, 1),
    "L": (-1, 0, 0),
    "D": (0, -1, 0),
    "F": (0, 0, -1),
}


@pytest.mark.parametrize("version", [3, 4])
@pytest.mark.parametrize("number", range(17))
def test_a_coordinate_system_states_up_and_is_not_mirrored(tmp_path: Path, number: int, version: int) -> None:
    """The Gaussians, turned from the axes of the file to right-up-back, are the same in every system."""
    name = SYSTEMS[number - 1] if number else "RUB"
    axes = np.array([DIRECTIONS[letter] for letter in name], float)
    is_mirrored = np.linalg.det(axes) < 0
    scene = spz.make(40, 3)
    plain = columns_of(spz.decode(spz.encode(scene, version)))
    data = spz.encode(scene, version, extensions=spz.record(spz.COORDINATE_SYSTEM, struct.pack("<I", number)))
    gaussians, notes = read_scene(write(tmp_path / "a.spz", data))
    up = next(f"{'+' if axes[i, 1] > 0 else '-'}{'xyz'[i]}" for i in range(3) if axes[i, 1])
    assert notes.up == (up if number else None)
    turned = np.diag([-1.0 if is_mirrored else 1.0, 1, 1])
    np.testing.assert_allclose(gaussians.means, plain["means"] @ turned, atol=1e-6)
    expected = turned @ covariances(plain["quats"], plain["scales"]) @ turned
    actual = covariances(gaussians.quats, gaussians.scales)
    np.testing.assert_allclose(actual, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
    directions = np.random.default_rng(7).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = np.einsum("dk,nkc->dnc", sh_basis(directions @ turned, 3), gaussians.sh)
    np.testing.assert_allclose(
        seen, np.einsum("dk,nkc->dnc", sh_basis(directions, 3), plain["sh"]), atol=1e-5
    )


def covariances(quats: np.ndarray, scales: np.ndarray) -> np.ndarray:
    w, x, y, z = np.asarray(quats, float).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix = np.moveaxis(np.array(rows), 2, 0) * np.asarray(scales, float)[:, None]
    return matrix @ matrix.transpose(0, 2, 1)


@pytest.mark.parametrize("version", [2, 4])
def test_extensions_that_are_not_read_are_named_once(tmp_path: Path, version: int) -> None:
    records = spz.record(0xADBE0002, b"\0" * 12) * 2 + spz.record(0x12345678, b"")
    _, notes = read_scene(write(tmp_path / "a.spz", spz.encode(spz.make(3), version, extensions=records)))
    assert notes.unknown == ("extension 0xADBE0002", "extension 0x12345678")


@pytest.mark.parametrize("version", [2, 4])
@pytest.mark.parametrize(
    ("records", "sentence"),
    [
        (
            struct.pack("<II", 5, 999) + b"abc",
            "is damaged: extension 0x00000005 has 999 bytes where 3 are left",
        ),
        (spz.record(spz.COORDINATE_SYSTEM, b"\x11\0\0\0"), "must be a number from 0 to 16, got 17"),
        (spz.record(spz.COORDINATE_SYSTEM, b"\4"), "the coordinate system must be a number"),
    ],
)
def test_a_damaged_extension_is_refused(tmp_path: Path, version: int, records: bytes, sentence: str) -> None:
    refuse_bytes(tmp_path, spz.encode(spz.make(3), version, extensions=records), sentence)


# Damage.
def refuse_bytes(folder: Path, data: bytes, sentence: str) -> None:
    refuse(write(folder / "a.spz", data), sentence)


def header(data: bytes, **fields: int) -> bytes:
    """The same file with other numbers in its header."""
    places = {"version": (4, 4), "count": (8, 4), "degree": (12, 1), "bits": (13, 1), "flags": (14, 1)}
    places |= {"streams": (15, 1), "table": (16, 4)}
    is_packed = data[:2] == b"\x1f\x8b"
    content = bytearray(gzip.decompress(data) if is_packed else data)
    for name, value in fields.items():
        start, size = places[name]
        content[start : start + size] = value.to_bytes(size, "little")
    return gzip.compress(bytes(content)) if is_packed else bytes(content)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"version": 0}, "must have a version from 1 to 4, got 0; export it as PLY"),
        ({"version": 2**32 - 1}, "must have a version from 1 to 4, got 4294967295"),
        ({"count": 0}, "holds no Gaussians"),
        ({"count": 2**32 - 1}, "4294967295 Gaussians take .* MiB in memory and 0 MiB in the file"),
        ({"degree": 5}, "must have a degree from 0 to 4, got 5"),
        ({"bits": 200}, "must have at most 24 fractional bits, got 200"),
    ],
)
def test_a_bad_header_is_refused(tmp_path: Path, version: int, fields: dict[str, int], sentence: str) -> None:
    refuse_bytes(tmp_path, header(spz.encode(spz.make(9), version), **fields), sentence)


def test_a_tree_of_levels_is_refused(tmp_path: Path) -> None:
    """As Spark writes them: the Gaussians of all levels together would be painted over one another."""
    refuse_bytes(
        tmp_path, header(spz.encode(spz.make(9), 3), flags=0x80), "export .* without levels of detail"
    )


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"count": 10}, r"stream 0 must hold 90 bytes for 10 Gaussians, got 81"),
        ({"degree": 1}, "must have 6 streams for degree 1, got 5"),
        ({"streams": 200}, "must have 5 streams for degree 0, got 200"),
        ({"table": 31}, "its table of contents is said to begin at byte 31 of"),
        ({"table": 2**32 - 1}, "its table of contents is said to begin at byte 4294967295 of"),
    ],
)
def test_a_bad_header_of_version_4_is_refused(tmp_path: Path, fields: dict[str, int], sentence: str) -> None:
    refuse_bytes(tmp_path, header(spz.encode(spz.make(9), 4), **fields), sentence)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("degree", [0, 1])
def test_a_file_cut_off_anywhere_is_refused(tmp_path: Path, version: int, degree: int) -> None:
    data = spz.encode(spz.make(9, degree), version)
    for size in (*range(4, 40), *range(40, len(data), 11), len(data) - 1):
        refuse_bytes(tmp_path, data[:size], "is cut off|cannot be decompressed")


def test_damaged_gzip_data_is_refused(tmp_path: Path) -> None:
    data = bytearray(spz.encode(spz.make(9), 3))
    data[-6] ^= 1  # in the checksum
    refuse_bytes(
        tmp_path, bytes(data), r"cannot be decompressed \(.*\); it is damaged: copy or download it again"
    )
    refuse_bytes(tmp_path, b"\x1f\x8bnot gzip at all", "cannot be decompressed")


def test_a_stream_that_is_no_zstd_or_states_another_size_is_refused(tmp_path: Path) -> None:
    data = spz.encode(spz.make(9), 4)
    start = 32 + 5 * 16
    refuse_bytes(tmp_path, data[:start] + b"\0" * 4 + data[start + 4 :], "cannot be decompressed")
    huge = zstandard.ZstdCompressor().compress(b"\0" * (1 << 20))
    length = struct.unpack_from("<Q", data, 32)[0]
    swapped = data[:32] + struct.pack("<Q", len(huge)) + data[40:start] + huge + data[start + length :]
    refuse_bytes(tmp_path, swapped, "a stream of 81 bytes is said to hold 1048576")


def test_gzip_data_of_another_kind_is_named(tmp_path: Path) -> None:
    refuse_bytes(
        tmp_path, gzip.compress(b"ply\nformat"), "is gzip data that holds a PLY file; unpack it first"
    )
    refuse_bytes(
        tmp_path, gzip.compress(spz.encode(spz.make(9), 4)), "of version 4 within gzip data; unpack it"
    )
    refuse_bytes(
        tmp_path, gzip.compress(b"some text of no format"), "is gzip data that holds no SPZ scene: it beg"
    )


@pytest.mark.parametrize("version", VERSIONS)
def test_trailing_bytes_are_ignored_with_a_warning(tmp_path: Path, version: int) -> None:
    data = spz.encode(spz.make(9), version)
    with pytest.warns(SceneWarning, match="a.spz: 3 bytes after the last Gaussian were ignored"):
        assert len(load(write(tmp_path / "a.spz", data + b"abc"))) == 9
    if version < 4:
        longer = gzip.compress(gzip.decompress(data) + b"abcd")
        with pytest.warns(SceneWarning, match="4 bytes after the last Gaussian were ignored"):
            assert len(load(write(tmp_path / "a.spz", longer))) == 9


def test_gzip_data_is_not_inflated_beyond_what_the_header_needs(tmp_path: Path) -> None:
    content = gzip.decompress(spz.encode(spz.make(9), 3))
    packer = zlib.compressobj(wbits=31)
    bomb = packer.compress(content) + packer.compress(b"\0" * (100 << 20)) + packer.flush()
    path = write(tmp_path / "a.spz", bomb)
    tracemalloc.start()
    with pytest.warns(SceneWarning, match="bytes after the last Gaussian were ignored"):
        load(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 << 20


# Outside witness, and a real scene.
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("degree", DEGREES)
def test_gaussforge_reads_the_same(tmp_path: Path, version: int, degree: int) -> None:
    data = spz.encode(spz.make(50, degree), version)
    expected = as_gaussforge_reads(data, "spz", tmp_path)
    assert_alike(load(write(tmp_path / "a.spz", data)), expected)
