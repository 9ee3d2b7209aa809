"""splaTV files: their header, texture and ends; the one real clip."""

from brushgs.formats.moving import open_moving
from tests.io.moving import clips
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes


def test_every_cut_is_refused_in_a_sentence(tmp_path):
    """Each length that misses a Gaussian, but for the last row of the texture, whose end is not known."""
    data = clips.encode_splatv(clips.spacetime_columns(9))  # four a row of the texture: three rows
    for length in [4, 8, 20, *range(100, len(data) - 63, 37)]:
        refuse_bytes(tmp_path / "a.splatv", data[:length], "cut off", open_moving)
    sentence = "63 bytes are missing at least|last Gaussian is not complete"
    refuse_bytes(tmp_path / "a.splatv", data[:-1], sentence, open_moving)
    padding = data[: -9 * 64] + bytes(9 * 64)
    refuse_bytes(tmp_path / "a.splatv", padding, "holds no Gaussians; export it again", open_moving)


@for_each(
    "field, value, sentence",
    [
        ("size", "no number", r"header\[0\]\.size must be a whole number 0 to"),
        ("texwidth", -1, r"header\[0\]\.texwidth must be a whole number 0 to"),
        ("type", "mesh", "names no chunk of type 'splat'"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(field, value, sentence, tmp_path):
    content = clips.encode_splatv(clips.spacetime_columns(5), **{field: value})
    refuse_bytes(tmp_path / "a.splatv", content, sentence, open_moving)
