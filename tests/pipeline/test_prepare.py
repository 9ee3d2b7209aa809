"""Every command makes the same strokes of the same file, and holds no scene longer than it needs."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.paths import CameraPath
from brushgs.formats.pictures.images import read_image
from brushgs.formats.scenes.write import write_scene
from brushgs.measure.bench.run import report_bench
from brushgs.measure.bench.subject import Subject
from brushgs.measure.stability.run import report_stability
from brushgs.options.experiments import BenchConfig, RefineConfig, StabilityConfig
from brushgs.options.painting import (
    CleanConfig,
    ClusterConfig,
    DrawConfig,
    PaintConfig,
    PaletteConfig,
    PruneConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import PathConfig
from brushgs.outlets.page.export import export_file
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.steps import making, opening
from brushgs.pipeline.still import paint_file
from tests.scenes import still_life_of

STROKES = 60
SMALL = ViewConfig(size=(48, 36))
PAINT = PaintConfig(cluster=ClusterConfig(STROKES), draw=DrawConfig("flat"), view=SMALL)
BARE = replace(PAINT, strokes=StrokesConfig.off())  # clusters, and nothing done to them
COLUMNS = ("means", "quats", "scales", "opacities", "sh")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trained scene, a file of strokes and a picture."""
    path = tmp_path_factory.mktemp("scenes")
    gaussians = still_life_of(1000)
    bg.save(gaussians, path / "scene.ply")
    write_scene(bg.cluster(gaussians, 90), path / "strokes.ply", is_strokes=True)
    camera = bg.Camera.look_at((0, -1, -8), (0, -1, 0), width=24, height=18)
    bg.save(bg.render(gaussians, camera, bg.StrokeTexture.open("gaussian")), path / "picture.png")
    return path


# One function a command: it runs the command, and returns the strokes that were painted. `caught` holds what
# `prepare` returned.
def render(path, paint, out, caught):
    paint_file(path, out / "a.png", paint)
    return caught.pop().strokes


def render_path(path, paint, out, caught):
    paint_sequence(path, out / "frames/", PathConfig(orbit=3), paint)
    return caught.pop().strokes


def export(path, paint, out, caught):
    export_file(path, out / "a.html", paint)
    return caught.pop().strokes


def stability(path, paint, out, caught):
    config = StabilityConfig(gaps=(1,), pairs=1, alone=0)
    report_stability(path, out / "stability.json", paint, PathConfig(orbit=3), config)
    return caught.pop().strokes


def bench(path, paint, out, caught):
    config = BenchConfig(("size",), strokes=(STROKES,), count=STROKES, repeats=1)
    report_bench(path, out / "bench.json", paint, config)
    subject = Subject(SceneSource.of(path), caught.pop(), paint, config)
    whole = subject.painting(STROKES)  # what the bench times, from the file on
    np.testing.assert_array_equal(whole.rgb, subject.draw(subject.strokes).rgb)
    return subject.strokes


def refine(path, paint, out, caught):
    pytest.importorskip("torch", reason="needs the extra [refine]")
    from brushgs.refine.run import refine_file

    refine_file(path, out / "refined.ply", paint, RefineConfig(steps=1, views=1, size=(24, 18)))
    return caught.pop().strokes


COMMANDS = {  # and the module whose `prepare` is watched
    render: "brushgs.pipeline.still",
    render_path: "brushgs.pipeline.sequence",
    export: "brushgs.outlets.page.export",
    stability: "brushgs.measure.stability.run",
    bench: "brushgs.measure.bench.run",
    refine: "brushgs.refine.run",
}


@pytest.mark.filterwarnings("ignore::brushgs.SceneWarning")  # three views show no surface twice
@pytest.mark.parametrize(
    ("command", "case"),
    [
        pytest.param(command, case, id=f"{command.__name__}-{case}")
        for command in COMMANDS
        for case in ("scene", "strokes", "keep", "palette")
        if case in ("scene", "strokes") or command is render
    ],
)
def test_all_commands_make_the_same_strokes(folder, tmp_path, monkeypatch, command, case):
    path = folder / ("strokes.ply" if case == "strokes" else "scene.ply")
    keep = 0.4 if case == "keep" else 0.7
    paint = {
        "keep": replace(BARE, prune=PruneConfig(keep=keep)),
        "palette": replace(BARE, palette=PaletteConfig(folder / "picture.png")),
    }.get(case, BARE)
    loaded = bg.load(path)
    expected = bg.cluster(loaded if case == "strokes" else bg.prune(loaded, keep), STROKES)
    if case == "palette":
        expected = bg.recolor(expected, bg.Palette.of_image(read_image(folder / "picture.png")))
    caught = []

    def watched(*args, **options):
        caught.append(prepare(*args, **options))
        return caught[-1]

    monkeypatch.setattr(f"{COMMANDS[command]}.prepare", watched)
    found = command(path, paint, tmp_path, caught)
    assert_same(found, expected)


