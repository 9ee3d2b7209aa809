"""From a scene to strokes by what views show: which passes run, in which order, and what they leave alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.around import NEAR, RING, near_views, ring_views, subject_ahead
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.painting import ClusterConfig, PaletteConfig, StrokesConfig
from brushgs.options.sequence import PathConfig
from brushgs.options.stroke_target import ErrorBudget, StrokeSize
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint, paint_view
from tests.kit import changed, for_each, save_opaque, stages, still_life_of, without_look
from tests.passes.scenes import assert_same

COUNT = 80
PAINT = without_look("flat", COUNT, (64, 36))


def strokes_of(source, config=PAINT, **options):
    report = Report()
    return prepare(source, config, report, **options), stages(report)


def with_strokes(**options):
    return replace(PAINT, strokes=StrokesConfig(**options))


@pytest.fixture(scope="module")
def seeing(scene):
    """What is made by default, and the scene that it is made of."""
    return strokes_of(scene, asks=(*PICTURE, "scene", "first_view"))[0]


def test_strokes_are_what_the_passes_make_one_by_one(seeing):
    gaussians, view, camera = seeing.whole_scene, seeing.first_view, seeing.camera
    near = near_views(camera, subject_ahead(camera, view), view.up)
    views = bg.plain_views(gaussians, [*near, *ring_views(view, 64, 36)])
    pruned = bg.prune(gaussians)
    clusters = bg.cluster(pruned, COUNT, views=views)
    assert worth_keeping(clusters).all()  # or others would take their places
    expected = bg.orient(bg.solidify(clusters), pruned, "form")
    expected = bg.break_colors(bg.repaint(expected, pruned, views), StrokesConfig().broken_color)
    assert_same(seeing.strokes, expected)


def test_colors_are_broken_after_a_palette_is_taken(scene, folder):
    save_opaque("a.png", np.random.default_rng(0).random((9, 12, 3)))
    config = replace(PAINT, palette=PaletteConfig(Path("a.png"), strength=0.5))
    found, order = strokes_of(scene, config)
    of_strokes = [name for name in order if name != "fields"]  # of their directions in pictures
    assert of_strokes[-6:] == ["cluster", "solid", "direction", "repaint", "recolor", "broken color"]
    unbroken, _ = strokes_of(scene, replace(config, strokes=StrokesConfig(broken_color=0.0)))
    assert_same(found.strokes, bg.break_colors(unbroken.strokes, StrokesConfig().broken_color))


def test_every_pass_has_its_stage_and_says_why_it_is_skipped(scene):
    skipped = {
        "solid": ["solid: --solid off"],
        "direction": [],
        "repaint": ["repaint: --see off"],
        "broken color": ["broken color: --broken-color 0"],
    }
    _, found = strokes_of(scene, with_strokes(see="off", solid=False, broken_color=0.0))
    assert "plain views" not in found
    assert {name: found[name].skipped for name in skipped} == skipped
    assert found["direction"].counts["direction"] == "form"
    _, found = strokes_of(scene, replace(PAINT, strokes=StrokesConfig.off()))
    assert not set(skipped) & set(found)
    assert found["cluster"].skipped == [f"{', '.join(skipped)}: they are switched off"]


@for_each("strokes_for", ["scene", "view"])
def test_views_are_those_near_the_picture_and_a_ring_unless_all_is_for_the_view(scene, strokes_for):
    config = replace(PAINT, cluster=ClusterConfig(COUNT, strokes_for=strokes_for))
    ring = len(RING) if strokes_for == "scene" else 0
    for views, own in ((None, len(NEAR)), (PathConfig(orbit=5), 5)):
        counts = strokes_of(scene, config, views=views, asks=["maker"])[1]["plain views"].counts
        assert (counts["own"], counts["ring"], counts["views"]) == (own, ring, own + ring)


def test_strokes_do_not_depend_on_the_size_of_the_picture_nor_on_what_else_is_written(scene, seeing):
    sized = changed(PAINT, view={"size": (128, 72)})
    assert_same(strokes_of(scene, sized, asks=(*PICTURE, "first_view"))[0].strokes, seeing.strokes)
    counted, found = strokes_of(scene, replace(PAINT, cluster=ClusterConfig("auto")))
    count = found["count"].counts["strokes"]
    given, _ = strokes_of(scene, replace(PAINT, cluster=ClusterConfig(count)))
    assert_same(counted.strokes, given.strokes)


def psnr_of(frame, plain):
    difference = np.clip(frame.over((1, 1, 1)), 0, 1) - np.clip(plain.over((1, 1, 1)), 0, 1)
    return -10 * np.log10(np.mean(difference**2))


def test_targets_hold_for_the_strokes_that_are_painted():
    gaussians = still_life_of(2000)  # of fewer, a step of the ladder is not always nearer than the one below
    _, found = strokes_of(gaussians, replace(PAINT, cluster=ClusterConfig(StrokeSize(24.0))))
    assert found["cluster"].counts["size"] == pytest.approx(24, rel=0.15)
    # Counts are chosen before strokes have directions in a field, which other locks take.
    anchored = replace(PAINT, draw=replace(PAINT.draw, lock="anchor"))
    report, config = Report(), replace(anchored, cluster=ClusterConfig(ErrorBudget(17.0)))
    prepared = prepare(gaussians, config, report, asks=(*PICTURE, "scene"))
    counts = stages(report)["cluster"].counts
    assert "dB reached at the" in stages(report)["cluster"].did
    plain = bg.render(prepared.whole_scene, prepared.camera, "gaussian", depth=False)
    reached = psnr_of(paint_view(prepared, report), plain)
    assert reached == pytest.approx(counts["psnr"], abs=1e-3)
    assert reached >= 17
    # And it is the fewest on the ladder: a step below does not reach it.
    below = ClusterConfig(max(1, round(counts["asked"] / 2**0.25)))
    assert psnr_of(paint(gaussians, replace(anchored, cluster=below)), plain) < 17


def test_where_the_views_show_nothing_strokes_are_made_by_the_scene_alone():
    away = bg.Camera.look_at((0, 0, 90), (0, 0, 99), width=64, height=36)
    config = replace(with_strokes(solid=False), cluster=ClusterConfig(COUNT, strokes_for="view"))
    prepared, found = strokes_of(still_life_of(1000), config, views=away)
    assert "they show nothing: strokes are made by the scene alone" in found["plain views"].did
    assert found["plain views"].counts["is_blank"]
    assert len(prepared.strokes) == COUNT


def test_a_mask_lies_over_the_first_view_and_a_focus_on_nothing_is_refused(scene, folder):
    mask = np.zeros((36, 64, 3))
    mask[:, 40:] = 1
    save_opaque("mask.png", mask)
    _, found = strokes_of(scene, with_strokes(focus=Focus(mask=Path("mask.png"))))
    assert 0 < found["focus"].counts["in_focus"] < found["focus"].counts["gaussians"]
    assert found["focus"].counts["focus"] == "mask.png"
    save_opaque("dark.png", np.zeros((4, 4, 3)))
    Path("text.png").write_text("no picture")
    for options, sentence in (
        ({"focus": Focus((900.0, 0.0, 0.0, 1.0))}, "focus must lie in the scene, got 900,0,0,1; nothing is"),
        ({"focus": Focus(mask=Path("dark.png"))}, r"dark\.png: is dark all over"),
        ({"focus": Focus(mask=Path("text.png"))}, r"text\.png"),
        ({"direction": Direction("guides", Path("nowhere.obj"))}, r"nowhere\.obj"),
    ):
        with pytest.raises(ValueError, match=sentence):
            strokes_of(scene, with_strokes(**options))


def test_one_and_two_gaussians_are_painted():
    for num in (1, 2):
        assert np.isfinite(paint(still_life_of(1000).take(slice(0, num)), PAINT).rgb).all()
