"""Several files, folders and levels of detail on the command line."""

import importlib
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.scene_source import SceneSource
from tests.io.ply_maker import scene_columns, write_scene
from tests.kit.commands import refused, run, stages_of
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SMALL = ["--stroke", "gaussian", "--size", "32x24"]


@pytest.fixture
def tiles(folder, scene):
    """A scene of two files, and a folder of nothing."""
    for name in ("tiles", "empty"):
        Path(name).mkdir()
    for name in "ab":
        Path(f"tiles/{name}.ply").write_bytes(scene.read_bytes())


CALLS = {  # command -> module and function that take the scene
    "render": ("brushgs.pipeline.still", "paint_file"),
    "prune": ("brushgs.outlets.passes", "prune_file"),
    "cluster": ("brushgs.outlets.passes", "cluster_file"),
    "recolor": ("brushgs.outlets.passes", "recolor_file"),
    "refine": ("brushgs.refine.run", "refine_file"),
    "bench": ("brushgs.measure.bench", "report_bench"),
    "stability": ("brushgs.measure.stability", "report_stability"),
    "doctor": ("brushgs.doctor.run", "run_doctor"),
    "info": ("brushgs.doctor.describe", "describe"),
}


@for_each("command", CALLS)
def test_every_command_takes_several_files_a_level_and_a_moment(tiles, capsys, command):
    if command == "refine":
        pytest.importorskip("torch", reason="needs the extra [refine]")
    seen = []

    def watch(scene, *args, **options):
        seen.append(scene)
        return {}

    rate = "--moments-per-second", "12.5"
    more = ["--palette", "p.png"] if command == "recolor" else []
    module, function = CALLS[command]
    with patch.object(importlib.import_module(module), function, watch):
        code, _, err = run(capsys, command, "tiles", "c.ply", "--lod", "2", "--time", "40%", *rate, *more)
    source = SceneSource((Path("tiles"), Path("c.ply")), 2, bg.Moment(0.4, is_share=True), 12.5)
    assert (code, seen) == (0, [source]), err
    sentence = "a.ply: is a PLY file, which has no levels of detail; omit the level (lod)"
    if command in ("info", "doctor", "render"):
        assert sentence in refused(capsys, command, "tiles", "--lod", "0")
        assert "empty: is an empty folder: it should hold .ply" in refused(capsys, command, "empty/")


def test_what_the_load_stage_says_of_columns_and_training(folder, scene, capsys):
    columns = scene_columns(200)

    def loaded(more=(), without=None):
        found = columns | {name: np.zeros(200, np.float32) for name in more}
        write_scene(Path("a.ply"), {name: values for name, values in found.items() if name != without})
        return stages_of(capsys, "render", "a.ply", *SMALL)["load"]

    stage = loaded(("segment", "label"))
    assert stage["did"].endswith("; 2 columns not read: segment, label")
    assert stage["counts"]["columns_not_read"] == ["segment", "label"]
    many = [f"c{n}" for n in range(9)]
    assert loaded(many)["did"].endswith("; 9 columns not read: c0, c1, c2, c3, c4, c5, ...")
    assert "not read" not in loaded()["did"]
    # Names cannot steer the terminal.
    assert loaded(["\x1b[31mred"])["did"].endswith("; 1 column not read: ?[31mred")
    assert "\x1b" not in run(capsys, "info", "a.ply")[1]
    assert loaded(without="scale_2")["did"].endswith(", 2DGS, flat discs")
    assert "training         2dgs" in run(capsys, "info", "a.ply")[1]


def test_passes_over_an_antialiased_scene_keep_it_in_their_file(folder, capsys):
    bg.save(replace(still_life_of(1000), antialiased=True), "a.ply")
    assert run(capsys, "cluster", "a.ply", "--strokes", "100", "--quiet")[0] == 0
    assert run(capsys, "prune", "a.ply", "--quiet")[0] == 0
    assert bg.load("a-strokes.ply").antialiased
    assert bg.load("a-pruned.ply").antialiased
    load = stages_of(capsys, "render", "a.ply", *SMALL)["load"]
    assert load["did"].endswith(", antialiased")
    assert load["counts"]["training"] == "antialiased"
