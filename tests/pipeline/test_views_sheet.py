"""The contact sheet of a scene: which views it holds, and that its captions are true."""

from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.first_view import framed_camera, sayable
from brushgs.cameras.framing import plain_first_view
from brushgs.first_view import find_first_view
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import ViewConfig
from brushgs.pipeline import views_sheet
from brushgs.pipeline.report import Report
from brushgs.pipeline.views_sheet import CELL, NUM_AZIMUTHS, plan_sheet, sheet_beside, write_sheet
from brushgs.rendering import letters
from tests.first_view.made_walks import street
from tests.kit import for_each, still_life_of

SMALL = ViewConfig(size=(40, 30))
UPS = (("+z", 0.41), ("-y", 0.38), ("+y", 0.12), ("-z", 0.05), ("+x", 0.02), ("-x", 0.02))


GAUSSIANS = still_life_of(1000)


@pytest.fixture(scope="module")
def view():
    return plain_first_view(GAUSSIANS)


def test_a_sheet_shows_azimuths_by_elevations_from_the_first_view_on(view):
    rows = plan_sheet(replace(view, azimuth=radians(350)), ViewConfig(side="left"))
    assert [len(row) for row in rows] == [NUM_AZIMUTHS] * 3
    assert rows[0][0].flags == "--azimuth 350 --elevation 15"
    assert rows[0][0].note == "the first view"
    assert [round(degrees(cell.config.azimuth)) for cell in rows[1]] == [350, 35, 80, 125, 170, 215, 260, 305]
    assert [row[0].flags.split()[-1] for row in rows] == ["15", "45", "3"]
    assert {cell.config.size for row in rows for cell in row} == {CELL}
    steep = plan_sheet(replace(view, elevation=radians(70)), SMALL)
    assert [row[0].flags.split()[-1] for row in steep] == ["70", "80", "58"]


def test_where_up_is_in_doubt_rows_are_axes_the_most_probable_first(view):
    rows = plan_sheet(replace(view, probability=0.41, ups=UPS), SMALL)
    flags = [f"--up {name} --azimuth 75 --elevation 15" for name in ("+z", "-y", "+y", "-z")]
    assert [row[1].flags for row in rows] == flags
    notes = ["up is +z: 0.41", "up is -y: 0.38, the first view", "up is +y: 0.12", "up is -z: 0.05"]
    assert [row[0].note for row in rows] == notes
    for settled in (replace(view, probability=0.9, ups=UPS), view):
        assert len({cell.flags.split()[0] for row in plan_sheet(settled, SMALL) for cell in row}) == 1
    two = plan_sheet(replace(view, probability=0.6, ups=(("+z", 0.6), ("-y", 0.399), ("+x", 0.001))), SMALL)
    assert [row[0].flags.split()[1] for row in two] == ["+z", "-y"]
    told = plan_sheet(replace(view, probability=0.41, ups=UPS), replace(SMALL, up="-y"))
    assert told[0][1].flags == flags[1]


def test_a_scene_seen_from_inside_is_shown_from_outside_in_all_other_cells(view):
    inside = replace(view, eye=np.array([0.0, 0, -1]), azimuth=0.0)
    rows = plan_sheet(inside, SMALL)
    assert rows[0][0].flags == "--azimuth 0 --elevation 15"
    assert {cell.flags.rpartition("--look-at ")[2] for row in rows for cell in row[1:]} == {"subject"}
    np.testing.assert_allclose(framed_camera(inside, rows[0][0].config).position, inside.eye, atol=1e-12)


def test_flags_of_views_from_inside_are_short_and_give_the_same_camera(tmp_path):
    seen = sayable(find_first_view(street(), up="-y"))
    sheet = write_sheet(street(), seen, tmp_path / "street.png", Report(), name="street", view=SMALL)
    for cell in sheet[1:NUM_AZIMUTHS]:
        words = dict(zip(cell.flags.split()[::2], cell.flags.split()[1::2], strict=True))
        assert len(cell.flags) < 90
        angles = {name: radians(float(words[f"--{name}"])) for name in ("azimuth", "elevation")}
        if "--distance" in words:
            place = tuple(float(number) for number in words["--look-at"].split(","))
            angles |= {"look_at": place, "distance": float(words["--distance"])}
        told = framed_camera(cell.first_view, replace(SMALL, **angles))
        shown = framed_camera(cell.first_view, cell.config)
        assert np.array_equal(told.viewmat, shown.viewmat)
        assert told.near == shown.near


def test_each_cell_is_the_picture_that_its_flags_give(view, tmp_path):
    cells = write_sheet(GAUSSIANS, view, tmp_path / "a.png", Report(), name="a", view=SMALL)
    sheet = read_image(tmp_path / "a.png")
    for cell in (cells[0], cells[11], cells[-1]):
        camera = framed_camera(cell.first_view, cell.config)
        expected = bg.render(GAUSSIANS, camera, "gaussian").over(views_sheet.PAPER).clip(0, 1)
        left = views_sheet.GAP + cell.column * (40 + views_sheet.GAP)
        top = views_sheet.TITLE + cell.row * (30 + views_sheet.CAPTION)
        found = sheet[top : top + 30, left : left + 40, :3]
        np.testing.assert_allclose(found, expected, atol=0.003)


def test_a_build_without_letters_gives_a_sheet_without_words_and_says_so(view, tmp_path, monkeypatch):
    monkeypatch.setattr(letters, "PLAIN", "no such font")
    monkeypatch.setattr(views_sheet, "with_words", lambda picture, words: None)
    report = Report()
    write_sheet(GAUSSIANS, view, tmp_path / "a.png", report, name="a", view=SMALL)
    assert read_image(tmp_path / "a.png").shape[1] == views_sheet.GAP + 8 * (40 + views_sheet.GAP)
    assert "captions: this build of OpenImageIO draws no letters" in report.stages[0].skipped[0]


def test_letters_that_cannot_be_drawn_are_none():
    paper = np.ones((20, 60, 3), np.float32)
    assert letters.with_words(paper, [letters.Words("a", 3, 15, 12, (0, 0, 0), "no such font")]) is None
    words = [letters.Words("a", 3, 15, 12, (0, 0, 0)), letters.Words("", 1, 1, 9, (0, 0, 0))]
    drawn = letters.with_words(paper, words)
    assert drawn.min() < 0.3
    assert paper.min() == 1


@for_each(
    ("output", "sheet"),
    [
        ("a.png", "koala-views.png"),
        ("x/a.mp4", "x/koala-views.png"),
        ("x/frames/%05d.png", "x/koala-views.png"),
        ("x/frames/", "x/koala-views.png"),
        ("%05d.png", "koala-views.png"),
    ],
)
def test_a_sheet_lies_beside_the_painting(output, sheet):
    assert sheet_beside(output, "koala") == Path(sheet)
