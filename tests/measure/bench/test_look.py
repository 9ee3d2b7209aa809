"""`brushgs bench --look`: whole paintings against themselves at their limit."""

import json
from dataclasses import replace

import numpy as np
import pytest

from brushgs.cli.commands import bench
from brushgs.cli.parser import parse
from brushgs.measure.bench.look_families import AS_IT_IS, KNOBS, Knob, plan_look_families
from brushgs.measure.bench.look_subject import LookSubject, Picture, has_look, num_views_of
from brushgs.measure.bench.run import measure
from brushgs.measure.bench.verify import WrongPictureError
from brushgs.options.choices import LOOKS
from brushgs.options.experiments import BenchConfig
from brushgs.options.look import Look
from brushgs.options.painting import STEPS, PaintConfig, StrokesConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint
from tests.kit.commands import names, run
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of

pytestmark = pytest.mark.usefixtures("few_points")

BLIND = StrokesConfig(see="off")


def subject_of(path, look="oil", size=(64, 48), has_stage=False, **options):
    """A painting that is ready to be measured."""
    config = Look.open(look).config
    ground = replace(config.ground, stage=has_stage and config.ground.stage)
    config = replace(config, view=ViewConfig(size=size, azimuth=0.5), ground=ground, **options)
    few = BenchConfig(strokes=(30,), count=60, repeats=1)
    return LookSubject.open(SceneSource.of(path), config, few, Report())


@pytest.mark.usefixtures("folder")
def test_a_look_has_a_curve_whose_errors_fall_with_strokes(scene, capsys):
    words = ["--azimuth", "30", "--see", "off", "--size", "64x48", "--repeats", "1", "--strokes", "30,120"]
    words += ["--look", "oil", "--backdrop", "off", "--families", "strokes,size", "--no-plot", "--json"]
    code, out, err = run(capsys, "bench", scene, *words, "-o", "b")
    assert (code, err, names("b")) == (0, "", ["bench.csv", "bench.json"])
    value = json.loads(out)
    assert value["settings"]["light"]["canvas"] == "linen"  # what is painted is told
    points = {family["name"]: family["points"] for family in value["bench"]["families"]}
    strokes, sizes = points["strokes"], points["size"]
    errors = [point["error"]["rmse"] for point in strokes]
    for values in (
        errors,
        [point["held_out"] for point in strokes],
        [-point["strokes"] for point in strokes],
    ):
        assert values == sorted(values, reverse=True)
    assert 0 < errors[-1] < 0.5 * errors[0]  # samples and views are left
    assert sizes[0]["error"]["rmse"] > sizes[-1]["error"]["rmse"]
    for point in (*strokes, *sizes):
        assert point["verified"]["against"] == "the whole painting in float64"
        assert point["verified"]["mean"] <= 2e-5
        assert point["unpainted"] is point["clustering"] is None
    for point in strokes:
        assert point["seconds"]["painting"]["median"] > point["seconds"]["frame"]["median"]
    assert set(value["bench"]["knees"]) == {"frame", "painting"}


@for_each(
    ("words", "found"),
    [
        *((["--look", look], look != "plain") for look in LOOKS),
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


@for_each("look", ["watercolour", "ink"])
def test_what_is_measured_is_what_is_painted(scene, look):
    subject = subject_of(scene, look, has_stage=True, strokes=BLIND)
    frame = subject.picture.frame()
    same = paint(str(scene), subject.paint, is_on_background=True)
    np.testing.assert_array_equal(frame.rgb, same.rgb)
    np.testing.assert_array_equal(frame.alpha, same.alpha)
    assert subject.picture.verified("a", frame).mean < 1e-6


def test_a_composed_picture_keeps_its_view_when_a_knob_is_turned(scene):
    subject = subject_of(scene, size="auto", has_stage=True, strokes=BLIND)
    assert isinstance(subject.paint.view.size, tuple)
    for value in (False, True):
        changed = Knob("stage", "ground", (False, True)).at(subject.paint, value)
        np.testing.assert_array_equal(subject.made(changed).camera.viewmat, subject.camera.viewmat)


def test_views_are_fewer_or_more_and_the_usual_ones_come_nearest(scene):
    subject = subject_of(scene, size=(32, 24))
    plan = plan_look_families(subject, ("views",))["views"]
    assert (subject.num_views, plan.truth) == (14, "26 views")
    assert num_views_of(subject.made(subject.paint, change_views=subject.more_views)) == 26
    trials = list(plan.trials())
    assert [trial.label for trial in trials] == ["0 views", "1 view", "4 views", "14 views"]
    errors = [trial.error.rmse for trial in trials]
    assert errors == sorted(errors, reverse=True)


def measured(subject, *names):
    return measure(replace(subject, config=replace(subject.config, families=names)), Report())


def test_every_knob_is_turned_to_what_the_painting_has_not(scene, monkeypatch):
    subject = subject_of(scene, has_stage=True, strokes=BLIND)
    few = tuple(knob for knob in KNOBS if knob.name == "relief")
    monkeypatch.setattr("brushgs.measure.bench.look_families.KNOBS", few)
    bare = PaintConfig()
    for knob in KNOBS:
        assert knob.step in STEPS
        assert [knob.of(knob.at(bare, value)) for value in knob.values] == list(knob.values)
        assert knob.of(bare) not in knob.others(bare)
        assert all(knob.label(value).startswith(f"{knob.name} ") for value in knob.values)
    assert [Knob("stage", "ground").label(value) for value in (True, False)] == ["stage on", "stage off"]
    points = measured(subject, "knobs")["knobs"].points
    assert [point.label for point in points] == [AS_IT_IS, "relief 0", "relief 1"]
    errors = {point.label: point.error.rmse for point in points}
    assert errors[AS_IT_IS] == 0
    assert errors["relief 0"] > 0


def test_a_painting_that_differs_from_its_float64_ends_the_bench(scene, monkeypatch):
    subject, true = subject_of(scene, strokes=BLIND), Picture.frame

    def wrong(picture):
        frame = true(picture)
        return replace(frame, rgb=frame.rgb * np.float32(0.99))

    monkeypatch.setattr(Picture, "frame", wrong)
    with pytest.raises(WrongPictureError, match=r"size 16x12 paints another picture than the whole painting"):
        measured(subject, "size")


def test_a_scene_that_sees_nothing_has_no_family_of_views(scene):
    plan = plan_look_families(subject_of(scene, strokes=BLIND), ("views",))["views"]
    assert plan.skip_reason == "strokes are made by the scene alone (--see off)"


def test_a_scene_of_one_gaussian_is_measured(tmp_path):
    save_upright(still_life_of(1000).take(slice(1)), tmp_path / "few.ply")
    subject = subject_of(tmp_path / "few.ply", size=(32, 24), strokes=BLIND)
    (found,) = measured(subject, "strokes")["strokes"].points
    assert found.strokes == 1
    assert np.isfinite(found.error.rmse)
