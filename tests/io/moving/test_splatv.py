"""splaTV files: their header, texture and ends; the one real clip."""

from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError
from brushgs.formats.moving import open_moving
from tests.io.moving import clips
from tests.scenes import real_scene


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_every_cut_is_refused_in_a_sentence(tmp_path):
    """Each length that misses a Gaussian, but for the last row of the texture, whose end is not known."""
    data = clips.encode_splatv(clips.spacetime_columns(9))  # four a row of the texture: three rows
    least = len(data) - 64
    for length in [0, 1, 4, 8, 20, *range(100, len(data), 37)]:
        path = write(tmp_path / "a.splatv", data[:length])
        if length >= 4 and length <= least:
            with pytest.raises(SceneError, match="cut off") as error:
                open_moving(path)
            assert str(path) in str(error.value)
    with pytest.raises(SceneError, match=r"63 bytes are missing at least|last Gaussian is not complete"):
        open_moving(write(tmp_path / "a.splatv", data[:-1]))


FAULTY = {
    "size": ("no number", r"header\[0\]\.size must be a whole number 0 to"),
    "texwidth": (-1, r"header\[0\]\.texwidth must be a whole number 0 to"),
    "type": ("mesh", "names no chunk of type 'splat'"),
}


@pytest.mark.parametrize("field", FAULTY)
def test_a_header_that_makes_no_sense_is_refused(field, tmp_path):
    value, message = FAULTY[field]
    path = write(tmp_path / "a.splatv", clips.encode_splatv(clips.spacetime_columns(5), **{field: value}))
    with pytest.raises(SceneError, match=message):
        open_moving(path)


def test_a_file_of_padding_only_is_refused(tmp_path):
    data = clips.encode_splatv(clips.spacetime_columns(8))
    with pytest.raises(SceneError, match="holds no Gaussians; export it again"):
        open_moving(write(tmp_path / "a.splatv", data[: -8 * 64] + bytes(8 * 64)))


def test_the_real_clip_has_its_known_rows_and_equals_a_decode_of_the_format():
    path = real_scene("moving/cook_spinach.splatv")
    scene = bg.load_moving(path)
    assert scene.notes is not None
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
