"""Words fit what they say: colors, light and marks that are made to be so."""

import numpy as np

from brushgs.passes.style.words import FITS, words_of_strokes, words_of_style
from brushgs.values.camera import Camera
from brushgs.values.style import NamedColor, Style, StyleEdit, StyleMarks, StylePalette
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at

CAMERA = Camera.look_at((0, 0, -4), (0, 0, 0), width=160, height=120, fov_y=0.8)


def fit(wanted, unwanted, found):
    words = {word.word for word in found if word.fit >= FITS}
    assert wanted <= words
    assert not unwanted & words


def of_colors(*colors, shares=(0.5, 0.5)):
    parts = zip(colors, shares, strict=True)
    named = (NamedColor("some", np.array(c, float), s, np.zeros((1, 3), np.float32)) for c, s in parts)
    return words_of_style(Style("a", palette=StylePalette(tuple(named))))


def marks(length=0.06, aspect=2.5, angle=lambda x, y: 0 * x, **others):
    y, x = np.mgrid[0:24, 0:32] / 24
    doubled = 2 * angle(x, y)
    pairs = np.stack([np.cos(doubled), np.sin(doubled)], axis=-1).astype(np.float32)
    return StyleMarks(length, aspect, pairs, **others)


@for_each(
    ("colors", "fits", "fits_not"),
    [
        ([(0.05, 0.05, 0.06), (0.2, 0.2, 0.21)], {"dark", "muted"}, {"high-key", "vivid", "warm", "cool"}),
        ([(0.9, 0.9, 0.9), (0.8, 0.8, 0.81)], {"high-key", "muted", "low in contrast"}, {"dark", "warm"}),
        ([(0.02, 0.02, 0.02), (1, 1, 1)], {"strong in contrast"}, {"low in contrast", "dark"}),
        ([(0.9, 0.3, 0.05), (0.9, 0.6, 0.1)], {"warm", "vivid"}, {"cool", "muted", "contrasting in hue"}),
        ([(0.1, 0.3, 0.8), (0.1, 0.4, 0.9)], {"cool", "of one hue"}, {"warm", "muted"}),
        ([(0.9, 0.2, 0.2), (0.1, 0.7, 0.7)], {"contrasting in hue"}, {"of one hue"}),
    ],
)
def test_words_of_light_and_color(colors, fits, fits_not):
    fit(fits, fits_not, of_colors(*colors))


def test_colors_are_named_by_their_shares():
    found = of_colors((0.1, 0.2, 0.7), (0.8, 0.75, 0.2), (0.7, 0.1, 0.1), shares=[0.7, 0.27, 0.03])
    shares = {word.word: word.value for word in found if word.figure == "share of the picture"}
    assert [round(share, 2) for share in shares.values()] == [0.7, 0.27]
    assert "blue" in next(iter(shares))


def swirl(x, y):
    return np.arctan2(y - 0.5, x - 0.7) + np.pi / 2


def chance(x, y):
    return np.random.default_rng(0).uniform(0, np.pi, x.shape)


@for_each(
    ("given", "fits", "fits_not"),
    [
        ({"length": 0.02, "aspect": 1.5}, {"fine", "dabbed"}, {"broad", "drawn-out"}),
        ({"length": 0.3, "aspect": 4.5}, {"broad", "drawn-out"}, {"fine", "dabbed"}),
        ({"angle": lambda x, y: -0.8 + 0.1 * np.sin(40 * x)}, {"aligned"}, {"swirling", "restless"}),
        ({"angle": swirl}, {"swirling"}, {"aligned", "restless"}),
        ({"angle": chance}, {"restless"}, {"aligned", "swirling"}),
        ({"broken_lightness": 0.15, "relief": 0.8}, {"broken in color", "thick"}, {"flat in color"}),
        ({"broken_lightness": 0.0}, {"flat in color"}, {"broken in color", "thick"}),
    ],
)
def test_words_of_marks(given, fits, fits_not):
    fit(fits, fits_not, words_of_style(Style("a", marks=marks(**given))))


def strokes(num=900, *, angle=lambda x, y: 0 * x, aspect=3.0, width=0.05, deviation=0.0):
    """A sheet of flat strokes before the camera, grey."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.6, 1.6, num), rng.uniform(-1.2, 1.2, num)
    half = 0.5 * angle(x, y)
    quats = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    grey = np.clip(0.5 + deviation * rng.normal(size=(num, 1)), 0, 1)
    means = np.stack([x, y, 1e-3 * np.arange(num) / num], 1)
    return gaussians_at(means, (aspect * width, width, 1e-3), grey, quats=quats)


@for_each(
    ("given", "fits", "fits_not"),
    [
        ({}, {"aligned", "flat in color"}, {"swirling", "broken in color", "dabbed"}),
        ({"angle": lambda x, y: np.arctan2(y, x) + np.pi / 2}, {"swirling"}, {"aligned", "restless"}),
        ({"angle": chance}, {"restless"}, {"aligned", "swirling"}),
        ({"deviation": 0.2}, {"broken in color"}, {"flat in color"}),
        ({"aspect": 1.2}, {"dabbed"}, {"drawn-out"}),
        ({"aspect": 6.0, "width": 0.03}, {"drawn-out"}, {"dabbed"}),
        ({"width": 0.005, "num": 5000}, {"fine"}, {"broad"}),
        ({"width": 0.08}, {"broad", "dense"}, {"fine", "loose"}),
        ({"width": 0.03, "num": 150}, {"loose"}, {"dense"}),
        ({"num": 1, "aspect": 6.0}, {"drawn-out"}, set()),
    ],
)
def test_words_of_strokes(given, fits, fits_not):
    fit(fits, fits_not, words_of_strokes(strokes(**given), CAMERA))


def test_what_is_not_seen_has_no_words():
    assert words_of_strokes(strokes(), Camera.look_at((0, 0, 4), (0, 0, 9), width=64, height=48)) == []
    assert words_of_style(Style("edit", edit=StyleEdit(np.eye(3, 4)))) == []
