"""AVIF, decoded by Pillow: another decoder (libavif) than the encoder's."""

import numpy as np
import pytest
from PIL import Image, features

import brushgs as bg
from brushgs.formats.pictures.images import write_frame
from tests.kit.for_each import for_each

pytestmark = pytest.mark.skipif(not features.check("avif"), reason="this Pillow was built without AVIF")


def smooth_frame(height: int, width: int) -> bg.Frame:
    """Muted colors that change slowly, so that four pixels have one chroma; thinner to the right."""
    y, x = np.mgrid[:height, :width] / height
    rgb = np.stack([0.5 + 0.2 * np.sin(2 * x), 0.5 + 0.2 * np.cos(2 * y), 0.4 + 0.1 * x], -1)
    alpha = (1 - 0.5 * x).astype(np.float32)
    rgb = rgb.astype(np.float32)
    return bg.Frame(rgb * alpha[..., None], alpha)


@for_each(("height", "width", "bits"), [(48, 64, None), (48, 64, 8), (48, 64, 10), (33, 41, 8)])
def test_an_avif_shows_the_frame_on_its_background(tmp_path, height, width, bits):
    frame = smooth_frame(height, width)
    for name in ("a", "b"):
        write_frame(frame, tmp_path / f"{name}.avif", background=(0.9, 0.9, 0.8), bits=bits)
    assert (tmp_path / "a.avif").read_bytes() == (tmp_path / "b.avif").read_bytes()
    with Image.open(tmp_path / "a.avif") as picture:
        assert picture.size == (width, height)
        shown = np.asarray(picture.convert("RGB"), np.float32) / 255
    assert np.sqrt(np.mean((shown - frame.over((0.9, 0.9, 0.8))) ** 2)) < 3 / 255


def test_an_avif_needs_a_background_and_sixteen_pixels(tmp_path):
    with pytest.raises(ValueError, match=r"an AVIF holds no transparency, got '.*a\.avif'"):
        write_frame(smooth_frame(16, 16), tmp_path / "a.avif")
    with pytest.raises(ValueError, match=r"an AVIF must be at least 16 pixels wide and high, got 15x16"):
        write_frame(smooth_frame(16, 15), tmp_path / "a.avif", background=(1, 1, 1))
    with pytest.raises(ValueError, match=r"an AVIF of 10 bits must have even sides, got 17x16; use 8 bits"):
        write_frame(smooth_frame(16, 17), tmp_path / "a.avif", background=(1, 1, 1), bits=10)
    assert list(tmp_path.iterdir()) == []
    bg.save(smooth_frame(16, 16), tmp_path / "a.avif")  # on white
    assert (tmp_path / "a.avif").stat().st_size > 0
