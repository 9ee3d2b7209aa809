"""splaTV files: their header, texture and ends; the one real clip."""

import numpy as np

import brushgs as bg
from brushgs.formats.moving import open_moving
from tests.io.moving import clips
from tests.kit.for_each import for_each
from tests.kit.refused import refuse_bytes
from tests.scenes import real_scene


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


def test_the_real_clip_has_its_known_rows_and_equals_a_decode_of_the_format():
    path = real_scene("moving/cook_spinach.splatv")
    scene = bg.load_moving(path)
    assert (scene.notes.rows_read, scene.notes.rows_dropped) == (62442, 0)
    data = path.read_bytes()
    start = len(data) - 64 * 62442
    rows = [clips.SPLATV_ROW.unpack_from(data, start + 64 * row) for row in range(0, 62442, 499)]
    time = 0.37
    gaussians = scene.at(time * scene.duration)
    for index, row in enumerate(rows):
        since = time - row[-2]
        mean = [row[i] + sum(row[15 + 3 * k + i] * since ** (k + 1) for k in range(3)) for i in range(3)]
        np.testing.assert_allclose(gaussians.means[499 * index], mean, rtol=1e-6)
        quat = [row[3 + i] + row[25 + i] * since for i in range(4)]
        np.testing.assert_allclose(gaussians.quats[499 * index], quat, rtol=1e-6, atol=1e-7)
        opacity = row[14] / 255 * np.exp(-((since / row[-1]) ** 2))
        np.testing.assert_allclose(gaussians.opacities[499 * index], opacity, rtol=1e-6, atol=1e-37)
        np.testing.assert_allclose(gaussians.scales[499 * index], row[7:10], rtol=1e-6)
    # Rows of infinite width: the whole clip long.
    forever = np.frombuffer(data[start:], "<f2").reshape(-1, 32)[:, 31] == np.inf
    assert np.count_nonzero(forever) == 821
    assert np.array_equal(scene.at(0).opacities[forever], scene.at(scene.duration).opacities[forever])
