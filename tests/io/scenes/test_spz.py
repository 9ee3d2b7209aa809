"""What SPZ files alone have: flags, extensions, versions; `test_contract` has the rest."""

import gzip
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import zstandard

from brushgs import SceneWarning
from brushgs.formats import load, read_scene
from brushgs.values.sh import sh_basis
from tests.io.scenes import spz_format as spz
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes
from tests.passes.scenes import covariances

VERSIONS = (1, 2, 3, 4)


def read(folder, *args, **options):
    (folder / "a.spz").write_bytes(spz.encode(*args, **options))
    return read_scene(folder / "a.spz")


@for_each("version", [2, 4])
def test_degree_4_is_named_as_not_read(tmp_path, version):
    scene = spz.make(60, 4)
    gaussians, notes = read(tmp_path, scene, version)
    assert notes.unknown == ("spherical harmonics of degree 4",)
    assert notes.sh_degree_stored == 3
    np.testing.assert_allclose(gaussians.sh[:, 1:], scene["rest"][:, :15], atol=0.5 / 128 + 1e-6)


@for_each("version", VERSIONS)
def test_an_antialiased_scene_is_told_by_its_flag(tmp_path, version):
    assert read(tmp_path, spz.make(3), version, flags=spz.ANTIALIASED)[1].training == "antialiased"


# What the axes of each coordinate system point to, from its name.
SYSTEMS = [x + y + z for z in "BF" for y in "DU" for x in "LR"]
SYSTEMS += [x + y + z for y in "FB" for z in "DU" for x in "LR"]
DIRECTIONS = dict(zip("RUB", np.eye(3), strict=True)) | dict(zip("LDF", -np.eye(3), strict=True))


@for_each("version", [3, 4])
@for_each("number", range(17))
def test_a_coordinate_system_states_up_and_is_not_mirrored(tmp_path, number, version):
    """The Gaussians, turned from the axes of the file to right-up-back, are the same in every system."""
    axes = np.array([DIRECTIONS[letter] for letter in (SYSTEMS[number - 1] if number else "RUB")])
    scene = spz.make(40, 3)
    plain, _ = read(tmp_path, scene, version)
    system = spz.record(spz.COORDINATE_SYSTEM, struct.pack("<I", number))
    gaussians, notes = read(tmp_path, scene, version, extensions=system)
    up = next(f"{'+' if axes[i, 1] > 0 else '-'}{'xyz'[i]}" for i in range(3) if axes[i, 1])
    assert notes.up == (up if number else None)
    turned = np.diag([np.linalg.det(axes), 1, 1])
    np.testing.assert_allclose(gaussians.means, plain.means @ turned, atol=1e-6)
    expected = turned @ covariances(plain) @ turned
    atol = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(covariances(gaussians), expected, rtol=1e-4, atol=atol)
    directions = np.random.default_rng(7).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen, expected = (sh_basis(toward, 3) for toward in (directions @ turned, directions))
    np.testing.assert_allclose(seen @ gaussians.sh, expected @ plain.sh, atol=1e-5)


def test_extensions_that_are_not_read_are_named_once(tmp_path):
    records = spz.record(0xADBE0002, b"\0" * 12) * 2 + spz.record(0x12345678, b"")
    for version in (2, 4):
        notes = read(tmp_path, spz.make(3), version, extensions=records)[1]
        assert notes.unknown == ("extension 0xADBE0002", "extension 0x12345678")


LONG = struct.pack("<II", 5, 999) + b"abc"


@for_each("version", [2, 4])
@for_each(
    "records, sentence",
    [
        (LONG, "is damaged: extension 0x00000005 has 999 bytes where 3 are left"),
        (spz.record(spz.COORDINATE_SYSTEM, b"\x11\0\0\0"), "must be a number from 0 to 16, got 17"),
        (spz.record(spz.COORDINATE_SYSTEM, b"\4"), "the coordinate system must be a number"),
    ],
)
def test_a_damaged_extension_is_refused(tmp_path, version, records, sentence):
    refuse_bytes(tmp_path / "a.spz", spz.encode(spz.make(3), version, extensions=records), sentence)


