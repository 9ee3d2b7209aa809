"""`brushgs stability --look`: whole paintings, as `brushgs render` paints them in films."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.measure.stability import report_stability
from brushgs.measure.stability.look_painters import behind, is_bare, main_coat
from brushgs.measure.stability.measure import FrameSchedule
from brushgs.measure.warp import View
from brushgs.options.experiments import StabilityConfig
from brushgs.options.painting import PaintConfig, StrokesConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.still_life.moving import still_life_moving
from tests.kit.commands import run
from tests.kit.for_each import for_each
from tests.measure.warped import warp_error
from tests.scenes import save_upright, still_life_of

FEW = StabilityConfig(gaps=(1,), pairs=3, alone=1)
ORBIT = PathConfig(orbit=24)
SIZE = (64, 48)


def painting(look, *, count=120, has_stage=False):
    """A look in a small picture of few strokes, made without views, which take most of the time."""
    config = bg.Look.open(look).config
    return replace(
        config,
        view=ViewConfig(size=SIZE, azimuth=0.5, look_at="scene"),
        cluster=replace(config.cluster, strokes=count),
        strokes=StrokesConfig(see="off"),
        ground=replace(config.ground, stage=has_stage and config.ground.stage),
    )


def written(scene, folder, config, path=ORBIT):
    report = report_stability(scene, folder / "a.json", config, path, FEW)
    return report, json.loads((folder / "a.json").read_text())


@pytest.mark.filterwarnings("ignore:the camera turns by 15 degrees a frame")
def test_figures_are_those_of_the_frames_that_render_writes(scene, tmp_path):
    config = painting("oil", has_stage=True)  # of two coats
    report, value = written(scene, tmp_path, config)
    names = [figures["name"] for figures in value["stability"]["configurations"]]
    assert names == ["track", "anchor", "off", "plain"]
    skipped = [reason for stage in report.stages for reason in stage.skipped]
    assert "published: no figures of whole paintings in a look were published" in skipped
    assert len({report.result[name].warps[0].rmse for name in names}) == 4
    config = replace(config, output=replace(PaintConfig().output, bits=16))
    paint_sequence(scene, tmp_path / "%05d.png", ORBIT, config)
    prepared = prepare(scene, config, Report(), views=ORBIT, asks=(*PICTURE, "scene"))
    ground = behind(prepared.painting)
    errors = []
    track = report.result["track"]
    for start in report.result.starts:
        views, plains = [], []
        for index in (start, (start + 1) % 24):
            camera = prepared.path.cameras[index]
            plain = bg.render(prepared.whole_scene, camera, "gaussian")
            plains.append(View(np.clip(plain.over(ground), 0, 1), plain.depth, plain.alpha, camera))
            shown = read_image(tmp_path / f"{index:05d}.png")[..., :3]
            views.append(replace(plains[-1], rgb=shown))
        errors.append((warp_error(*views).rmse, warp_error(*plains).rmse))
    own, plain = np.mean(errors, axis=0)
    assert track.warps[0].rmse == pytest.approx(own, abs=1e-5)  # of 16 bits
    assert track.warps[0].excess == pytest.approx(own - plain, abs=1e-5)
    assert track.alone_equal == track.alone == 1


def test_a_scene_that_moves_has_figures_in_a_look(tmp_path):
    clip = Clip(still_life_moving(1000), bg.ClipConfig(start=bg.Moment(1.2), end=bg.Moment(1.3)))
    report, value = written(clip, tmp_path, painting("oil"), None)
    found = report.result
    names = [figures["name"] for figures in value["stability"]["configurations"]]
    assert names == ["track", "anchor", "off", "alone", "plain"]
    assert found["track"].warps[0].excess < 0.5 * found["alone"].warps[0].excess
    assert found["track"].alone_equal == found["alone"].alone_equal == 1


@for_each("look", ["plain", "oil", "charcoal", "watercolour", "ink"])
def test_only_plain_strokes_are_bare(scene, look):
    found = prepare(scene, painting(look, has_stage=True), Report(), views=ORBIT).painting
    assert is_bare(found) == (look == "plain")
    coat = main_coat(found)
    assert coat.options.lock == "track"
    assert coat.name not in ("backdrop", "wash", "masses")
    assert (behind(found) is None) == (look == "plain")


@pytest.mark.usefixtures("folder")
def test_the_command_takes_a_look_and_strokes_made_by_hand(capsys):
    """Nothing flips or spins but what was asked for, and that shows in the pictures."""
    save_upright(still_life_of(1500), "pears.ply")
    words = "--look plain --strokes 80 --size 64x48 --orbit 120 --no-plot --pairs 6 --see off --azimuth 30"
    words += " --look-at subject --hold 2 --boil 0.5 --boil-every 2 --redraw 1 --smear 1"
    code, _, err = run(capsys, "stability", "pears.ply", *words.split())
    assert code == 0, err
    value = json.loads(Path("pears-stability/stability.json").read_text())
    assert value["settings"]["cluster"]["strokes"] == 80
    found = {figures["name"]: figures for figures in value["stability"]["configurations"]}
    hand, track = found["hand"], found["track"]
    assert hand["events"]["flips"] == hand["events"]["spins"] == 0
    assert hand["alone_equal"] == hand["alone"] > 0
    for one, other in zip(hand["warps"], track["warps"], strict=True):
        assert one["excess"] > other["excess"]


@for_each(("pairs", "beat", "stride"), [(40, 1, 3), (40, 3, 4), (60, 6, 5), (120, 6, 1)])
def test_pairs_begin_at_all_moments_of_what_is_made_by_hand(pairs, beat, stride):
    schedule = FrameSchedule(121, True, StabilityConfig(pairs=pairs), beat)
    assert schedule.stride == stride
    assert {start % beat for start in schedule.starts(1)} == set(range(beat))