def assert_same(found, expected):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


@pytest.fixture(scope="module")
def strokes_for_views(folder):
    """Those of a still, and of a path."""
    paths = None, PathConfig(orbit=3)
    return [prepare(folder / "scene.ply", PAINT, Report(), views=path).strokes for path in paths]


@pytest.mark.filterwarnings("ignore::brushgs.SceneWarning")
@pytest.mark.parametrize("command", [bench, refine, render_path, stability])
def test_strokes_for_views_are_the_same_in_all_commands(
    folder, tmp_path, monkeypatch, command, strokes_for_views
):
    caught = []

    def watched(*args, **options):
        caught.append(prepare(*args, **options))
        return caught[-1]

    monkeypatch.setattr(f"{COMMANDS[command]}.prepare", watched)
    found = command(folder / "scene.ply", PAINT, tmp_path, caught)
    assert_same(found, strokes_for_views[command in (render_path, stability)])


@pytest.mark.parametrize("keeps_scene", [False, True])
def test_the_scene_is_freed_after_pruning_unless_it_is_kept(folder, monkeypatch, keeps_scene):
    alive = []
    load, cluster = opening.load_scene, making.cluster_scene

    def watched_load(*args, **options):
        gaussians, notes = load(*args, **options)
        alive.append(weakref.ref(gaussians))
        return gaussians, notes

    def watched_cluster(*args, **options):
        gc.collect()
        alive.append(alive[0]() is not None)
        return cluster(*args, **options)

    monkeypatch.setattr(opening, "load_scene", watched_load)
    monkeypatch.setattr(making, "cluster_scene", watched_cluster)
    prepared = prepare(
        folder / "scene.ply", PAINT, Report(), asks=("strokes", "scene") if keeps_scene else ["strokes"]
    )
    assert alive[1] is keeps_scene
    assert (prepared.scene is not None) is keeps_scene


def test_only_what_is_needed_is_opened(folder, tmp_path):
    (tmp_path / "broken.png").write_text("no picture")
    broken = replace(BARE, draw=DrawConfig("flat", background=str(tmp_path / "broken.png")))
    assert prepare(folder / "scene.ply", broken, Report(), asks=["strokes", "cameras"]).background is None
    with pytest.raises(bg.SceneError, match=r"broken\.png"):
        prepare(folder / "scene.ply", broken, Report())
    report = Report()
    unclean = replace(BARE, clean=CleanConfig("off"))  # what hangs below an object is found in a first view
    prepared = prepare(folder / "scene.ply", unclean, report, asks=["strokes"])
    assert (prepared.cameras, prepared.background) == ((), None)
    assert [stage.name for stage in report.stages] == ["stroke", "load", "clean", "prune", "cluster"]
    counted = replace(BARE, cluster=ClusterConfig("auto"))
    report = Report()
    prepare(folder / "scene.ply", counted, report, asks=["strokes"])
    assert "camera" in [stage.name for stage in report.stages]


def test_a_path_is_checked_before_the_long_work(folder):
    def refuse(path):
        assert isinstance(path, CameraPath)
        raise ValueError("not this path")

    report = Report()
    with pytest.raises(ValueError, match="not this path"):
        prepare(folder / "scene.ply", PAINT, report, views=PathConfig(orbit=5), check_path=refuse)
    assert [stage.name for stage in report.stages] == ["stroke", "load", "clean", "first view", "path"]


@pytest.mark.parametrize(
    ("stroke", "along_path", "lock", "order"),
    [
        ("flat", False, "canonical", "depth"),
        ("flat", True, "track", "soft"),
        ("ellipse", False, "off", "depth"),
        ("ellipse", True, "off", "depth"),  # a kernel has no direction
    ],
)
def test_options_are_those_of_a_still_or_of_a_path(folder, stroke, along_path, lock, order):
    views = PathConfig(orbit=3) if along_path else None
    prepared = prepare(folder / "scene.ply", replace(BARE, draw=DrawConfig(stroke)), Report(), views=views)
    assert (prepared.options.lock, prepared.options.order) == (lock, order)
    assert [coat.fields is not None for coat in prepared.painting.coats] == [lock == "canonical"]
    assert (prepared.path is not None) is along_path
    assert prepared.painting.is_moving is along_path
    assert len(prepared.cameras) == (3 if along_path else 1)


def test_one_picture_cannot_be_tracked(folder):
    tracked = replace(PAINT, draw=DrawConfig("flat", lock="track"))
    with pytest.raises(ValueError, match="only a path can be tracked"):
        prepare(folder / "scene.ply", tracked, Report())
