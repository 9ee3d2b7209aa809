"""`--explain` says what a painting makes, and why not the rest."""

import json
from pathlib import Path

import numpy as np
import pytest

from brushgs.options.direction import Direction
from brushgs.options.look import Look
from brushgs.options.painting import CleanConfig, ViewConfig
from brushgs.options.sequence import GrowConfig, PathConfig
from brushgs.pipeline.estimate import estimate
from brushgs.pipeline.prepare import PICTURE, STROKES, open_job
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from tests.kit import changed, for_each, names, run, still_life_of

SCENE = still_life_of(1000)
FACTS = {"is_strokes": False, "is_empty": False}


def config_of(look, **steps):
    """The stage takes a third of the time; one job has it."""
    ground = {"stage": False} | steps.pop("ground", {})
    config = changed(Look.open(look).config, cluster={"strokes": 60}, ground=ground)
    return changed(config, view=ViewConfig(size=(64, 48), up="-y"), **steps)


OFF = {"strokes": {"edges": 0.0, "economy": 0.0, "focus": None}, "light": {"key": 0.0}}
JOBS = {
    "oil": (config_of("oil", ground={"stage": True}), {}),
    "all off": (config_of("oil", **OFF), {}),
    "blind": (config_of("oil", strokes={"see": "off", "direction": Direction("own")}), {}),
    "auto": (config_of("plain", cluster={"strokes": "auto"}), {}),
    "for the view": (config_of("oil", cluster={"strokes_for": "view"}, strokes={"depth_of_field": 0.6}), {}),
    "unclean": (config_of("plain", clean=CleanConfig("off")), {"asks": STROKES}),
    "given camera": (config_of("ink"), {"views": still_life_camera(width=64, height=48)}),
    "day": (config_of("watercolour", light={"sun": (0.0, 0.5, 0.1, 0.6)}), {"views": PathConfig(orbit=3)}),
    "grows": (config_of("gouache"), {"views": GrowConfig(1.0)}),
}


@for_each("name", JOBS)
def test_what_is_explained_is_what_is_made(name):
    config, options = JOBS[name]
    job = open_job(SCENE, config, Report(), **({"asks": PICTURE} | options))
    explained = job.explain(FACTS)
    assert not job.seconds, "nothing ran"
    job.run()
    for one in explained:
        if one.runs == "yes":
            assert one.name in job.seconds, one
        elif one.runs == "no":
            assert one.name not in job.seconds, one
            assert one.why == job.skipped.get(one.name, "nothing that runs takes it"), one
    assert sum(one.runs == "undecided" for one in explained) <= 6
    assert {*job.seconds} <= {one.name for one in explained}


def test_what_depends_on_the_scene_is_undecided():
    job = open_job(SCENE, config_of("oil"), Report())
    found = {one.name: one for one in job.explain()}["plain_views"]
    assert (found.runs, found.why) == ("undecided", "decided when cleaned is known")


def test_the_command_prints_and_writes_nothing(scene, folder, capsys):
    code, out, _ = run(capsys, "render", scene, "--explain")
    assert code == 0
    assert "no --palette" in out
    assert f"{len(SCENE):,} Gaussians; " in out
    assert out.endswith("nothing was painted\n")
    out = run(capsys, "render", scene, "--explain", "--json", "--orbit", "8", "--size", "64x48")[1]
    found = json.loads(out)
    assert {"read", "is_path", "painting"} <= {one["name"] for one in found["steps"]}
    assert found["estimate"]["seconds"] > 0.5
    assert found["estimate"]["written"] == pytest.approx(8 * 64 * 48 * 1.5)
    assert names() == []
    # A drawing has every step once.
    assert run(capsys, "render", scene, "--explain", "-o", "graph.svg")[0] == 0
    assert run(capsys, "render", scene, "--explain", "-o", "graph.dot")[0] == 0
    assert Path("graph.svg").read_text().startswith("<svg ")
    assert Path("graph.svg").read_text().count(">plain_views</text>") == 1
    assert Path("graph.dot").read_text().startswith("digraph ")
    assert Path("graph.dot").read_text().count('"plain_views" [') == 1


def test_an_estimate_is_more_for_more():
    steps = open_job(SCENE, config_of("oil"), Report()).explain(FACTS)
    least = estimate(steps, 10**5, 16, (640, 480))
    for more in (
        estimate(steps, 10**6, 16, (640, 480)),
        estimate(steps, 10**5, 16, (640, 480), 24),
        estimate(steps, 10**5, 16, (640, 480), num_strokes=12_000),
        estimate(steps, 10**5, 16, (640, 480), num_threads=1),
    ):
        assert more.seconds > least.seconds
    assert np.isfinite(least.seconds)
    assert least.words.startswith("about ")
    in_strips, whole = (estimate(steps, 10**5, 16, (9000, 9000), most_held=most) for most in (10**7, 10**9))
    assert least.memory < in_strips.memory < whole.memory
