"""Composed stills: said in the report, given again by its flags, and the same for the strokes of a scene."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.outlets.passes import cluster_file
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_file
from tests.kit import BLIND, changed, save_upright, stages, without_look, write_cameras
from tests.passes.reduce.test_crumbs import block, smears

CONFIG = changed(without_look("ellipse", 200, "auto", strokes=BLIND), draw={"threads": 1})


@pytest.fixture(scope="module")
def statue(tmp_path_factory):
    """A tall box with smears below it, upright for the header of the file, which says -y."""
    scene = bg.Gaussians.joined([block(), smears()])
    means = scene.means[:, [0, 2, 1]] * np.array([0.6, -2, 0.6], np.float32)
    scales = scene.scales[:, [0, 2, 1]] * np.array([0.6, 2, 0.6], np.float32)
    path = tmp_path_factory.mktemp("composed") / "statue.ply"
    save_upright(replace(scene, means=means, scales=scales), path)
    return path


def test_a_composed_still_is_given_again_by_its_flags_and_by_its_strokes(statue, tmp_path):
    report = paint_file(statue, tmp_path / "a.png", CONFIG)
    camera = stages(report)["camera"]
    assert camera.did.startswith("composed as a portrait: --size 784x1176 --up -y")
    assert camera.counts["is_composed"]
    assert read_image(tmp_path / "a.png").shape[:2] == (1176, 784)
    words = ["--look=plain", "--strokes=200", "--stroke=ellipse", "--see=off", "--threads=1", "--quiet"]
    words += ["--no-metadata", "-o", str(tmp_path / "b.png")]
    for view in (camera.counts["flags"].split(), [], ["--size", "auto"]):
        assert main(["render", str(statue), *words, *view]) == 0
        assert (tmp_path / "b.png").read_bytes() == (tmp_path / "a.png").read_bytes()
    strokes = tmp_path / "strokes.ply"
    cluster_file(statue, strokes, replace(CONFIG, view=ViewConfig()), Report())
    again = stages(paint_file(strokes, tmp_path / "e.png", CONFIG))
    assert again["camera"].counts == camera.counts
    assert "crumbs" not in again


def test_another_lamp_keeps_the_composition(statue):
    def picture(**light):
        config = changed(CONFIG, light=light, ground={"stage": True, "shadow": 1.0})
        camera = prepare(statue, config, Report(), asks=["cameras"]).camera
        return camera.width, camera.height, *camera.viewmat.ravel()

    for light in ({"lamp": (0.3, 0.2)}, {"lamp": (3.0, 0.2)}, {"sun": (0.3, 0.2)}):
        assert picture(**light) == picture(), light


def test_crumbs_are_dropped_as_clean_says(statue):
    def dropped(floaters):
        report = Report()
        prepare(statue, changed(CONFIG, clean={"floaters": floaters}), report, asks=["scene"])
        return stages(report).get("crumbs")

    found = dropped("sure")
    assert found is not None
    assert found.counts == {"before": 4012, "after": 4000}
    assert found.did.startswith("12 that hang below the object dropped")
    assert dropped("strong") is not None
    assert dropped("floaters") is None
    assert dropped("off") is None


def test_films_and_given_cameras_keep_their_sizes(statue, tmp_path):
    film = prepare(statue, CONFIG, Report(), views=PathConfig(orbit=4), asks=["cameras"])
    assert {(camera.width, camera.height) for camera in film.cameras} == {(1280, 720)}
    camera = bg.Camera.look_at((0, -1.5, -6), (0, -1.5, 0), width=40, height=30)
    assert prepare(statue, CONFIG, Report(), views=camera, asks=["cameras"]).camera.width == 40
    of_file = changed(CONFIG, view={"camera_file": write_cameras(tmp_path / "cameras.json", [camera])})
    assert prepare(statue, of_file, Report(), asks=["cameras"]).camera.width == 40
