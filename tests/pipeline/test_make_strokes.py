"""From a scene to strokes by what views show: which passes run, in which order, and what they leave alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.around import NEAR, RING, near_views, ring_views, subject_ahead
from brushgs.formats.pictures.images import read_image
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.painting import (
    ClusterConfig,
    DrawConfig,
    ErrorBudget,
    PaintConfig,
    PaletteConfig,
    PruneConfig,
    StrokesConfig,
    StrokeSize,
    ViewConfig,
)
from brushgs.options.sequence import PathConfig
from brushgs.outlets.passes import cluster_file
from brushgs.passes.color.broken_color import break_colors
from brushgs.passes.color.repaint import repaint
from brushgs.passes.form.orient import orient
from brushgs.passes.form.solid import solidify
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint, paint_file, paint_view
from brushgs.rendering.plain import plain_views
from tests.scenes import save_upright, still_life_of

COUNT = 80
PASSES = ["solid", "direction", "repaint", "broken colour"]
PAINT = PaintConfig(cluster=ClusterConfig(COUNT), draw=DrawConfig("flat"), view=ViewConfig(size=(64, 36)))


@pytest.fixture(scope="module")
def scene():
    return still_life_of(1000)


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "still_life.ply"
    save_upright(scene, path)
    return path


def stages(report):
    return {stage.name: stage for stage in report.stages}


def strokes_of(source, config=PAINT, **options):
    report = Report()
    return prepare(source, config, report, **options), stages(report)


def assert_same(found, expected):
    for name, column in found.columns().items():
        np.testing.assert_array_equal(column, getattr(expected, name), err_msg=name)


def with_strokes(**options):
    return replace(PAINT, strokes=StrokesConfig(**options))


@pytest.fixture(scope="module")
def seeing(file):
    """What is made by default, and the scene that it is made of."""
    return strokes_of(file, asks=(*PICTURE, "scene", "first_view"))[0]


def test_strokes_are_what_the_passes_make_one_by_one(seeing):
    prepared = seeing
    scene, view = prepared.whole_scene, prepared.first_view
    camera = prepared.camera
    near = near_views(camera, subject_ahead(camera, view), view.up)
    views = plain_views(scene, [*near, *ring_views(view, 64, 36)])
    pruned = bg.prune(scene)
    clusters = bg.cluster(pruned, COUNT, views=views)
    if worth_keeping(clusters).all():  # as of the still life; else others take their places
        expected = orient(solidify(clusters), pruned, "form")
        expected = break_colors(repaint(expected, pruned, views), StrokesConfig().broken_color)
        assert_same(prepared.strokes, expected)


def test_colours_are_broken_after_a_palette_is_taken(file, scene, tmp_path):
    camera = bg.Camera.look_at((0, -1, -8), (0, -1, 0), width=24, height=18)
    bg.save(bg.render(scene, camera, "gaussian"), tmp_path / "a.png")
    config = replace(PAINT, palette=PaletteConfig(tmp_path / "a.png", strength=0.5))
    found, order = strokes_of(file, config)
    of_strokes = [name for name in order if name != "fields"]  # of their directions in pictures
    assert of_strokes[-6:] == ["cluster", "solid", "direction", "repaint", "recolor", "broken colour"]
    unbroken, _ = strokes_of(file, replace(config, strokes=StrokesConfig(broken_color=0.0)))
    assert_same(found.strokes, break_colors(unbroken.strokes, StrokesConfig().broken_color))


def test_every_pass_has_its_stage_and_says_why_it_is_skipped(file):
    config = with_strokes(see="off", solid=False, broken_color=0.0)
    _, found = strokes_of(file, config)
    assert "plain views" not in found
    skipped = {name: found[name].skipped for name in PASSES}
    assert skipped == {
        "solid": ["solid: --solid off"],
        "direction": [],
        "repaint": ["repaint: --see off"],
        "broken colour": ["broken colour: --broken-color 0"],
    }
    assert found["direction"].counts["direction"] == "form"
    _, found = strokes_of(file, replace(PAINT, strokes=StrokesConfig.off()))
    assert not set(PASSES) & set(found)
    assert found["cluster"].skipped == [f"{', '.join(PASSES)}: they are switched off"]


@pytest.mark.parametrize("strokes_for", ["scene", "view"])
def test_views_are_those_near_the_picture_and_a_ring_unless_all_is_for_the_view(file, strokes_for):
    config = replace(PAINT, cluster=ClusterConfig(COUNT, strokes_for=strokes_for))
    counts = strokes_of(file, config, asks=["maker"])[1]["plain views"].counts
    ring = len(RING) if strokes_for == "scene" else 0
    assert (counts["own"], counts["ring"], counts["views"]) == (len(NEAR), ring, len(NEAR) + ring)
    counts = strokes_of(file, config, views=PathConfig(orbit=5), asks=["maker"])[1]["plain views"].counts
    assert (counts["own"], counts["ring"]) == (5, ring)


def test_strokes_do_not_depend_on_the_size_of_the_picture_nor_on_what_else_is_written(file, seeing):
    larger, _ = strokes_of(
        file, replace(PAINT, view=ViewConfig(size=(128, 72))), asks=(*PICTURE, "first_view")
    )
    assert_same(larger.strokes, seeing.strokes)
    counted, found = strokes_of(file, replace(PAINT, cluster=ClusterConfig("auto")))
    count = found["count"].counts["strokes"]
    given, _ = strokes_of(file, replace(PAINT, cluster=ClusterConfig(count)))
    assert_same(counted.strokes, given.strokes)


def test_strokes_of_a_file_are_painted_as_they_are(file, tmp_path):
    config = replace(PAINT, view=ViewConfig())
    cluster_file(file, tmp_path / "strokes.ply", config, Report())
    stored = bg.load(tmp_path / "strokes.ply")
    prepared, found = strokes_of(tmp_path / "strokes.ply", replace(config, cluster=ClusterConfig(None)))
    assert_same(prepared.strokes, stored)
    assert f"{', '.join(PASSES)}: they are strokes already" in found["cluster"].skipped
    # As a picture of the scene itself, unpruned as `cluster_file` leaves it.
    whole = replace(config, prune=PruneConfig(keep=1.0))
    paint_file(file, tmp_path / "a.png", replace(whole, view=ViewConfig(size=(1280, 720))))
    paint_file(tmp_path / "strokes.ply", tmp_path / "b.png", replace(whole, cluster=ClusterConfig(None)))
    one, two = (read_image(tmp_path / name) for name in ("a.png", "b.png"))
    away = np.abs(one - two)
    assert away.mean() < 1e-5  # files round opacities and scales
    assert away.max() < 0.01


@pytest.mark.parametrize("target", [ErrorBudget(17.0), StrokeSize(24.0)])
def test_targets_hold_for_the_strokes_that_are_painted(target):
    scene = still_life_of(2000)  # of fewer, a step of the ladder is not always nearer than the one below
    report = Report()
    config = replace(PAINT, cluster=ClusterConfig(target))
    prepared = prepare(scene, config, report, asks=(*PICTURE, "scene"))
    frame = paint_view(prepared, report)
    counts = stages(report)["cluster"].counts
    if isinstance(target, StrokeSize):
        assert counts["size"] == pytest.approx(target.pixels, rel=0.15)
        return
    plain = bg.render(prepared.whole_scene, prepared.camera, "gaussian", depth=False)
    difference = np.clip(frame.over((1, 1, 1)), 0, 1) - np.clip(plain.over((1, 1, 1)), 0, 1)
    reached = -10 * np.log10(np.mean(difference**2))
    assert reached == pytest.approx(counts["psnr"], abs=1e-3)
    assert reached >= target.psnr
    # And it is the fewest on the ladder: a step below does not reach it.
    below = replace(PAINT, cluster=ClusterConfig(max(1, round(counts["asked"] / 2**0.25))))
    fewer = paint(scene, below)
    difference = np.clip(fewer.over((1, 1, 1)), 0, 1) - np.clip(plain.over((1, 1, 1)), 0, 1)
    assert -10 * np.log10(np.mean(difference**2)) < target.psnr


def test_a_budget_that_no_number_reaches_is_refused(scene):
    with pytest.raises(ValueError, match=r"must be one that 'flat' can meet, got 60 dB; all"):
        paint(scene, replace(PAINT, cluster=ClusterConfig(ErrorBudget(60.0))))


def test_where_the_views_show_nothing_strokes_are_made_by_the_scene_alone(scene):
    away = bg.Camera.look_at((0, 0, 90), (0, 0, 99), width=64, height=36)
    config = replace(
        PAINT, cluster=ClusterConfig(COUNT, strokes_for="view"), strokes=StrokesConfig(solid=False)
    )
    prepared, found = strokes_of(scene, config, views=away)
    assert "they show nothing: strokes are made by the scene alone" in found["plain views"].did
    assert found["plain views"].counts["is_blank"]
    assert len(prepared.strokes) == COUNT


# ---- focus


def test_a_mask_lies_over_the_first_view(file, tmp_path):
    mask = np.zeros((36, 64, 3), np.float32)
    mask[:, 40:] = 1
    bg.save(bg.Frame(mask, np.ones((36, 64), np.float32)), tmp_path / "mask.png")
    _, found = strokes_of(file, with_strokes(focus=Focus(mask=tmp_path / "mask.png")))
    stage = found["focus"]
    assert 0 < stage.counts["in_focus"] < stage.counts["gaussians"]
    assert stage.counts["focus"] == str(tmp_path / "mask.png")


def test_a_focus_on_nothing_is_refused(file, tmp_path):
    with pytest.raises(ValueError, match=r"focus must lie in the scene, got 900,0,0,1; nothing is there"):
        strokes_of(file, with_strokes(focus=Focus((900.0, 0.0, 0.0, 1.0))))
    bg.save(bg.Frame(np.zeros((4, 4, 3)), np.ones((4, 4))), tmp_path / "dark.png")
    with pytest.raises(bg.SceneError, match=r"dark\.png: is dark all over"):
        strokes_of(file, with_strokes(focus=Focus(mask=tmp_path / "dark.png")))
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(bg.SceneError, match=r"text\.png"):
        strokes_of(file, with_strokes(focus=Focus(mask=tmp_path / "text.png")))


def test_files_of_options_are_not_overwritten(file, tmp_path):
    path = tmp_path / "mask.png"
    bg.save(bg.Frame(np.ones((4, 4, 3)), np.ones((4, 4))), path)
    with pytest.raises(bg.SceneError, match="is the input"):
        paint_file(file, path, with_strokes(focus=Focus(mask=path)))


def test_a_direction_from_a_missing_file_is_one_sentence(file):
    with pytest.raises(bg.SceneError, match=r"nowhere\.obj"):
        strokes_of(file, with_strokes(direction=Direction("guides", Path("nowhere.obj"))))
