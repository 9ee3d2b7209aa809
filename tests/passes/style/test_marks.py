"""What is learnt of the marks of four paintings whose marks are known."""

import numpy as np
import pytest

from brushgs.passes.style.marks import learn_marks
from brushgs.values.colors import rgb_of
from tests.kit.for_each import for_each
from tests.kit.mark_paintings import KINDS, paint
from tests.kit.mark_paintings import learnt as learnt_of

# Mean angle, degrees, between learnt and true directions: dabs are nearly as wide as long, and washes lie
# over each other, which shows edges across them as well.
WITHIN = {"hatching": 4, "swirls": 9, "dabs": 20, "washes": 30}


@pytest.fixture(scope="module")
def learnt():
    return {name: learnt_of(name) for name in KINDS}


@pytest.mark.parametrize("name", KINDS)
def test_sizes_are_near_the_truth(learnt, name):
    marks, kind = learnt[name], KINDS[name]
    assert 1 / 1.4 < marks.length / kind.length < 1.4
    assert 1 / 1.5 < marks.aspect / kind.aspect < 1.5


@pytest.mark.parametrize("name", KINDS)
def test_directions_are_near_the_truth(learnt, name):
    found = learnt[name].directions.astype(np.float64)
    rows, columns = found.shape[:2]
    y, x = (np.mgrid[:rows, :columns] + 0.5) / min(rows, columns)
    angles = 2 * KINDS[name].angles(x, y)
    clear = np.hypot(found[..., 0], found[..., 1])
    cosines = (found[..., 0] * np.cos(angles) + found[..., 1] * np.sin(angles)) / np.maximum(clear, 1e-9)
    away = np.degrees(0.5 * np.arccos(np.clip(cosines, -1, 1)))
    assert np.average(away, weights=clear) < WITHIN[name]
    assert clear.max() <= 1 + 1e-6
    assert clear.mean() > 0.5


@pytest.mark.parametrize("name", KINDS)
def test_a_ground_is_found_where_it_shows_between_marks_and_nowhere_else(learnt, name):
    found, kind = learnt[name].ground, KINDS[name]
    if kind.shows_ground:
        np.testing.assert_allclose(found, rgb_of(kind.ground), atol=0.02)
    else:
        assert found is None


@for_each("channels", [1, 2, 3, 4])
def test_pictures_of_any_channels_are_taken(channels):
    rgb = paint("hatching", size=(48, 40))
    image = rgb if channels > 2 else rgb.mean(axis=2, keepdims=True)
    if channels in (2, 4):
        image = np.concatenate([image, np.ones((40, 48, 1), np.float32)], axis=2)
    marks = learn_marks(np.ascontiguousarray(image))
    assert 0 < marks.length <= 1 <= marks.aspect <= 20


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((64, 64, 5), np.float32), "1 to 4 channels"),
        (np.zeros((64, 31, 3), np.float32), "got 3 in 31x64"),
        (np.full((64, 64, 3), 0.4, np.float32), "one even colour"),
    ],
)
def test_what_is_no_painting_is_refused(image, message):
    with pytest.raises(ValueError, match=message):
        learn_marks(image)
