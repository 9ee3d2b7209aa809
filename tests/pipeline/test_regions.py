"""Parts of a scene are painted otherwise, and the rest as without rules."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles import write_style
from brushgs.options.direction import Direction
from brushgs.options.rules import Rule, Rules
from brushgs.options.sequence import SequenceConfig
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.where import Where, WhereConfig
from brushgs.passes.style.palette import learn_palette
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.still_life import still_life_camera
from brushgs.values.sh import base_colors
from tests.kit import BLIND, blind, changed, for_each, save_opaque, stages, still_life_of, without_look
from tests.passes.scenes import assert_same
from tests.pipeline.test_moving import CAMERA, CONFIG, STEP, moving_scene, red_center

SCENE = still_life_of(1000)
VIEW = still_life_camera(width=96, height=72)
PAINT = without_look("flat", 200, (96, 72), prune={"keep": 1.0}, strokes=BLIND)
LEFT, RIGHT = "half:-1,0,0,0", "half:1,0,0,0"


@pytest.fixture(scope="module")
def plain():
    """Strokes that a rule without any change has clustered."""
    return painted(with_rules(rule(LEFT))).strokes


@pytest.fixture(scope="module")
def orange(tmp_path_factory):
    path = tmp_path_factory.mktemp("palette") / "orange.png"
    save_opaque(path, np.repeat([[[0.9, 0.5, 0.1]] * 8, [[0.5, 0.2, 0.0]] * 8], 4, axis=0))
    return path


def rule(where, **fields):
    return Rule(Where.parse(where), **fields)


def with_rules(*rules, paint=PAINT):
    return replace(paint, rules=Rules(rules))


def painted(config, report=None, scene=SCENE, **options):
    return prepare(scene, config, report or Report(), views=VIEW, **options)


def test_the_first_rule_has_a_gaussian_and_the_stage_counts_them():
    report = Report()
    config = with_rules(rule(LEFT, name="left"), rule("sphere:0,-1,0,1"), rule(LEFT, name="again"))
    maker = painted(config, report, asks=["maker"]).stroke_maker
    regions, x = maker.gaussians.regions, maker.gaussians.means[:, 0]
    assert (regions[x < 0] == 1).all()
    near = np.linalg.norm(maker.gaussians.means - (0, -1, 0), axis=1) < 0.99
    assert (regions[near & (x > 0)] == 2).all()
    stage = stages(report)["regions"]
    counts = stage.counts["regions"]
    assert [one["name"] for one in counts] == ["left", "region 2", "again"]
    assert [one["gaussians"] for one in counts] == np.bincount(regions, minlength=4)[1:].tolist()
    assert stage.counts["elsewhere"] == np.count_nonzero(regions == 0)
    assert stage.skipped == ["again: nothing of the scene is in it alone"]


def test_strokes_bear_the_part_of_their_gaussians_and_a_share_moves_them(plain):
    assert len(plain) <= 200
    assert set(plain.regions) == {0, 1}
    # Only strokes of one side: a stroke of both would lie at the border.
    np.testing.assert_array_equal(plain.means[:, 0] < 0, plain.regions == 1)
    many = painted(with_rules(rule(LEFT, share=4.0))).strokes
    assert len(many) <= 200
    assert np.count_nonzero(many.regions == 1) > 1.3 * np.count_nonzero(plain.regions == 1)


def test_rules_that_say_nothing_change_nothing_but_the_clusters_at_the_border():
    everything = painted(with_rules(rule("sphere:0,0,0,1000"))).strokes
    assert_same(everything, painted(PAINT).strokes)
    assert set(everything.regions) == {1}


def test_a_scene_without_any_part_is_refused():
    with pytest.raises(ValueError, match=r"none of .* lies in any of their regions; `brushgs info`"):
        painted(with_rules(rule("sphere:900,0,0,1")))


def test_a_part_has_a_palette_a_style_and_adjustments_of_its_own(orange, tmp_path):
    unbroken = changed(PAINT, strokes={"broken_color": 0.0})

    def strokes_of(*rules):
        return painted(with_rules(*rules, paint=unbroken)).strokes

    before = strokes_of(rule(LEFT), rule(RIGHT))
    left = before.regions == 1
    found = strokes_of(rule(LEFT, palette=orange), rule(RIGHT))
    assert_same(found.take(left), bg.recolor(before.take(left), bg.Palette.of_image(read_image(orange))))
    assert_same(found.take(~left), before.take(~left))
    path = tmp_path / "orange.style"
    write_style(bg.Style("orange", learn_palette(read_image(orange))), path)
    grey = rule(RIGHT, adjust=AdjustConfig(saturation=0.0))
    colors = base_colors(strokes_of(rule(LEFT, style=StyleConfig.parse(str(path))), grey).sh)
    assert np.ptp(colors[~left], axis=1).max() < 0.02
    assert (colors[left, 0] - colors[left, 2]).mean() > 0.4
    # A share of 0 is the painting without style, bit for bit.
    assert_same(strokes_of(rule(LEFT, style=StyleConfig.parse(f"{path}:0")), rule(RIGHT)), before)


def test_a_part_has_brushes_of_its_own():
    prepared = painted(with_rules(rule(LEFT, brushes=("dab",)), rule(RIGHT, brushes=("flat_1", "x"))))
    names = np.array(prepared.texture.names)[prepared.strokes.brushes]
    regions = prepared.strokes.regions
    assert set(names[regions == 1]) == {"dab", "dab_2", "dab_3", "dab_4"}
    assert set(names[regions == 2]) <= {"flat", "x"}
    assert len(set(prepared.texture.names)) == len(prepared.texture.names)


def test_a_direction_turns_the_strokes_of_its_part_alone(plain):
    turned = painted(with_rules(rule(LEFT, direction=Direction("own")))).strokes
    left = plain.regions == 1
    assert (turned.quats[left] != plain.quats[left]).any(axis=1).mean() > 0.5
    same = (turned.quats[~left] == plain.quats[~left]).all(axis=1)
    assert same.all()


@for_each("has_rows", [True, False])
def test_parts_follow_a_moving_scene(has_rows, orange, tmp_path):
    clip = Clip(moving_scene(has_rows=has_rows), bg.ClipConfig(fps=12))
    red = rule("colour:#e61a1a,0.3", palette=orange, palette_strength=0.0, opacity=0.5)
    strokes = prepare(clip, replace(CONFIG, rules=Rules((red,))), Report(), views=CAMERA).strokes
    reddish = base_colors(strokes.sh)[:, 0] - base_colors(strokes.sh)[:, 1] > 0.3
    np.testing.assert_array_equal(reddish, strokes.regions == 1)
    # What is not painted moves with the scene.
    config = shown("not colour:#e61a1a,0.3", CONFIG)
    plain = prepare(clip, config, Report(), views=CAMERA).plain
    assert np.median(base_colors(plain.sh)[:, 1]) < 0.2  # the ball
    paint_sequence(clip, f"{tmp_path}/{has_rows}-%d.png", CAMERA, config, SequenceConfig())
    centers = [red_center(read_image(tmp_path / f"{has_rows}-{n}.png")) for n in (0, 6)]
    assert centers[1] - centers[0] == pytest.approx(CAMERA.K[0, 0] * STEP / 6, abs=1.5)


def shown(where, paint=PAINT, **fields):
    return replace(paint, painted=WhereConfig(Where.parse(where), **fields))


def test_what_is_not_painted_is_shown_as_it_is():
    prepared = painted(shown(LEFT))
    part = SCENE.take(SCENE.means[:, 0] <= 0)  # which is painted as a scene of its own
    assert_same(prepared.strokes, painted(PAINT, scene=part).strokes)
    assert_same(prepared.plain, SCENE.take(SCENE.means[:, 0] > 0))
    frame = prepared.painting.frame(VIEW)
    plain = bg.render(SCENE, VIEW, "gaussian")
    away = np.abs(frame.rgb - plain.rgb).mean(axis=(0, 2))
    assert away[60:].mean() < 0.02 < away[:20].mean()
    soft = painted(shown(LEFT, soft=0.5))  # strokes and Gaussians mingle
    assert (soft.plain.means[:, 0] < 0).any()
    assert (soft.strokes.means[:, 0] > 0).any()


def test_all_of_a_scene_is_painted_as_without_where():
    with pytest.warns(bg.SceneWarning, match="changes nothing, since all 1,131 Gaussians lie in it"):
        prepared = painted(shown("sphere:0,0,0,1000"))
    assert prepared.plain is None
    assert_same(prepared.strokes, painted(PAINT).strokes)


@pytest.mark.parametrize("look", ["oil", "watercolour", "ink"])
def test_every_coat_but_the_backdrop_bears_parts(look):
    # Pieces keep the part of their Gaussian.
    config = blind(look, 200, (160, 120), strokes={"economy": 0.0}, rules=Rules((rule(LEFT),)))
    prepared = prepare(still_life_of(3000), config, Report(), views=still_life_camera(width=160, height=120))
    strokes, coats = prepared.strokes, prepared.painting.coats
    assert "lines" in {coat.name for coat in coats} or look == "oil"
    assert set(coats[0].strokes.regions) == {0, 1}
    for coat in coats:
        means, regions = coat.strokes.means, coat.strokes.regions
        assert set(regions) <= {0, 1}
        if coat.chains is not None or coat.name == "lines":  # no strokes: they have the part of the nearest
            away = np.linalg.norm(means[:, None].astype(float) - strokes.means, axis=2)
            np.testing.assert_array_equal(regions, strokes.regions[away.argmin(axis=1)])
        else:
            np.testing.assert_array_equal(regions == 1, means[:, 0] < 0)
