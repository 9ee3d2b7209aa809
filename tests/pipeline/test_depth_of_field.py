"""Detail that is lost with distance, in whole paintings: stills, films, and what is exported."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from brushgs.cli import main
from brushgs.formats import save
from brushgs.options.focus import Focus
from brushgs.options.look import Look
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.frame_painter import FrameKind, FramePainter, FrameView
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from tests.passes.scenes import assert_same, replaced
from tests.scenes import still_life_of

SCENE = still_life_of(1500)
NEAR = (*SCENE.means[SCENE.means[:, 2].argmin()].tolist(), 0.3)


def config(strength, **strokes):
    look = Look.open("oil").config
    return replace(
        look,
        draw=replace(look.draw, lock="anchor"),  # frames below are painted without a track
        view=replace(look.view, size=(96, 72), up=(0, -1, 0)),
        strokes=replace(look.strokes, depth_of_field=strength, see="off", **strokes),
    )


def painted(strength, scene=SCENE, views=None, count=300, **strokes):
    report, chosen = Report(), config(strength, **strokes)
    chosen = replace(chosen, cluster=replace(chosen.cluster, strokes=count))
    return prepare(scene, chosen, report, views=views), report


def test_switched_off_nothing_is_made_for_it():
    found, report = painted(0.0)
    assert not {"lens", "depth of field"} & {stage.name for stage in report.stages}
    assert_same(found.strokes, painted(0.0)[0].strokes)


def blur_of(found, report):
    """Blur of the strokes by the depths in focus that the report states, for one view."""
    ((low, high),) = next(stage.counts for stage in report.stages if stage.name == "lens")["depths"]
    viewmat = found.cameras[0].viewmat
    depths = found.strokes.means @ viewmat[2, :3] + viewmat[2, 3]
    return np.minimum(np.abs(np.clip(depths, low, high) / depths - 1), 1)


def test_what_is_out_of_focus_gets_fewer_strokes():
    focus = Focus(sphere=NEAR)
    soft, report = painted(1.0, focus=focus)
    sharp, _ = painted(0.0, focus=focus)
    limit = np.quantile(blur_of(sharp, report), 0.25)
    assert (blur_of(soft, report) < limit).mean() > 0.3


def test_the_same_strokes_grow_by_the_law_unless_they_would_be_too_long():
    focus = Focus(sphere=NEAR)
    (soft, report), (sharp, _) = (
        painted(strength, focus=focus, economy=0.0, count=None) for strength in (1.0, 0.0)
    )
    np.testing.assert_array_equal(soft.strokes.means, sharp.strokes.means)
    growth = soft.strokes.scales[:, 0] / sharp.strokes.scales[:, 0]
    expected = 1 + 2 * blur_of(sharp, report)
    assert (growth >= 1 - 1e-6).all()
    assert (growth <= expected * (1 + 1e-3)).all()  # the depths in the report are rounded
    assert np.isclose(growth, expected, rtol=1e-3).mean() > 0.2  # the rest are large in this picture
    assert expected.max() > 1.5
    grown = growth > 1.001
    assert (soft.strokes.opacities[grown] < sharp.strokes.opacities[grown]).all()


def test_a_frame_alone_is_that_of_the_film():
    path = PathConfig(orbit=4)
    found, again = (
        painted(0.8, views=path)[0],
        pickle.loads(pickle.dumps(painted(0.8, views=path)[0].painting)),
    )
    painter = FramePainter(found.painting, found.background, FrameKind(None))
    frames = [painter.frame(FrameView(i, camera)).rgb for i, camera in enumerate(found.cameras)]
    alone = FramePainter(again, found.background, FrameKind(None)).frame(FrameView(2, found.cameras[2])).rgb
    np.testing.assert_array_equal(alone, frames[2])


@pytest.mark.parametrize("change", ["one", "together", "black"])
def test_extreme_scenes_are_painted(change):
    scene = SCENE.take(slice(0, 1 if change == "one" else 200))
    if change == "together":
        scene = replaced(scene, means=np.zeros_like(scene.means))
    if change == "black":
        scene = replaced(scene, sh=np.full_like(scene.sh, -5.0))
    found, _ = painted(1.0, scene)
    painter = FramePainter(found.painting, found.background, FrameKind(None))
    assert np.isfinite(painter.frame(FrameView(0, found.cameras[0])).rgb).all()


@pytest.mark.parametrize("name", ["strokes.html", "strokes.ply"])
def test_exports_take_the_strokes(tmp_path, name):
    save(SCENE, tmp_path / "scene.ply")
    outputs = []
    for strength in ("0", "1"):
        output = tmp_path / strength / name
        output.parent.mkdir()
        words = ["export", str(tmp_path / "scene.ply"), "--look", "oil", "--strokes", "200", "--see", "off"]
        words += ["--depth-of-field", strength, "--focus", ",".join(map(str, NEAR)), "--backdrop", "off"]
        assert main([*words, "-o", str(output)]) == 0
        outputs.append(output.read_bytes())
    assert outputs[0] != outputs[1]
