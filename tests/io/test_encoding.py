"""Files with plain scales, another order of quaternions or RGB load correctly if the encoding is given."""

import numpy as np
import pytest

import brushgs as bg
from tests.doctor import plant
from tests.doctor.scenes import ball
from tests.kit.for_each import for_each


@for_each(
    ("way", "encoding", "atol"),
    [
        (plant.linear_scales, bg.Encoding(scales="linear"), 1e-6),
        (plant.linear_opacities, bg.Encoding(opacities="linear"), 1e-6),
        (plant.byte_opacities, bg.Encoding(opacities="byte"), 0.51 / 255),
        (plant.xyzw, bg.Encoding(quats="xyzw"), 1e-6),
    ],
)
def test_another_encoding_is_read_if_given(way, encoding, atol, tmp_path):
    path = plant.write(way(plant.columns_of(ball(), tmp_path)), tmp_path / "a.ply")
    gaussians, sound = bg.load(path, encoding), bg.load(tmp_path / "sound.ply")
    for name in ("means", "quats", "scales", "opacities", "sh"):
        np.testing.assert_allclose(getattr(gaussians, name), getattr(sound, name), rtol=0, atol=atol)


@for_each(("way", "colors", "step"), [(plant.linear_colors, "rgb", 0), (plant.byte_colors, "byte", 0.5)])
def test_rgb_is_read_if_given(way, colors, step, tmp_path):
    path = plant.write(way(plant.columns_of(ball(), tmp_path)), tmp_path / "a.ply")
    found = 0.5 + plant.C0 * bg.load(path, bg.Encoding(colors=colors)).sh[:, 0]
    expected = np.clip(0.5 + plant.C0 * bg.load(tmp_path / "sound.ply").sh[:, 0], 0, 1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=step / 255 + 1e-6)


@for_each("name", ["scales", "opacities", "quats"])
def test_an_unknown_encoding_is_refused(name):
    with pytest.raises(ValueError, match=f"Encoding: {name} must be one of .*, got 'odd'"):
        bg.Encoding(**{name: "odd"})
