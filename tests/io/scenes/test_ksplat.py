"""What .ksplat files alone have; `test_contract` has the rest."""

import struct

import numpy as np

from brushgs.formats import load, read_scene
from brushgs.formats.scenes.read import read_raw_parts
from tests.io.scenes import ksplat_format as ksplat
from tests.io.scenes.witness import as_gaussforge_reads, assert_alike
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes


def test_bands_that_are_zero_are_dropped(tmp_path):
    scene = ksplat.make(400, 3)
    scene["rest"][:, :, 3:] = 0
    (tmp_path / "a.ksplat").write_bytes(ksplat.encode([scene], 1))
    gaussians, notes = read_scene(tmp_path / "a.ksplat")
    assert (gaussians.sh_degree, notes.sh_degree_stored, notes.sh_degree_used) == (1, 3, 1)
    assert read_raw_parts(tmp_path / "a.ksplat")[0][0].sh.shape == (400, 16, 3)


@for_each(
    "place, form, value, sentence",
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
def test_a_bad_header_is_refused(tmp_path, place, form, value, sentence):
    content = bytearray(ksplat.encode([ksplat.make(100)], 1))
    struct.pack_into(form, content, place, value)
    refuse_bytes(tmp_path / "a.ksplat", bytes(content), sentence)


def test_gaussforge_reads_the_same_of_level_1_except_positions(tmp_path):
    """It takes stored offsets for signed numbers of 16 bits: some positions are off by a whole block."""
    data = ksplat.encode([ksplat.make(64)], 1)
    (tmp_path / "a.ksplat").write_bytes(data)
    actual, expected = load(tmp_path / "a.ksplat"), as_gaussforge_reads(data, "ksplat", tmp_path)
    assert_alike(actual, expected, "quats", "scales", "opacities", "sh")
    blocks = (actual.means - expected.means) / (ksplat.BLOCK * 65536 / 65534)
    np.testing.assert_allclose(blocks, np.round(blocks), atol=1e-5)
