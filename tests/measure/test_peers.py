"""`brushgs bench --peers`: two peers end to end, formulas beside slow ones, and its refusals."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli.commands import bench
from brushgs.measure.likeness import rmse
from brushgs.options.painting import ViewConfig
from brushgs.options.scene_source import SceneSource
from examples.benchmarks.peers import columns, run
from examples.benchmarks.peers.figures import COLUMNS, cells, reasons
from examples.benchmarks.peers.search import search_boxes
from tests.kit.commands import names, refused

RNG = np.random.default_rng(5)


def test_two_peers_end_to_end(scene, tmp_path):
    ask = run.Ask(ViewConfig(size=(64, 48)), (40,), rounds=1, names=("plain look", "Hertzmann"))
    report = run.PeersReport()
    run.report_peers(SceneSource((scene,)), tmp_path / "out", ask, report=report)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["peers.json", "peers.png"]
    value = json.loads((tmp_path / "out" / "peers.json").read_text())
    assert (value["schema"], value["peers"]["style"], value["peers"]["scene"]) == (1, "night", "pears")
    plain, look, painter = value["peers"]["rows"]
    assert [row["peer"] for row in (plain, look, painter)] == ["plain scene", "plain look", "Hertzmann"]
    assert (look["strokes"], look["flips"], plain["strokes"]) == (40, 0, None)
    assert 1 <= painter["strokes"] <= 40
    assert plain["short_range"] < look["short_range"] < painter["short_range"]
    for row in (plain, look, painter):
        assert row["seconds"] > 0
        assert row["processor"] > 0
        assert row["memory_mb"] > 20
        # A figure is there, or a reason why it is not.
        assert {name for name, _ in COLUMNS.values() if row[name] is None} == set(row["why"])
        assert cells(row).count("-") == len(row["why"])
    assert "Hertzmann: no flips: " + run.NOT_LASTING in reasons([plain, look, painter])


def test_the_histogram_is_the_published_formula_pixel_by_pixel():
    picture = RNG.uniform(0.05, 1, (3, 4, 3))
    bins = np.linspace(-3, 3, 64)
    expected = np.zeros((3, 64, 64))
    for pixel in picture.reshape(-1, 3):
        for channel, (a, b) in enumerate(((1, 2), (0, 2), (0, 1))):
            u, v = (np.log(pixel[channel] + 1e-6) - np.log(pixel[other] + 1e-6) for other in (a, b))
            k_u, k_v = (1 / (1 + (np.abs(x - bins) / 0.02) ** 2) for x in (u, v))
            expected[channel] += np.linalg.norm(pixel) * np.outer(k_u, k_v)
    found = columns.color_histogram(picture)
    np.testing.assert_allclose(found, expected / expected.sum(), rtol=1e-9)
    assert columns.histogram_loss(found, found) == 0
    apart = np.zeros((2, 3, 64, 64))
    apart[0, 0, 0, 0] = apart[1, 2, 9, 9] = 1
    assert columns.histogram_loss(*apart) == 1


def test_structure_knows_marks_from_colors_and_ranks_the_nearest_first():
    y, x = np.mgrid[:96, :128]
    across, along = (np.repeat(0.5 + 0.3 * np.sin(c / 2.0)[..., None], 3, axis=2) for c in (x, y))
    tinted = np.clip(across * [0.9, 0.7, 0.5], 0, 1)
    marks = {name: columns.structure(each) for name, each in (("across", across), ("along", along))}
    own = columns.structure(tinted)
    assert columns.structure_distance(own, own) == 0
    near, far = (columns.structure_distance(own, marks[name]) for name in ("across", "along"))
    assert near < 0.3 * far
    assert [columns.blind_rank(own, marks, name) for name in ("across", "along")] == [1, 2]
    colored = {"grey": across, "tinted": np.clip(along * [0.9, 0.7, 0.5], 0, 1)}
    found = {name: columns.color_structure(each) for name, each in colored.items()}
    assert columns.blind_rank(columns.color_structure(tinted), found, "tinted") == 1  # colors outweigh marks


def test_the_value_gap_is_that_of_a_body_against_what_surrounds_the_scene():
    picture = np.full((160, 160, 3), 0.2)
    body, ground = np.zeros((2, 160, 160), bool)
    body[20:140, 40:120], ground[100:, 20:140] = True, True
    picture[ground], picture[body] = 0.9, 0.6
    found = columns.value_gap(picture, body, body | ground)
    assert found == pytest.approx(63.22 - 21.25, abs=0.01)  # L* of the greys 0.6 and 0.2
    picture[120:140, 40:120] = 0.0  # its foot stands before the ground
    picture[17:23, 40:120] = 0.0  # a contour
    assert columns.value_gap(picture, body, body | ground) == found
    assert columns.value_gap(picture, np.zeros_like(body), ground) is None
    assert columns.value_gap(picture, body, np.ones_like(body)) is None


def test_nearness_is_of_the_subject_alone():
    plain = RNG.uniform(size=(30, 40, 3))
    alpha = np.zeros((30, 40))
    alpha[5:25, 8:32] = 1
    stage = np.where(alpha[..., None] > 0, plain, 0)
    assert columns.nearness(stage, plain, alpha) == (np.inf, pytest.approx(1))
    assert columns.nearness(np.clip(stage + 0.1, 0, 2), plain, alpha)[0] == pytest.approx(20)


def test_the_search_comes_nearer_with_more_strokes_and_repeats_itself():
    y, x = np.mgrid[:60, :80] / 60.0
    picture = np.stack([x / 1.4, y, (np.hypot(x - 0.6, y - 0.5) < 0.3) * 0.8], axis=2)
    brush = bg.StrokeTexture.open("flat")
    errors = []
    for count in (20, 200):
        boxes, again = (search_boxes(picture, brush, num_strokes=count) for _ in range(2))
        assert 0 < len(boxes) <= count
        assert boxes.centers.tobytes() == again.centers.tobytes()
        painted = bg.rasterize(boxes, brush, height=60, width=80, depth=False).over((1, 1, 1))
        errors.append(rmse(painted, picture))
    assert errors[1] < 0.6 * errors[0]
    with pytest.raises(ValueError, match="num_strokes must be at least 1, got 0"):
        search_boxes(picture, brush, num_strokes=0)


@pytest.mark.usefixtures("folder")
def test_refusals_are_sentences(scene, monkeypatch, capsys):
    words = ["bench", scene, "--size", "64x48", "--strokes", "40", "--quick"]
    for more, sentence in (
        (["--im2oil", "."], "--im2oil needs --peers"),
        (["--peers-style", "a.png"], "--peers-style needs --peers"),
        (["--peers", "--im2oil", "."], "has no Oil-Painting.py"),
        (["--peers", "--peers-style", "no.png"], "no.png"),
    ):
        assert sentence in refused(capsys, *words, *more)
    assert names() == []
    assert "scene" in refused(capsys, "bench")
    monkeypatch.setattr(bench, "PEERS", "examples.benchmarks.nowhere")
    assert "which is in the repository, not in the package" in refused(capsys, "bench", "--peers")
