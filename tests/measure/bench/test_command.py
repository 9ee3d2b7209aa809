"""`brushgs bench`: files, table, JSON, and one sentence on bad input."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli.commands import bench
from brushgs.cli.parser import parse
from brushgs.formats.pictures.images import read_image
from brushgs.measure import plotting
from brushgs.measure.bench.look_families import KNOBS
from brushgs.options.experiments import LOOK_FAMILIES, BenchConfig
from tests.kit.commands import names, refused, run
from tests.measure.bench.conftest import SIZES, STOPS
from tests.scenes import save_upright, still_life_of

pytestmark = pytest.mark.usefixtures("few_points")

FAMILIES = ["strokes", "merge", "filter", "precision", "sh", "size"]
SMALL = ["--stroke", "dry_brush", "--size", "64x48", "--repeats", "1", "--strokes", "30"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A scene whose colors depend on the view."""
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    scene = still_life_of(1000)
    sh = np.zeros((len(scene), 4, 3), np.float32)
    sh[:, :1] = scene.sh[:, :1]
    sh[:, 1:] = 0.1 * np.random.default_rng(0).normal(size=(len(scene), 3, 3))
    save_upright(bg.Gaussians(scene.means, scene.quats, scene.scales, scene.opacities, sh), path)
    return path


@pytest.fixture
def scene(made, folder):
    """A scene file; the current folder is empty."""
    return made


def test_the_command_writes_figures_table_and_plot(scene, capsys):
    code, out, err = run(capsys, "bench", scene, *SMALL, "--strokes", "30,90")
    assert (code, out) == (0, "pears-bench\n"), err
    assert names() == ["pears-bench"]
    assert names("pears-bench") == ["bench.csv", "bench.json", "bench.png"]
    height, width, _ = read_image("pears-bench/bench.png").shape
    assert (width, height) == (1122, 924)
    for word in ("number of strokes", "nearest", "float64, none", "64x48", "balanced, cover", "SH degree"):
        assert word in err
    said = next(line for line in err.splitlines() if line.startswith("for this scene "))
    value = json.loads(Path("pears-bench/bench.json").read_text())
    assert (value["schema"], value["brushgs"]) == (3, bg.__version__)
    assert value["settings"]["measure"]["strokes"] == [30, 90]
    assert value["settings"]["draw"]["stroke"] == "dry_brush"
    assert value["settings"]["camera"]["width"] == 64
    assert value["settings"]["machine"]["threads"] >= 1
    found = value["bench"]
    assert [family["name"] for family in found["families"]] == FAMILIES
    assert found["advice"] == said
    assert all(doubt in err for doubt in found["doubts"])
    for bend in ("frame", "painting"):
        assert set(found["knees"][bend]) == {"strokes", "psnr", "gain_of_doubling", "cost_of_doubling"}
    num = {family["name"]: len(family["points"]) for family in found["families"]}
    precision, sizes = 2 * len(STOPS), len(SIZES)
    assert num == {"strokes": 3, "merge": 8, "filter": 3, "precision": precision, "sh": 2, "size": sizes}
    for family in found["families"]:
        check_points(family["points"])
    check_what_is_known(found)

    written = list(csv.DictReader(Path("pears-bench/bench.csv").read_text().splitlines()))
    points = [point for family in found["families"] for point in family["points"]]
    assert [row["label"] for row in written] == [point["label"] for point in points]
    assert [float(row["rmse"]) for row in written] == [point["error"]["rmse"] for point in points]


def check_points(points):
    for kind in points[0]["seconds"]:
        assert any(kind in point["best_by"] for point in points)
    for point in points:
        assert set(point) >= {"label", "series", "value", "error", "seconds", "verified", "strokes"}
        assert point["verified"]["mean"] <= 2e-5
        for spread in point["seconds"].values():
            assert 0 < spread["q1"] <= spread["median"] <= spread["q3"]
            assert spread["runs"] >= 1


