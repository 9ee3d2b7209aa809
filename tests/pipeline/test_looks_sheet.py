"""The sheet of looks: every look once, in its order, as `render` paints it."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.formats.pictures.images import read_image
from brushgs.options.look import Look
from brushgs.options.painting import ViewConfig
from brushgs.outlets import looks_sheet
from brushgs.outlets.looks_sheet import CAPTION, GAP, paint_looks
from brushgs.pipeline.still import paint_file
from tests.scenes import still_life_of

SIZE = 96, 72
COLUMNS = 2
NAMES = ("mine", "dots", "flat")


@pytest.fixture(scope="module")
def looks(tmp_path_factory):
    """One look more than columns."""
    folder = tmp_path_factory.mktemp("looks")
    for number, name in enumerate(NAMES):
        text = f'title = "A"\n[cluster]\nstrokes = {20 + 10 * number}\n[draw]\nbackground = "teal"\n'
        (folder / f"{name}.toml").write_text(text)
    return [Look.open(folder / f"{name}.toml") for name in NAMES]


def test_a_sheet_shows_each_look_as_render_paints_it(scene, looks, tmp_path, monkeypatch):
    monkeypatch.setattr(looks_sheet, "COLUMNS", COLUMNS)
    report = paint_looks(looks, tmp_path / "a.png", scene=scene, view=ViewConfig(size=SIZE))
    sheet = read_image(tmp_path / "a.png")[..., :3]
    width, height = SIZE
    assert sheet.shape == (GAP + 2 * (height + CAPTION), GAP + COLUMNS * (width + GAP), 3)
    for number, look in enumerate(looks):
        config = look.config
        paint_file(scene, tmp_path / "b.png", replace(config, view=ViewConfig(size=SIZE)))
        left = GAP + number % COLUMNS * (width + GAP)
        top = GAP + number // COLUMNS * (height + CAPTION)
        expected = read_image(tmp_path / "b.png")[..., :3]
        np.testing.assert_array_equal(sheet[top : top + height, left : left + width], expected)
        caption = sheet[top + height : top + height + 26, left : left + width]
        assert np.abs(caption - looks_sheet.INK).max(axis=2).min() < 0.3, "its name stands below"
    strokes = [stage.counts["strokes"] for stage in report.stages if stage.name in NAMES]
    assert strokes == [20, 30, 40]
    assert report.output == str(tmp_path / "a.png")


def test_without_a_scene_it_shows_the_still_life(looks, tmp_path, monkeypatch):
    monkeypatch.setattr(looks_sheet, "still_life", lambda: still_life_of(2000))
    report = paint_looks(looks[:2], tmp_path / "a.png", view=ViewConfig(size=SIZE))
    assert [stage.name for stage in report.stages] == ["build", "mine", "dots", "sheet"]
    assert read_image(tmp_path / "a.png").shape[:2] == (GAP + 72 + CAPTION, GAP + 2 * (96 + GAP))
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_build_without_letters_gives_a_sheet_without_words_and_says_so(scene, looks, tmp_path, monkeypatch):
    monkeypatch.setattr(looks_sheet, "with_words", lambda picture, words: None)
    report = paint_looks(looks[:1], tmp_path / "a.png", scene=scene, view=ViewConfig(size=SIZE))
    assert report.stages[-1].skipped == ["names: this build of OpenImageIO draws no letters"]
    assert read_image(tmp_path / "a.png").shape[1] == 2 * GAP + 96
