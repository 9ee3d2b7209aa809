"""`brushgs bench --look`: whole paintings against themselves at their limit."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.cli.commands import bench
from brushgs.cli.parser import parse
from brushgs.measure.bench.knobs import KNOBS, Knob
from brushgs.measure.bench.look_families import AS_IT_IS, plan_look_families
from brushgs.measure.bench.look_subject import (
    LookSubject,
    Picture,
    has_look,
    num_views_of,
)
from brushgs.measure.bench.measure import measure
from brushgs.measure.bench.verify import WrongPictureError
from brushgs.options.choices import LOOKS
from brushgs.options.experiments import LOOK_FAMILIES, BenchConfig
from brushgs.options.look import Look
from brushgs.options.painting import STEPS, PaintConfig, StrokesConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint
from tests.scenes import save_upright, still_life_of

pytestmark = pytest.mark.usefixtures("few_points")

# A side that is named, and no views: most of the time of a small painting goes there.
FAST = ["--azimuth", "30", "--see", "off"]
SMALL = [*FAST, "--size", "64x48", "--repeats", "1", "--strokes", "30", "--no-plot"]
BLIND = StrokesConfig(see="off")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    save_upright(still_life_of(1000), path)
    return path


@pytest.fixture
def scene(made, tmp_path, monkeypatch):
    """A scene file; the current folder is empty."""
    monkeypatch.chdir(tmp_path)
    return str(made)


def subject_of(path, look="oil", size=(64, 48), has_stage=False, **options):
    """A painting that is ready to be measured."""
    config = Look.open(look).config
    ground = replace(config.ground, stage=has_stage and config.ground.stage)
    config = replace(config, view=ViewConfig(size=size, azimuth=0.5), ground=ground, **options)
    few = BenchConfig(strokes=(30,), count=60, repeats=1)
    return LookSubject.open(SceneSource.of(path), config, few, Report())


def run(capsys, *words):
    """Exit code, stdout and stderr of one command."""
    code = cli.main(["bench", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_look_has_a_curve_whose_errors_fall_with_strokes(scene, capsys):
    words = [
        scene,
        "--look",
        "oil",
        *SMALL,
        "--backdrop",
        "off",
        "--families",
        "strokes,size",
        "--strokes",
        "30,120",
        "--json",
        "-o",
        "b",
    ]
    code, out, err = run(capsys, *words)
    assert (code, err) == (0, "")
    assert sorted(path.name for path in Path("b").iterdir()) == ["bench.csv", "bench.json"]
    value = json.loads(out)
    assert value["settings"]["light"]["canvas"] == "linen"  # what is painted is told
    points = {family["name"]: family["points"] for family in value["bench"]["families"]}
    strokes, sizes = points["strokes"], points["size"]
    errors = [point["error"]["rmse"] for point in strokes]
    assert errors == sorted(errors, reverse=True)
    assert 0 < errors[-1] < 0.5 * errors[0]  # samples and views are left
    held_out = [point["held_out"] for point in strokes]
    assert held_out == sorted(held_out, reverse=True)
    assert [point["strokes"] for point in strokes] == sorted(point["strokes"] for point in strokes)
    assert sizes[0]["error"]["rmse"] > sizes[-1]["error"]["rmse"]
    for point in (*strokes, *sizes):
        assert point["verified"]["against"] == "the whole painting in float64"
        assert point["verified"]["mean"] <= 2e-5
        assert point["unpainted"] is point["clustering"] is None
    for point in strokes:
        assert point["seconds"]["painting"]["median"] > point["seconds"]["frame"]["median"]
    assert set(value["bench"]["knees"]) == {"frame", "painting"}


@pytest.mark.parametrize("family", ["merge", "filter", "precision", "sh"])
def test_families_of_bare_strokes_are_refused_in_a_look(scene, capsys, family):
    code, out, err = run(capsys, scene, "--look", "oil", "--families", f"strokes,{family}")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"families must not have {family} in a look" in err
    assert "a look has strokes, size, views, knobs" in err
    assert list(Path().iterdir()) == []


def test_all_families_of_a_look_are_its_default():
    assert BenchConfig().families_of(has_look=True) == LOOK_FAMILIES
    assert BenchConfig(families=("views",)).families_of(has_look=False) == ("views",)


@pytest.mark.parametrize("look", LOOKS)
def test_only_plain_is_bare(look):
    assert has_look(Look.open(look).config) == (look != "plain")
    assert has_look(bench.configs(parse(["bench", "a.ply", "--look", look]))[0]) == (look != "plain")


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ([], False),
        (["--stroke", "flat,dab"], False),
        (["--broken-color", "0", "--size", "40x30"], False),
        (["--relief", "0.4"], True),
        (["--backdrop", "stage"], True),
        (["--palette", "a.png"], True),
        (["--where", "subject"], True),
        (["--edges", "0.5"], True),
    ],
)
def test_what_bare_strokes_do_not_have_is_painted_whole(words, found):
    assert has_look(bench.configs(parse(["bench", "a.ply", *words]))[0]) == found


@pytest.mark.parametrize("look", ["oil", "watercolour", "ink"])
def test_what_is_measured_is_what_is_painted(made, look):
    subject = subject_of(made, look, has_stage=True, strokes=BLIND)
    frame = subject.picture.frame()
    same = paint(str(made), subject.paint, is_on_background=True)
    np.testing.assert_array_equal(frame.rgb, same.rgb)
    np.testing.assert_array_equal(frame.alpha, same.alpha)
    assert subject.picture.verified("a", frame).mean < 1e-6


def test_a_composed_picture_keeps_its_view_when_a_knob_is_turned(made):
    subject = subject_of(made, size="auto", has_stage=True, strokes=BLIND)
    assert isinstance(subject.paint.view.size, tuple)
    for value in (False, True):
        changed = Knob("stage", "ground", (False, True)).at(subject.paint, value)
        np.testing.assert_array_equal(subject.made(changed).camera.viewmat, subject.camera.viewmat)


def test_views_are_fewer_or_more_and_the_usual_ones_come_nearest(made):
    subject = subject_of(made, size=(32, 24))
    plan = plan_look_families(subject, ("views",))["views"]
    assert (subject.num_views, plan.truth) == (14, "26 views")
    assert num_views_of(subject.made(subject.paint, change_views=subject.more_views)) == 26
    trials = list(plan.trials())
    assert [trial.label for trial in trials] == ["0 views", "1 view", "4 views", "14 views"]
    errors = [trial.error.rmse for trial in trials]
    assert errors == sorted(errors, reverse=True)


def measured(subject, *names):
    return measure(replace(subject, config=replace(subject.config, families=names)), Report())


def test_every_knob_is_turned_to_what_the_painting_has_not(made, monkeypatch):
    subject = subject_of(made, has_stage=True, strokes=BLIND)
    few = tuple(knob for knob in KNOBS if knob.name in ("stage", "relief"))
    monkeypatch.setattr("brushgs.measure.bench.look_families.KNOBS", few)
    points = measured(subject, "knobs")["knobs"].points
    assert [point.label for point in points] == [AS_IT_IS, "stage off", "relief 0", "relief 1"]
    errors = {point.label: point.error.rmse for point in points}
    assert errors[AS_IT_IS] == 0
    assert errors["relief 0"] > 0
    assert errors["stage off"] > 0


@pytest.mark.parametrize("knob", KNOBS, ids=lambda knob: knob.name)
def test_knobs_are_fields_of_paintings(knob):
    bare = PaintConfig()
    assert knob.step in STEPS
    for value in knob.values:
        assert knob.of(knob.at(bare, value)) == value
        assert knob.label(value).startswith(f"{knob.name} ")
    assert knob.of(bare) not in knob.others(bare)


def test_knobs_are_measured_of_bare_strokes_too(scene, capsys, monkeypatch):
    monkeypatch.setattr("brushgs.measure.bench.look_families.KNOBS", KNOBS[:1])
    words = [scene, *SMALL, "--stroke", "flat", "--families", "filter,knobs", "--json", "-o", "a.json"]
    code, out, _ = run(capsys, *words)
    assert code == 0
    families = json.loads(out)["bench"]["families"]
    assert [family["name"] for family in families] == ["filter", "knobs"]


def test_a_painting_that_differs_from_its_float64_ends_the_bench(made, monkeypatch):
    subject, true = subject_of(made, strokes=BLIND), Picture.frame

    def wrong(picture):
        frame = true(picture)
        return replace(frame, rgb=frame.rgb * np.float32(0.99))

    monkeypatch.setattr(Picture, "frame", wrong)
    with pytest.raises(WrongPictureError, match=r"size 16x12 paints another picture than the whole painting"):
        measured(subject, "size")


def test_a_scene_that_sees_nothing_has_no_family_of_views(made):
    subject = subject_of(made, strokes=BLIND)
    plan = plan_look_families(subject, ("views",))["views"]
    assert plan.skip_reason == "strokes are made by the scene alone (--see off)"


def test_a_scene_of_one_gaussian_is_measured(tmp_path):
    count = 1
    path = tmp_path / "few.ply"
    save_upright(
        bg.Gaussians(
            np.zeros((count, 3), np.float32),
            np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
            np.full((count, 3), 0.3, np.float32),
            np.full(count, 0.9, np.float32),
            np.zeros((count, 1, 3), np.float32),
        ),
        path,
    )
    found = measured(subject_of(path, size=(32, 24), strokes=BLIND), "strokes")["strokes"].points
    assert [point.strokes for point in found] == [count]
    assert np.isfinite(found[0].error.rmse)