def check_what_is_known(found):
    """Signs and ends of the curves that hold on any machine."""
    points = {family["name"]: family["points"] for family in found["families"]}
    strokes = points["strokes"]
    assert [point["strokes"] for point in strokes[:-1]] == [30, 90]
    assert strokes[-1]["strokes"] == 792  # one per Gaussian that is kept
    assert strokes[-1]["error"]["rmse"] < strokes[0]["error"]["rmse"]
    assert all(0 <= point["unpainted"] <= 1 and 0 < point["error"]["flip"] < 1 for point in strokes)
    assert all(set(point["seconds"]) == {"frame", "painting"} for point in strokes)
    # Clustering alone: what remains with all Gaussians is what pruning takes, and no brush is in it.
    assert strokes[-1]["clustering"] < 0.5 * strokes[-1]["error"]["rmse"] < strokes[0]["clustering"]
    assert all(point["held_out"] > 0 for point in strokes)
    assert strokes[-1]["held_out"] < strokes[0]["held_out"]
    assert all(point["seconds"]["painting"]["q3"] > point["seconds"]["frame"]["q1"] for point in strokes)
    assert {point["strokes"] for point in points["merge"]} <= {29, 30, 89, 90}
    errors = {point["label"]: point["error"]["rmse"] for point in points["filter"]}
    assert errors["mip"] < errors["bilinear"]
    exact = points["precision"][-1]
    assert (exact["label"], exact["value"]) == ("float64, none", 0)
    assert exact["error"]["largest"] < 1e-10
    single = [point["error"]["rmse"] for point in points["precision"][: len(STOPS)]]
    assert single == sorted(single, reverse=True)
    assert points["sh"][-1]["error"]["rmse"] == 0
    assert points["sh"][-1]["error"]["psnr"] is None
    assert points["sh"][0]["error"]["rmse"] > 0
    assert points["size"][0]["error"]["rmse"] > points["size"][-1]["error"]["rmse"]


def test_json_on_stdout_is_what_is_written(scene, capsys, monkeypatch):
    monkeypatch.setattr("brushgs.measure.bench.look_families.KNOBS", KNOBS[:1])
    words = [*SMALL, "--order", "soft", "--azimuth", "30", "--see", "off", "--json", "-o", "all.json"]
    words += ["--families", "filter,precision,knobs"]
    code, out, err = run(capsys, "bench", scene, *words)
    assert (code, err, names()) == (0, "", ["all.json"])
    found = json.loads(out)["bench"]
    assert found == json.loads(Path("all.json").read_text())["bench"]
    assert [family["name"] for family in found["families"]] == ["filter", "precision", "knobs"]
    assert found["advice"] is None
    precision = found["families"][1]  # the soft order is held to its own definition
    assert "16x12" in precision["title"]  # drawn at a quarter: the definition goes pixel by pixel
    assert precision["points"][-1]["error"]["largest"] < 1e-10


@pytest.mark.usefixtures("folder")
def test_a_family_that_does_not_apply_is_skipped_with_the_reason(capsys):
    flat = still_life_of(1000)
    bg.save(replace(flat, sh=flat.sh[:, :1].copy()), "flat.ply")
    words = ["bench", "flat.ply", *SMALL, "--stroke", "gaussian", "--strokes", "5000", "--no-plot", "--json"]
    code, out, err = run(capsys, *words, "--families", "merge,filter,sh,strokes")
    assert (code, err) == (0, "")
    value = json.loads(out)
    left = {stage["name"]: stage["skipped"] for stage in value["stages"]}
    assert left["merge"] == ["the whole family: 1,131 Gaussians: nothing to merge"]
    assert left["filter"] == ["the whole family: a kernel is computed, not sampled"]
    assert left["sh"] == ["the whole family: the scene has degree 0 only"]
    assert [family["name"] for family in value["bench"]["families"]] == ["strokes"]
    assert value["bench"]["advice"] is None  # one count has no knee
    assert names("flat-bench") == ["bench.csv", "bench.json"]


