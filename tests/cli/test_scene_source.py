"""Several files, folders and levels of detail on the command line."""

import importlib
import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from tests.io.ply_maker import scene_columns, write_scene
from tests.scenes import still_life_of

SMALL = ["--stroke", "gaussian", "--size", "32x24", "--quiet"]


@pytest.fixture
def tiles(tmp_path, monkeypatch):
    """A scene in two files of the folder `tiles`, and whole beside it."""
    monkeypatch.chdir(tmp_path)
    scene = still_life_of(2000)
    Path("tiles").mkdir()
    bg.save(scene.take(slice(0, 900)), "tiles/a.ply")
    bg.save(scene.take(slice(900, None)), "tiles/b.ply")
    bg.save(scene, "whole.ply")
    return Path("tiles")


def run(capsys, *words):
    code = main(list(map(str, words)))
    out, err = capsys.readouterr()
    return code, out, err


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


@pytest.mark.parametrize("command", CALLS)
def test_every_command_takes_several_files_a_level_and_a_moment(tiles, capsys, monkeypatch, command):
    if command == "refine":
        pytest.importorskip("torch", reason="needs the extra [refine]")
    seen = []

    def watch(scene, *args, **options):
        seen.append(scene)
        return {}

    monkeypatch.setattr(importlib.import_module(CALLS[command][0]), CALLS[command][1], watch)
    rate = "--moments-per-second", "12.5"
    more = ["--palette", "p.png"] if command == "recolor" else []
    code, _, err = run(capsys, command, "tiles", "c.ply", "--lod", "2", "--time", "40%", *rate, *more)
    source = SceneSource((Path("tiles"), Path("c.ply")), 2, Moment(0.4, is_share=True), 12.5)
    assert (code, seen) == (0, [source]), err


@pytest.mark.parametrize("command", ["info", "doctor"])
def test_a_level_of_files_without_levels_is_refused(tiles, capsys, command):
    code, _, err = run(capsys, command, "tiles", "--lod", "0")
    assert code == 2
    assert "a.ply: is a PLY file, which has no levels of detail; omit the level (lod)" in err


def test_a_file_in_the_folder_of_the_scene_is_not_replaced(tiles, capsys):
    before = (tiles / "b.ply").read_bytes()
    for command in (["prune"], ["cluster"], ["doctor"]):
        output = ["--fix" if command == ["doctor"] else "-o", "tiles/b.ply"]
        code, _, err = run(capsys, *command, "tiles", *output)
        assert code == 2
        assert "is the input, which is never overwritten; choose another name" in err
    assert (tiles / "b.ply").read_bytes() == before


def test_a_folder_without_a_scene_gets_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    code, _, err = run(capsys, "render", "empty/")
    assert code == 2
    assert err.startswith("brushgs: empty: is an empty folder: it should hold .ply")
    assert err.count("\n") == 1


# What the load stage says


def load_stage(capsys, *words):
    code, out, err = run(capsys, "render", *words, "--json", *SMALL[:-1])
    assert code == 0, err
    return next(stage for stage in json.loads(out)["stages"] if stage["name"] == "load")


def test_columns_that_are_not_read_are_named_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    extra = {name: np.zeros(200, np.float32) for name in ("segment", "label")}
    write_scene(Path("a.ply"), scene_columns(200) | extra)
    stage = load_stage(capsys, "a.ply")
    assert stage["did"].endswith("; 2 columns not read: segment, label")
    assert stage["counts"]["columns_not_read"] == ["segment", "label"]
    many = {f"c{n}": np.zeros(200, np.float32) for n in range(9)}
    write_scene(Path("b.ply"), scene_columns(200) | many)
    assert load_stage(capsys, "b.ply")["did"].endswith("; 9 columns not read: c0, c1, c2, c3, c4, c5, ...")
    write_scene(Path("c.ply"), scene_columns(200))
    assert "not read" not in load_stage(capsys, "c.ply")["did"]


def test_names_of_columns_cannot_steer_the_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_scene(Path("a.ply"), scene_columns(200) | {"\x1b[31mred": np.zeros(200, np.float32)})
    assert load_stage(capsys, "a.ply")["did"].endswith("; 1 column not read: ?[31mred")
    assert "\x1b" not in run(capsys, "info", "a.ply")[1]


def test_the_training_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bg.save(replace(still_life_of(1000), antialiased=True), "a.ply")
    stage = load_stage(capsys, "a.ply")
    assert stage["did"].endswith(", antialiased")
    assert stage["counts"]["training"] == "antialiased"
    columns = {name: values for name, values in scene_columns(200).items() if name != "scale_2"}
    write_scene(Path("b.ply"), columns)
    assert load_stage(capsys, "b.ply")["did"].endswith(", 2DGS, flat discs")
    assert "training         2dgs" in run(capsys, "info", "b.ply")[1]


def test_strokes_of_an_antialiased_scene_keep_it_in_their_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bg.save(replace(still_life_of(2000), antialiased=True), "a.ply")
    assert run(capsys, "cluster", "a.ply", "--strokes", "100", "--quiet")[0] == 0
    assert run(capsys, "prune", "a.ply", "--quiet")[0] == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert bg.load("a-strokes.ply").antialiased
        assert bg.load("a-pruned.ply").antialiased
