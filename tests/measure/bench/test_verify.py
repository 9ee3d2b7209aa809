"""A wrong picture is never timed: what verification lets pass, and what it catches."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.core.threads import num_threads_or_default
from brushgs.measure.bench import families, run, subject
from brushgs.measure.bench.families import FACTOR, supersampled
from brushgs.measure.bench.verify import (
    DOUBLE,
    SINGLE,
    WrongPictureError,
    bound_of,
    check_close,
    check_equal,
    check_square,
)
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.still_life import still_life_camera
from tests.kit.for_each import for_each
from tests.rendering.strokes import bristles, random_boxes
from tests.scenes import save_upright, still_life_of

pytestmark = pytest.mark.usefixtures("few_points")

SCENE = still_life_of(1000)
STROKES = bg.cluster(bg.prune(SCENE), 200)
CAMERA = still_life_camera(width=96, height=72)
BRUSH = bg.StrokeTexture.open("dry_brush")


def options_of(texture=BRUSH, **changed):
    return replace(RenderOptions.of(texture, num_sigmas=2.0, depth=False), **changed)


def frame_of(texture=BRUSH, strokes=STROKES, **changed):
    return render_with(strokes, CAMERA, texture, options_of(texture, **changed))


def test_a_wrong_picture_is_named():
    kernel = bg.StrokeTexture.open("gaussian")
    check_square("x", frame_of(kernel), STROKES, CAMERA, kernel, options_of(kernel))
    boxes = bg.project(STROKES, CAMERA)
    found = check_square("x", frame_of(), STROKES, CAMERA, BRUSH, options_of())
    x, y = (int(word.strip("(),")) for word in found.against.split()[-2:])
    inside = (np.abs(boxes.centers - (x + 16, y + 16)) < 8).all(axis=1)
    nearest = boxes.ids[np.argmax(inside)]  # in the square
    for wrong in (
        {"filter": "bilinear"},
        {"lock": "off"},
        {"num_sigmas": 2.02},
        {"low_pass": 0.2},
        {"strokes": STROKES.take(np.arange(len(STROKES)) != nearest)},
    ):
        with pytest.raises(WrongPictureError, match="strokes 200 paints another picture than the refer"):
            check_square("strokes 200", frame_of(**wrong), STROKES, CAMERA, BRUSH, options_of())


def test_bounds_are_by_precision_and_nan_passes_none():
    frame = frame_of()
    assert bound_of(frame) is SINGLE
    assert bound_of(bg.Frame(frame.rgb.astype(float), frame.alpha.astype(float))) is DOUBLE
    poisoned = frame.rgb.copy()
    poisoned[3, 4, 1] = np.nan
    with pytest.raises(WrongPictureError):
        check_close("x", replace(frame, rgb=poisoned), frame, "itself")
    few = frame.rgb.copy()
    few[:3, :3] += 0.1  # 9 of 6912 pixels: under the share
    assert check_close("x", replace(frame, rgb=few), frame, "itself").beyond_step == pytest.approx(9 / 6912)


def test_a_run_with_another_result_is_named():
    frame = frame_of()
    check_equal("x", frame_of(), frame)
    changed = frame.alpha.copy()
    changed[0, 0] += 1e-7
    with pytest.raises(WrongPictureError, match="size 48x36 gave another result when it ran again: alpha"):
        check_equal("size 48x36", replace(frame, alpha=changed), frame)


def subject_of(tmp_path, names):
    path = tmp_path / "scene.ply"
    save_upright(SCENE, path)
    paint = PaintConfig(draw=DrawConfig("dry_brush"))
    config = BenchConfig(families=names, strokes=(50,), count=50, repeats=1)
    fewest = replace(paint, cluster=ClusterConfig(strokes=1))
    prepared = prepare(path, fewest, Report(), views=CAMERA, asks=subject.ASKS)
    return subject.Subject(SceneSource.of(path), prepared, paint, config)


@for_each("name", ["strokes", "merge", "filter", "size", "sh"])
def test_a_renderer_that_paints_wrongly_ends_every_family(tmp_path, monkeypatch, name):
    def wrong(*args, **options):
        frame = render_with(*args, **options)
        return replace(frame, rgb=frame.rgb * np.float32(0.99))

    monkeypatch.setattr(subject, "render_with", wrong)
    monkeypatch.setattr(families, "render_with", wrong)
    with pytest.raises(WrongPictureError):
        run.measure(subject_of(tmp_path, (name,)), Report())


def test_a_kernel_that_stops_at_another_light_ends_the_family_of_precision(tmp_path, monkeypatch):
    def wrong(strokes, camera, texture, options):
        late = replace(options, min_transmittance=2 * options.min_transmittance)
        return render_with(strokes, camera, texture, late)

    monkeypatch.setattr(families, "render_with", wrong)
    with pytest.raises(WrongPictureError, match="precision float32, stop at 1e-01"):
        run.measure(subject_of(tmp_path, ("precision",)), Report())


def test_a_truth_that_is_wrong_is_named(tmp_path, monkeypatch):
    def wrong(boxes, texture, **options):
        return supersampled(replace(boxes, centers=boxes.centers + np.float32(0.1)), texture, **options)

    monkeypatch.setattr(families, "supersampled", wrong)
    with pytest.raises(WrongPictureError, match="filter, the supersampled truth"):
        run.measure(subject_of(tmp_path, ("filter",)), Report())


def test_a_frame_that_changes_between_runs_ends_the_bench(tmp_path, monkeypatch):
    paint, calls = subject.render_with, []

    def fickle(*args, **options):
        calls.append(1)
        frame = paint(*args, **options)
        return replace(frame, alpha=np.nextafter(frame.alpha, np.float32(2))) if len(calls) > 5 else frame

    monkeypatch.setattr(subject, "render_with", fickle)
    with pytest.raises(WrongPictureError, match=r"gave another result when it ran again: (rgb|alpha)"):
        run.measure(subject_of(tmp_path, ("strokes",)), Report())


def test_supersampling_is_the_mean_of_many_samples_whatever_the_strips():
    boxes, texture = random_boxes(60, 40, 70, seed=2, sizes=(1, 12)), bristles()
    found = supersampled(boxes, texture, width=40, height=70, num_threads=num_threads_or_default(None))
    large = replace(boxes, centers=FACTOR * boxes.centers, half_extents=FACTOR * boxes.half_extents)
    whole = bg.rasterize(large, texture, width=8 * 40, height=8 * 70, filter="bilinear", depth=False)
    rgb = whole.rgb.reshape(70, 8, 40, 8, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(found.rgb, rgb, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.alpha, whole.alpha.reshape(70, 8, 40, 8).mean(axis=(1, 3)), atol=1e-12)
