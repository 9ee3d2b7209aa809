"""Every command makes the same strokes of the same file, and holds no scene longer than it needs."""

import gc
import weakref
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

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
from brushgs.options.painting import ClusterConfig, PaletteConfig, StrokesConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import PathConfig
from brushgs.outlets.page.export import export_file
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.steps import making, opening
from brushgs.pipeline.still import paint_file
from brushgs.pipeline.strokes import open_palette
from tests.kit import changed, for_each, save_opaque, stages, still_life_of, without_look
from tests.passes.scenes import assert_same

COUNT = 60
PAINT = without_look("flat", COUNT, (48, 36))
BARE = replace(PAINT, strokes=StrokesConfig.off())  # clusters, and nothing done to them


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A trained scene, a file of strokes and a picture."""
    path = tmp_path_factory.mktemp("scenes")
    gaussians = still_life_of(1000)
    bg.save(gaussians, path / "scene.ply")
    write_scene(bg.cluster(gaussians, 90), path / "strokes.ply", is_strokes=True)
    save_opaque(path / "picture.png", np.random.default_rng(0).random((9, 12, 3)))
    return path


def refine(path, paint, out):
    pytest.importorskip("torch", reason="needs the extra [refine]")
    from brushgs.refine.run import refine_file

    refine_file(path, out / "refined.ply", paint, RefineConfig(steps=1, views=1, size=(24, 18)))


ORBIT = PathConfig(orbit=3)
BENCH = BenchConfig(("size",), strokes=(COUNT,), count=COUNT, repeats=1)
PAIRS = ORBIT, StabilityConfig(gaps=(1,), pairs=1, alone=0)
COMMANDS = {  # the module whose `prepare` is watched -> what is run
    "pipeline.still": lambda path, paint, out: paint_file(path, out / "a.png", paint),
    "pipeline.sequence": lambda path, paint, out: paint_sequence(path, out / "frames/", ORBIT, paint),
    "outlets.page.export": lambda path, paint, out: export_file(path, out / "a.html", paint),
    "measure.stability.run": lambda path, paint, out: report_stability(path, out / "a.json", paint, *PAIRS),
    "measure.bench.run": lambda path, paint, out: report_bench(path, out / "a.json", paint, BENCH),
    "refine.run": refine,
}


@pytest.mark.filterwarnings("ignore::brushgs.SceneWarning")  # three views show no surface twice
@pytest.mark.parametrize("module", COMMANDS)
def test_all_commands_make_the_same_strokes(files, tmp_path, module):
    """Clusters of strokes alone, and strokes that see; render with more options too."""
    caught = []

    def watched(*args, **options):
        caught.append(prepare(*args, **options))
        return caught[-1]

    scene, picture = files / "scene.ply", files / "picture.png"
    loaded, strokes = bg.load(scene), bg.load(files / "strokes.ply")
    clusters = bg.cluster(bg.prune(loaded, 0.7), COUNT)
    views = ORBIT if module in ("pipeline.sequence", "measure.stability.run") else None
    cases = [
        (files / "strokes.ply", BARE, bg.cluster(strokes, COUNT)),
        (scene, PAINT, prepare(scene, PAINT, Report(), views=views).strokes),
    ]
    if module == "pipeline.still":
        few, recolored = changed(BARE, prune={"keep": 0.4}), replace(BARE, palette=PaletteConfig(picture))
        cases += [
            (scene, BARE, clusters),
            (scene, few, bg.cluster(bg.prune(loaded, 0.4), COUNT)),
            (scene, recolored, bg.recolor(clusters, bg.Palette.of_image(read_image(picture)))),
        ]
    for number, (path, paint, expected) in enumerate(cases):
        out = tmp_path / f"{number}"
        out.mkdir()
        with patch(f"brushgs.{module}.prepare", watched):
            COMMANDS[module](path, paint, out)
            found = caught.pop()
            if module == "measure.bench.run":
                found = Subject(SceneSource.of(path), found, paint, BENCH)
                whole = found.painting(COUNT)  # what the bench times, from the file on
                np.testing.assert_array_equal(whole.rgb, found.draw(found.strokes).rgb)
        assert_same(found.strokes, expected)


@for_each("keeps_scene", [False, True])
def test_the_scene_is_freed_after_pruning_unless_it_is_kept(scene, keeps_scene):
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

    asks = ("strokes", "scene") if keeps_scene else ["strokes"]
    with (
        patch.object(opening, "load_scene", watched_load),
        patch.object(making, "cluster_scene", watched_cluster),
    ):
        prepared = prepare(scene, PAINT, Report(), asks=asks)
    assert alive[1] is keeps_scene
    assert (prepared.scene is not None) is keeps_scene


def test_only_what_is_needed_is_opened(scene, folder):
    Path("broken.png").write_text("no picture")
    broken = changed(BARE, draw={"background": "broken.png"})
    assert prepare(scene, broken, Report(), asks=["strokes", "cameras"]).background is None
    report = Report()
    with pytest.raises(bg.SceneError, match=r"broken\.png"):
        prepare(scene, broken, report)
    assert "prune" not in stages(report)  # before the long work
    report = Report()
    unclean = changed(BARE, clean={"floaters": "off"})  # what hangs below an object is found in a first view
    prepared = prepare(scene, unclean, report, asks=["strokes"])
    assert (prepared.cameras, prepared.background) == ((), None)
    assert list(stages(report)) == ["stroke", "load", "clean", "prune", "cluster"]
    report = Report()
    prepare(scene, replace(BARE, cluster=ClusterConfig("auto")), report, asks=["strokes"])
    assert "camera" in stages(report)


def test_a_path_is_checked_before_the_long_work_and_one_picture_cannot_be_tracked(scene):
    def refuse(path):
        assert isinstance(path, CameraPath)
        raise ValueError("not this path")

    report = Report()
    with pytest.raises(ValueError, match="not this path"):
        prepare(scene, PAINT, report, views=PathConfig(orbit=5), check_path=refuse)
    assert list(stages(report)) == ["stroke", "load", "clean", "first view", "path"]
    tracked = changed(PAINT, draw={"lock": "track"})
    with pytest.raises(ValueError, match="only a path can be tracked"):
        prepare(scene, tracked, Report())


@for_each(
    ("stroke", "along_path", "lock", "order"),
    [
        ("flat", False, "canonical", "depth"),
        ("flat", True, "track", "soft"),
        ("ellipse", False, "off", "depth"),
        ("ellipse", True, "off", "depth"),  # a kernel has no direction
    ],
)
def test_options_are_those_of_a_still_or_of_a_path(scene, stroke, along_path, lock, order):
    views = PathConfig(orbit=3) if along_path else None
    prepared = prepare(scene, changed(BARE, draw={"stroke": stroke}), Report(), views=views)
    assert (prepared.options.lock, prepared.options.order) == (lock, order)
    assert [coat.fields is not None for coat in prepared.painting.coats] == [lock == "canonical"]
    assert (prepared.path is not None) is along_path
    assert prepared.painting.is_moving is along_path
    assert len(prepared.cameras) == (3 if along_path else 1)


def test_a_palette_without_colors_is_refused(folder):
    nothing = np.zeros((4, 4, 4), np.float32)
    bg.save(bg.Frame(nothing[..., :3], nothing[..., 3], nothing[..., 3]), "clear.png")
    with pytest.raises(bg.SceneError, match=r"clear\.png: has no colors to take"):
        open_palette(PaletteConfig(Path("clear.png")), Report())
