"""Gaussians among strokes, as they are, where only a part of a scene is painted: in the page as exactly."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.brushes.soft import SOFT
from brushgs.options.where import Where, WhereConfig
from brushgs.outlets.page import columns as page
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from tests.outlets.page.paintings import contents_of, some_coat, some_strokes
from tests.scenes import still_life_of

CAMERA = still_life_camera(width=160, height=120)


def test_the_page_shows_what_is_not_painted_as_the_exact_renderer_does(studio):
    """Within 66 dB."""
    config = bg.Look.open("oil").config
    config = replace(
        config,
        cluster=replace(config.cluster, strokes=200),
        strokes=replace(config.strokes, see="off"),
        draw=replace(config.draw, order="depth", lock="anchor"),
        painted=WhereConfig(Where.parse("half:-1,0,0,0")),
    )
    found = prepare(still_life_of(2000), config, Report(), views=CAMERA, asks=(*PICTURE, "first_view"))
    contents = studio.load(found.painting, CAMERA, background=found.background)
    assert contents.num_strokes > 1000
    exact = found.painting.without_effects().frame(CAMERA).rgb
    difference = np.clip(studio.paint(CAMERA, ground=True)[..., :3], 0, 1) - np.clip(exact, 0, 1)
    assert -10 * np.log10(np.mean(difference.astype(np.float64) ** 2)) > 45


def among(strokes, plain, **options):
    return some_coat(strokes, "flat", **options).showing(plain)


def test_gaussians_follow_strokes_with_the_soft_brush_and_nothing_of_paint():
    strokes, plain = some_strokes(50), some_strokes(30, seed=1)
    coat = among(strokes, plain, streaks=0.1, border=0.2)
    contents = contents_of(coat)
    (header,), (rows,) = contents.header["coats"], contents.rows
    assert header["count"] == 80
    is_plain = rows >= 50
    brush = contents.arrays[header["arrays"]["brush"]]
    np.testing.assert_array_equal(brush == header["plainBrush"], is_plain)
    names = [contents.header["brushes"][index]["name"] for index in header["brushes"]]
    assert names[header["plainBrush"]] == SOFT
    np.testing.assert_array_equal(
        contents.arrays[header["arrays"]["scales"]][is_plain], plain.scales[rows[is_plain] - 50]
    )
    assert (contents.arrays[header["arrays"]["chance"]][is_plain] == 0).all()
    assert "plainBrush" not in contents_of(some_coat(strokes)).header["coats"][0]


def test_a_page_has_the_largest_of_too_many_and_says_so(monkeypatch):
    monkeypatch.setattr(page, "MOST_PLAIN", 10)
    strokes, plain = some_strokes(50), some_strokes(30, seed=1)
    coat = among(strokes, plain)
    shown = page.shown_by(coat)
    assert len(shown) == 60
    order = page.coarse_to_fine(plain)[:10]
    np.testing.assert_array_equal(shown.means[50:], plain.means[np.sort(order)])
    assert any("of 30 Gaussians" in sentence for sentence in contents_of(coat).omitted)
    bare = some_coat(strokes)
    assert page.shown_by(bare) is bare.strokes
    assert isinstance(shown, bg.Gaussians)
    assert (shown.brushes[50:] == len(bg.BrushSet.of(coat.texture)) - 1).all()
