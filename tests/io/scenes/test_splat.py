"""What .splat files alone have: they are known by plausible rows."""

import struct

import numpy as np

from tests.io.scenes import splat_format as splat
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes

BAD = {0: struct.pack("<f", np.nan), 12: struct.pack("<f", -1), 28: b"\0\0\0\0"}  # place, scale, rotation


@for_each("place, bad", BAD.items())
def test_a_file_of_another_name_and_implausible_rows_is_not_taken(tmp_path, place, bad):
    data = splat.encode(splat.make(300))
    start = 32 * 150 + place
    content = data[:start] + bad + data[start + 4 :]
    refuse_bytes(tmp_path / "a.bin", content, "is of no scene format that is read")
