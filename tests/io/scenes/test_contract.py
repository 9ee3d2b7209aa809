"""Formats in all their variants against a decode that was written from their specifications."""

from functools import partial

import numpy as np
import pytest

from brushgs.formats import load, read_scene
from tests.io.scenes import ksplat_format, sog_maker, splat_format, spz_format
from tests.io.scenes.witness import as_gaussforge_reads, assert_alike
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes
from tests.scenes import real_scene


def splat():
    """Content, columns as they must be read, degree, and what the notes call the format."""
    data = splat_format.encode(splat_format.make(300))
    return data, splat_format.decode(data), 0, ".splat"


def ksplat(level, degree, num_rows=300, **options):
    return ksplat_of([ksplat_format.make(num_rows, degree)], level, degree, **options)


def ksplat_of(scenes, level, degree, **options):
    data = ksplat_format.encode(scenes, level, **options)
    return data, ksplat_format.decode(data), degree, f".ksplat, compression level {level}"


def spz(version, degree, **options):
    data = spz_format.encode(spz_format.make(300, degree), version, **options)
    return data, spz_format.decode(data), degree, f"SPZ, version {version}"


def sog(version, degree):
    scene = sog_maker.make(250, degree, version)
    expected = sog_maker.decode(scene, range(250))
    return sog_maker.zipped(sog_maker.files_of(scene)), expected, degree, f"SOG version {version}"


# Sections of .ksplat may differ in degree and have room to spare; the last buckets are partly filled.
SECTIONS = [ksplat_format.make(count, degree, count) for count, degree in ((5, 1), (100, 2), (37, 0), (1, 1))]
PARTIAL = ((1, 5, 14), (15,), (4, 0, 0, 16), (20,))
CASES = {
    "splat": splat,
    **{f"ksplat {level}, {n}": partial(ksplat, level, n) for level in range(3) for n in range(4)},
    **{f"ksplat {n}, sections": partial(ksplat_of, SECTIONS, n, 2, room=3, num_sections=6) for n in range(3)},
    **{
        f"ksplat {level}, {rows}": partial(ksplat, level, 1, 48 + sum(rows), partial=rows)
        for level in (1, 2)
        for rows in PARTIAL
    },
    **{f"ksplat {level}, range": partial(ksplat, level, 0, offsets=1000) for level in (1, 2)},
    "ksplat 2, usual coefficients": partial(ksplat, 2, 2, limits=(-1.5, 1.5)),  # stored as 0 to 0
    **{f"spz {version}, {n}": partial(spz, version, n) for version in range(1, 5) for n in range(4)},
    **{f"spz {version} without gzip": partial(spz, version, 1, packed=False) for version in range(1, 4)},
    **{f"sog {version}, {n}": partial(sog, version, n) for version in (1, 2) for n in range(4)},
}


@for_each("name", CASES)
def test_what_is_read_equals_a_decode_of_the_tests(tmp_path, name):
    data, expected, degree, form = CASES[name]()
    (tmp_path / f"a.{name.split()[0]}").write_bytes(data)
    gaussians, notes = read_scene(tmp_path / f"a.{name.split()[0]}")
    for column, values in expected.items():
        # Scales pass through their logarithms in float32.
        actual = getattr(gaussians, column)
        np.testing.assert_allclose(actual, values, rtol=2e-6, atol=3e-7, err_msg=column)
    for end in (0, 1):  # most opacities of a scene are 0 or 1
        np.testing.assert_array_equal(gaussians.opacities == end, expected["opacities"] == end)
    assert (notes.format, notes.rows_read, notes.rows_dropped) == (form, len(expected["means"]), 0)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (degree, degree)
    assert (notes.up, notes.training, notes.unknown) == (None, "default", ())


CUT = {
    "splat": "must be a multiple of 32, got .*; it is cut off",
    "ksplat": "is cut off: [0-9]+ bytes do not hold",
    "spz": "is cut off|cannot be decompressed",
    "sog": "is a damaged zip archive",
}


@for_each(
    "name", ["splat", "ksplat 1, 1", "ksplat 0, sections", "spz 1, 0", "spz 3, 1", "spz 4, 1", "sog 2, 1"]
)
def test_a_file_cut_off_anywhere_is_refused(tmp_path, name):
    content, kind = CASES[name]()[0], name.split()[0]
    sizes = {*range(4, 40, 5), *range(40, len(content), len(content) // 30 | 1), len(content) - 1}
    for size in (31, 33, 95) if kind == "splat" else sizes:
        refuse_bytes(tmp_path / f"a.{kind}", content[:size], CUT[kind])


WITNESSED = ["splat", *(name for name in CASES if name.startswith(("spz", "sog 2")) and "gzip" not in name)]


@for_each("name", [*WITNESSED, "skull.sog"])
def test_an_outside_library_reads_the_same(tmp_path, name):
    """Of SOG it takes e^|x| - 1 in float32, whose rounding is 1.2e-7 times e^|x|, up to 4.5."""
    content = real_scene(name).read_bytes() if name == "skull.sog" else CASES[name]()[0]
    kind = "sog" if "sog" in name else name.split()[0]
    (tmp_path / f"a.{kind}").write_bytes(content)
    actual, expected = load(tmp_path / f"a.{kind}"), as_gaussforge_reads(content, kind, tmp_path)
    if kind == "splat":  # of which it cuts off the ends of opacities at logits of 10
        rows = np.flatnonzero((actual.opacities > 0) & (actual.opacities < 1))
        actual, expected = actual.take(rows), expected.take(rows)
    assert_alike(actual, expected, atol=1e-6 if kind == "sog" else 5e-7)


@pytest.mark.parametrize(("name", "num_rows"), [("chair.splat", 111650), ("guitar.ksplat", None)])
def test_a_real_scene_is_known_by_its_content(name, num_rows, tmp_path):
    (tmp_path / "renamed").symlink_to(real_scene(name).resolve())
    scene = load(tmp_path / "renamed")
    assert len(scene) == (num_rows or len(load(real_scene(name))))