PLACES = {"version": (4, 4), "count": (8, 4), "degree": (12, 1), "bits": (13, 1), "flags": (14, 1)}
PLACES |= {"streams": (15, 1), "table": (16, 4)}
FAULTS = [
    ("version", 0, VERSIONS, "must have a version from 1 to 4, got 0; export it as PLY"),
    ("version", 2**32 - 1, VERSIONS, "must have a version from 1 to 4, got 4294967295"),
    ("count", 0, VERSIONS, "holds no Gaussians"),
    ("count", 2**32 - 1, VERSIONS, "4294967295 Gaussians take .* MiB in memory and 0 MiB in the file"),
    ("degree", 5, VERSIONS, "must have a degree from 0 to 4, got 5"),
    ("bits", 200, VERSIONS, "must have at most 24 fractional bits, got 200"),
    # As Spark writes them: the Gaussians of all levels together would be painted over one another.
    ("flags", 0x80, [3], "export .* without levels of detail"),
    ("count", 10, [4], r"stream 0 must hold 90 bytes for 10 Gaussians, got 81"),
    ("degree", 1, [4], "must have 6 streams for degree 1, got 5"),
    ("streams", 200, [4], "must have 5 streams for degree 0, got 200"),
    ("table", 31, [4], "its table of contents is said to begin at byte 31 of"),
    ("table", 2**32 - 1, [4], "its table of contents is said to begin at byte 4294967295 of"),
]


@for_each("field, value, versions, sentence", FAULTS)
def test_a_bad_header_is_refused(tmp_path, field, value, versions, sentence):
    start, size = PLACES[field]
    for version in versions:
        content = bytearray(spz.encode(spz.make(9), version, packed=False))
        content[start : start + size] = value.to_bytes(size, "little")
        packed = content if version == 4 else gzip.compress(content)
        refuse_bytes(tmp_path / "a.spz", bytes(packed), sentence)


def test_damaged_packing_is_refused(tmp_path):
    path, data = tmp_path / "a.spz", bytearray(spz.encode(spz.make(9), 3))
    data[-6] ^= 1  # in the checksum
    refuse_bytes(path, data, r"cannot be decompressed \(.*\); it is damaged: copy or download it again")
    refuse_bytes(path, b"\x1f\x8bnot gzip at all", "cannot be decompressed")
    data, start = spz.encode(spz.make(9), 4), 32 + 5 * 16
    refuse_bytes(path, data[:start] + b"\0" * 4 + data[start + 4 :], "cannot be decompressed")
    huge = zstandard.ZstdCompressor().compress(b"\0" * (1 << 20))
    length = struct.unpack_from("<Q", data, 32)[0]
    swapped = data[:32] + struct.pack("<Q", len(huge)) + data[40:start] + huge + data[start + length :]
    refuse_bytes(path, swapped, "a stream of 81 bytes is said to hold 1048576")


@for_each(
    "content, sentence",
    [
        (b"ply\nformat", "is gzip data that holds a PLY file; unpack it first"),
        (spz.encode(spz.make(9), 4), "of version 4 within gzip data; unpack it"),
        (b"some text of no format", "is gzip data that holds no SPZ scene: it beg"),
    ],
)
def test_gzip_data_of_another_kind_is_named(tmp_path, content, sentence):
    refuse_bytes(tmp_path / "a.spz", gzip.compress(content), sentence)


@for_each("version", VERSIONS)
def test_trailing_bytes_are_ignored_with_a_warning(tmp_path, version):
    data, path = spz.encode(spz.make(9), version), tmp_path / "a.spz"
    within = [gzip.compress(gzip.decompress(data) + b"abc")] if version < 4 else []
    for content in (data + b"abc", *within):
        path.write_bytes(content)
        with pytest.warns(SceneWarning, match="a.spz: 3 bytes after the last Gaussian were ignored"):
            assert len(load(path)) == 9


def test_gzip_data_is_not_inflated_beyond_what_the_header_needs(tmp_path):
    packer = zlib.compressobj(wbits=31)
    content = packer.compress(spz.encode(spz.make(9), 3, packed=False))
    (tmp_path / "a.spz").write_bytes(content + packer.compress(b"\0" * (100 << 20)) + packer.flush())
    tracemalloc.start()
    with pytest.warns(SceneWarning, match="bytes after the last Gaussian were ignored"):
        load(tmp_path / "a.spz")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 << 20