def configs(*words):
    return bench.configs(parse(["bench", "a.ply", *words]))


def test_quick_takes_fewer_counts_and_repeats_and_a_smaller_picture_where_no_flag_wins():
    (paint, full), (small, quick) = configs(), configs("--quick")
    assert (full, quick) == (BenchConfig(), BenchConfig.quick())
    assert (paint.view.size, small.view.size) == (None, (640, 360))
    assert len(quick.strokes) < len(full.strokes)
    assert quick.repeats < full.repeats
    assert quick.families_of(has_look=False) == full.families_of(has_look=False) == tuple(FAMILIES)
    assert full.families_of(has_look=True) == LOOK_FAMILIES
    paint, config = configs("--quick", "--repeats", "9", "--strokes", "10,20", "--size", "32x24")
    assert (config.repeats, config.strokes, paint.view.size) == (9, (10, 20), (32, 24))
    assert configs("--quick", "--camera-file", "c.json")[0].view.size is None
    assert configs("--merge", "paper")[0].cluster.merge == "paper"
    assert configs("--look", "oil")[0].view.size == "auto"  # the picture that `render` paints
    assert configs("--look", "oil", "--quick")[0].view.size == (640, 360)


def test_the_plot_needs_matplotlib_and_the_figures_do_not(scene, capsys, monkeypatch):
    words = ["bench", scene, *SMALL, "--families", "filter", "--quiet"]
    assert run(capsys, *words, "-o", "one.png") == (0, "", "")
    assert names() == ["one.png"]
    monkeypatch.setattr(plotting, "find_spec", lambda name: None)
    note = "pears-bench/bench.png is skipped: it needs matplotlib, which is not installed; pip install "
    for more, notes in (([], [note + "matplotlib"]), (["--no-plot"], [])):
        assert run(capsys, *words, "-o", "pears-bench", *more) == (0, "", "")
        assert names("pears-bench") == ["bench.csv", "bench.json"]
        assert json.loads(Path("pears-bench/bench.json").read_text())["notes"] == notes


def test_strokes_in_a_file_are_all_kept_as_render_keeps_them(scene, capsys):
    assert run(capsys, "cluster", scene, "--strokes", "120", "-o", "strokes.ply", "--quiet")[0] == 0
    words = ["strokes.ply", *SMALL, "--families", "strokes", "--no-plot", "--json", "-o", "bench.json"]
    code, out, err = run(capsys, "bench", *words)
    assert (code, err) == (0, "")
    points = json.loads(out)["bench"]["families"][0]["points"]
    assert points[-1]["strokes"] == len(bg.load("strokes.ply"))


def test_bad_input_is_one_sentence_and_leaves_nothing(scene, capsys):
    for words, match in (
        (["--families", "speed"], "families must be among strokes, merge, filter, precision, sh, size, "),
        (["--families", ""], "families must be among strokes"),
        (["--strokes", "10,x"], "--strokes must be a whole number of 1 or more, got 'x'"),
        (["--strokes", "20,10"], "strokes must ascend from 1 or more, got 20, 10"),
        (["-o", "report.pdf"], "output must be a folder or end in .json, .csv, .png, got 'report.pdf'"),
        (["--background", "transparent"], "background must be a color or an image"),
        (["--background", "blu"], "background must be"),
        (["--camera-file", "none.json", "--up", "+z"], "--up cannot be combined with --camera-file"),
        (["--orbit", "9"], "unrecognized arguments: --orbit 9"),
        *(
            (["--look", "oil", "--families", f"strokes,{family}"], f"families must not have {family} in a")
            for family in ("merge", "filter", "precision", "sh")
        ),
    ):
        assert match in refused(capsys, "bench", scene, *SMALL, *words)
    assert names() == []
