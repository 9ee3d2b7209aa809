"""What surrounds the subject of a painting: calm parts alone, closed around, and its contours."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.style.calm import calm_cells, filled
from brushgs.passes.style.contours import learn_lines
from brushgs.passes.style.marks import learn_marks
from brushgs.passes.style.palette import learn_palette
from brushgs.passes.style.quilt import COLUMNS, ROWS, learn_stage
from brushgs.passes.style.transport import flat_colors
from brushgs.pipeline.style_values import style_values
from brushgs.values.colors import oklab_of
from brushgs.values.style import Style, StyleMarks
from tests.kit.for_each import for_each

SKY, GROUND, TREE = (0.35, 0.5, 0.8), (0.5, 0.45, 0.2), (0.05, 0.15, 0.08)
SKIN, EYE = (0.9, 0.65, 0.5), (0.9, 0.1, 0.6)
MARKS = StyleMarks(0.05, 4.0, np.zeros((2, 2, 2), np.float32))


def landscape(height=240, width=320):
    """Sky over ground, streaked; in it a tree, a face with an eye, and a moon."""
    g = np.random.default_rng(0)
    y, x = np.mgrid[:height, :width]
    picture = np.where((y < 0.6 * height)[..., None], SKY, GROUND) * np.ones((height, width, 3))
    picture += 0.04 * np.sin(0.4 * y + 0.1 * x)[..., None] + g.normal(0, 0.01, (height, width, 3))
    figures = [
        ((np.abs(x - 0.2 * width) < 18) & (y > 0.2 * height), TREE),
        (np.hypot(x - 0.6 * width, y - 0.45 * height) < 40, SKIN),
        (np.hypot(x - 0.62 * width, y - 0.42 * height) < 9, EYE),
        (np.hypot(x - 0.97 * width, y - 0.12 * height) < 20, SKIN),
    ]
    is_figure = np.zeros((height, width), bool)
    for place, color in figures:
        picture[place] = color
        is_figure |= place
    return np.clip(picture, 0, 1), is_figure


def nearest(colors, color):
    """The least OKLab distance of any of the colors [..., 3] to one."""
    away = oklab_of(np.reshape(colors, (-1, 3)).astype(float)) - oklab_of(np.array([color]))
    return np.linalg.norm(away, axis=1).min()


@for_each("flatness", [0.0, 1.0])
def test_foam_is_not_calm_and_leaves_its_place_to_what_is(flatness):
    g = np.random.default_rng(1)
    picture = np.ones((240, 320, 3)) * SKY
    spots = np.repeat(np.repeat(g.uniform(size=(14, 40)) < 0.5, 8, axis=0), 8, axis=1)
    picture[112:224][spots] = (0.95, 0.95, 0.9)  # as frequent as calm colors, and at the border
    picture[224:] = GROUND
    calm = calm_cells(oklab_of(picture[::2, ::2].reshape(-1, 3)).reshape(120, 160, 3), flatness)
    assert calm[:50].mean() > 0.9
    assert calm[60:108].mean() < 0.1
    around = learn_stage(picture, flatness).colors.astype(float)
    assert np.abs(around[:40] - SKY).max() < 0.03  # flat, in the color of the painting


def test_no_figure_is_left_in_the_map_of_a_painting():
    stage = learn_stage(landscape()[0])
    assert stage.colors.shape == (ROWS, COLUMNS, 3)
    for color in (TREE, SKIN, EYE):
        assert nearest(stage.colors, color) > 0.12
    assert nearest(stage.colors, SKY) < 0.05
    assert nearest(stage.colors, GROUND) < 0.05
    for field in (stage.colors, stage.directions):  # the map closes without a seam
        steps = np.abs(np.diff(field, axis=1, append=field[:, :1])).mean(axis=(0, 2))
        assert steps[-1] < 1.3 * max(steps[-2], steps[0]) + 1e-3


def test_what_is_known_stays_and_gaps_are_filled_from_around():
    field = np.zeros((40, 60, 1))
    field[:, 30:] = 1.0
    known = np.ones((40, 60), bool)
    known[10:30, 40:55] = False
    found = filled(np.where(known[..., None], field, 9.0), known)
    np.testing.assert_array_equal(found[known], field[known])
    np.testing.assert_allclose(found[~known], 1.0, atol=0.05)


def test_a_painting_without_calm_parts_has_a_map_all_the_same():
    g = np.random.default_rng(1)
    cells = oklab_of(g.random((96 * 120, 3))).reshape(96, 120, 3)
    assert calm_cells(cells).any()
    assert np.isfinite(learn_stage(g.random((96, 120, 3))).colors).all()


@pytest.mark.parametrize(("width", "spacing", "has_lines"), [(6, 40, True), (6, 400, False), (0, 40, False)])
def test_contours_are_dark_ridges_of_their_width(width, spacing, has_lines):
    _y, x = np.mgrid[:400, :500]
    picture = np.full((400, 500, 3), 0.8)
    picture[(x + 20) % spacing < width] = (0.1, 0.12, 0.2)
    picture += np.random.default_rng(2).normal(0, 0.01, picture.shape)
    lines = learn_lines(np.clip(picture, 0, 1), MARKS)
    assert (lines is not None) == has_lines
    if lines is not None:
        assert lines.width * 400 == pytest.approx(width, rel=0.35)
        assert nearest(lines.rgb, (0.1, 0.12, 0.2)) < 0.06


def test_a_print_is_laid_in_few_tones_and_calm_marks_and_paint_is_not():
    _y, x = np.mgrid[:400, :500]
    tones = np.array([0.85, 0.6, 0.4])[(x // 40) % 3][..., None] * (1.0, 0.95, 0.8)
    tones[x % 40 < 6] = (0.1, 0.12, 0.2)
    image = np.clip(tones + np.random.default_rng(2).normal(0, 0.004, tones.shape), 0, 1)
    marks = replace(learn_marks(image, 24), length=MARKS.length, aspect=MARKS.aspect)
    one = Style("print", learn_palette(image), marks, lines=learn_lines(image, MARKS))
    assert one.flatness > 0.5
    assert replace(one, lines=None).flatness == 0  # smooth paint without contours
    raised = replace(one, marks=replace(marks, relief=0.9))  # a scan whose paper shows
    assert style_values([(raised, 1.0)], {})["light"]["relief"] == pytest.approx(0.9 * (1 - one.flatness))
    greys = np.linspace(0, 1, 101)[:, None] * np.ones(3)
    before, after = (oklab_of(rgb) for rgb in (greys, flat_colors(one).colors(greys)))
    assert len(np.unique(after[:, 0].round(2))) < 0.7 * len(np.unique(before[:, 0].round(2)))
    np.testing.assert_allclose(after[:, 1:], before[:, 1:], atol=1e-6)  # hue and chroma stay
    dictionary = marks.dictionary
    assert dictionary is not None
    calm = dictionary.calmest(0.5)
    assert dictionary.contrasts[calm].max() <= np.delete(dictionary.contrasts, calm).min()
    np.testing.assert_array_equal(dictionary.calmest(1.0), np.arange(len(dictionary)))
