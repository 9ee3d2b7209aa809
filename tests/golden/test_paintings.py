"""Whole paintings, and each step to one, against what was looked at and kept."""

import numpy as np
import pytest

from brushgs.formats.pictures.images import read_image
from tests.golden.paintings import LOOKS, PAINTINGS, differs, in_axes, is_same, painted, steps

MAX_BYTES = 640 * 1024  # of all files


@pytest.fixture(scope="module")
def golden():
    with np.load(PAINTINGS / "strokes.npz") as file:
        return dict(file)


@pytest.fixture(scope="module")
def found(golden):
    return dict(steps(golden))


def test_every_step_makes_of_golden_inputs_what_it_made(found, golden):
    assert set(found) == set(golden) - {"labels"}
    pairs = {name: (in_axes(name, found[name]), in_axes(name, golden[name])) for name in found}
    assert [name for name, pair in pairs.items() if not is_same(*pair)] == []


@pytest.mark.parametrize("name", LOOKS)
def test_a_painting_of_golden_strokes_is_the_golden_picture(name, tmp_path):
    expected = 255 * read_image(PAINTINGS / f"{name}.png").astype(np.float64)
    assert not differs(painted(name, tmp_path), expected, name)


def test_goldens_tell_looks_apart_and_are_small():
    pictures = [255 * read_image(PAINTINGS / f"{name}.png").astype(np.float64) for name in LOOKS]
    for row, picture in enumerate(pictures):
        assert all(differs(picture, one) for one in pictures[:row] if one.shape == picture.shape)
        assert differs(0.99 * picture, picture)
    assert sum(path.stat().st_size for path in PAINTINGS.iterdir()) < MAX_BYTES


def test_a_change_of_a_thousandth_would_be_noticed(golden):
    for name, values in golden.items():
        if values.dtype.kind == "f":
            changed = 1.01 * values + 0.01 * values.std()
            assert not is_same(in_axes(name, changed), in_axes(name, values)), name
