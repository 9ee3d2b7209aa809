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


def landscape():
    """Sky over ground, streaked; in it a tree, a face with an eye, and a moon."""
    y, x = np.mgrid[:240, :320]
    picture = np.where((y < 144)[..., None], SKY, GROUND) + 0.04 * np.sin(0.4 * y + 0.1 * x)[..., None]
    picture += np.random.default_rng(0).normal(0, 0.01, picture.shape)
    picture[(np.abs(x - 64) < 18) & (y > 48)] = TREE
    for at_x, at_y, radius, color in ((192, 108, 40, SKIN), (198, 101, 9, EYE), (310, 29, 20, SKIN)):
        picture[np.hypot(x - at_x, y - at_y) < radius] = color
    return np.clip(picture, 0, 1)


def nearest(colors, color):
    """The least OKLab distance of any of the colors [..., 3] to one."""
    away = oklab_of(np.reshape(colors, (-1, 3)).astype(float)) - oklab_of(np.array([color]))
    return np.linalg.norm(away, axis=1).min()


@for_each("flatness", [0.0, 1.0])
def test_foam_is_not_calm_and_leaves_its_place_to_what_is(flatness):
    picture = np.ones((240, 320, 3)) * SKY
    spots = np.kron(np.random.default_rng(1).uniform(size=(14, 40)) < 0.5, np.ones((8, 8), bool))
    picture[112:224][spots] = (0.95, 0.95, 0.9)  # as frequent as calm colors, and at the border
    picture[224:] = GROUND
    calm = calm_cells(oklab_of(picture[::2, ::2].reshape(-1, 3)).reshape(120, 160, 3), flatness)
    assert calm[:50].mean() > 0.9
    assert calm[60:108].mean() < 0.1
    around = learn_stage(picture, flatness).colors.astype(float)
    assert np.abs(around[:40] - SKY).max() < 0.03  # flat, in the color of the painting


def test_no_figure_is_left_in_the_map_of_a_painting():
    stage = learn_stage(landscape())
    assert stage.colors.shape == (ROWS, COLUMNS, 3)
    assert min(nearest(stage.colors, color) for color in (TREE, SKIN, EYE)) > 0.12
    assert max(nearest(stage.colors, color) for color in (SKY, GROUND)) < 0.05
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
    picture = np.random.default_rng(1).random((96, 120, 3))
    assert calm_cells(oklab_of(picture.reshape(-1, 3)).reshape(96, 120, 3)).any()
    assert np.isfinite(learn_stage(picture).colors).all()


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
    calm, contrasts = marks.dictionary.calmest(0.5), marks.dictionary.contrasts
    assert contrasts[calm].max() <= np.delete(contrasts, calm).min()
    np.testing.assert_array_equal(marks.dictionary.calmest(1.0), np.arange(len(contrasts)))
