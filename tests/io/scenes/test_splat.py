"""What .splat files alone have: they are known by plausible rows."""

import struct

import numpy as np

from brushgs.formats import load
from tests.io.ply_maker import scene_columns, write_scene
from tests.io.scenes import splat_format as splat
from tests.io.scenes.witness import as_gaussforge_reads, assert_alike, convert
from tests.kit.for_each import for_each
from tests.kit.refused import refuse_bytes


@for_each(
    "place, bad", [(0, struct.pack("<f", np.nan)), (12, struct.pack("<f", -1)), (28, b"\0\0\0\0")]
)  # a position, a scale, a rotation of twice the length
def test_a_file_of_another_name_and_implausible_rows_is_not_taken(tmp_path, place, bad):
    data = splat.encode(splat.make(300))
    start = 32 * 150 + place
    content = data[:start] + bad + data[start + 4 :]
    refuse_bytes(tmp_path / "a.bin", content, "is of no scene format that is read")


def test_what_gaussforge_writes_is_read_as_it_does(tmp_path):
    data = convert(write_scene(tmp_path / "a.ply", scene_columns(200)).read_bytes(), "ply", "splat")
    (tmp_path / "a.splat").write_bytes(data)
    assert_alike(load(tmp_path / "a.splat"), as_gaussforge_reads(data, "splat", tmp_path))
