"""Control maps: laws of each property, agreement with rules and focus, and refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.cameras.framing import plain_first_view
from brushgs.options.focus import Focus
from brushgs.options.maps import PROPERTIES, Map
from brushgs.options.where import Where
from brushgs.passes.where import WhereContext, memberships
from brushgs.passes.where.maps import apply_factors, carried, factors_of
from brushgs.pipeline.focus import place_focus
from brushgs.pipeline.maps import SOFT, TAILS, place_maps
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from brushgs.values.colors import oklab_of
from brushgs.values.sh import base_colors
from tests.kit import blind, for_each, refused, save_upright, still_life_of
from tests.passes.scenes import assert_same

SCENE = still_life_of(1500)
CAMERA = still_life_camera(width=64, height=48)
VIEW = plain_first_view(SCENE)
MEASURES = {
    "size": lambda strokes: strokes.scales.max(axis=1),
    "opacity": lambda strokes: strokes.opacities,
    "chroma": lambda strokes: np.linalg.norm(oklab_of(base_colors(strokes.sh))[:, 1:], axis=1),
}


def picture(folder, values):
    """A PNG of values 0 to 255 [48, 64]."""
    path = folder / "map.png"
    Image.fromarray(np.broadcast_to(values, (48, 64)).astype(np.uint8)).save(path)
    return path


def placed(*texts, source=SCENE, report=None):
    maps = [Map.parse(text) for text in texts]
    return place_maps(SCENE, maps, source, lambda: [CAMERA], VIEW, report or Report())


@for_each("name", PROPERTIES)
def test_factors_never_fall_as_the_map_gets_lighter_and_reach_both_ends(name):
    values = np.linspace(0, 1, 101)
    low, high, *_ = PROPERTIES[name]
    found = factors_of(values, low, high)
    assert (np.diff(found) >= 0).all()
    assert (found[0], found[-1]) == (low, high)
    np.testing.assert_allclose(factors_of(values, high, low), factors_of(1 - values, low, high), atol=1e-12)


@for_each("name", MEASURES)
def test_a_property_is_multiplied_and_a_factor_of_one_keeps_the_bits(name):
    factors = np.where(np.arange(len(SCENE)) % 2 == 0, 1.0, 0.5)
    found = apply_factors(SCENE, name, factors)
    assert_same(found.take(factors == 1), SCENE.take(factors == 1))
    np.testing.assert_allclose(MEASURES[name](found), factors * MEASURES[name](SCENE), atol=2e-3, rtol=1e-5)


def test_a_grey_map_changes_nothing_nor_a_map_what_the_view_does_not_show(tmp_path):
    path, report = picture(tmp_path, 128), Report()
    assert placed(f"size={path}", f"density={path}", f"chroma={path}:0.5..2", report=report) == []
    assert len(report.stages[0].skipped) == 3
    (found,) = placed(f"size={picture(tmp_path, 0)}:0.5..2")
    assert set(np.unique(found.factors)) == {0.5, 1.0}


def test_a_map_of_density_is_the_focus_on_the_same_picture(tmp_path):
    values = np.where(np.arange(64) < 32, 0, 255)
    path = picture(tmp_path, values)
    (found,) = placed(f"density={path}:1..2")
    focus = place_focus(SCENE, Focus(mask=path), CAMERA, VIEW, Report())
    np.testing.assert_allclose(found.factors, focus, atol=0.005)


def test_a_part_is_full_inside_and_several_maps_of_a_property_multiply():
    inside = memberships(Where.parse("height:20%.."), SCENE, WhereContext(VIEW, SOFT))
    (once,) = placed("size=height:20%..:1..2")
    assert (once.factors[inside == 1] == 2).all()
    assert (once.factors[inside == 0] == 1).all()
    assert ((inside > 0) & (inside < 1)).any(), "its edge is soft"
    (twice,) = placed("size=height:20%..:1..2", "size=height:20%..:1..2")
    np.testing.assert_array_equal(twice.factors, once.factors**2)


def test_strokes_carry_the_mean_of_the_gaussians_nearest_to_them():
    strokes, ones = SCENE[::50], np.ones(len(SCENE))
    np.testing.assert_array_equal(carried(ones, SCENE, strokes), ones[: len(strokes)])
    factors = np.random.default_rng(1).uniform(0.5, 2, len(SCENE))
    np.testing.assert_allclose(carried(factors, SCENE, SCENE), factors, rtol=1e-12)
    found = carried(factors, SCENE, strokes)
    assert factors.min() <= found.min()
    assert found.max() <= factors.max()
    far = replace(strokes, means=strokes.means + np.float32(100))
    assert np.isin(carried(factors, SCENE, far + strokes)[len(far) :], found).all()


def test_a_column_of_the_file_is_spread_from_low_to_high(tmp_path):
    path = tmp_path / "scene.ply"
    bg.save(SCENE, path)
    (found,) = placed("size=column:x:1..3", source=path)
    x = SCENE.means[:, 0].astype(np.float64)
    low, high = np.quantile(x, TAILS)
    np.testing.assert_allclose(found.factors, 1 + 2 * np.clip((x - low) / (high - low), 0, 1), atol=0.02)
    for name, says in (("y_", "did you mean 'y'"), ("nx", "all over column 'nx'")):
        with pytest.raises(bg.SceneError, match=says):
            placed(f"size=column:{name}", source=path)
    with pytest.raises(ValueError, match="belongs to a PLY file"):
        placed("size=column:x")


def test_relief_and_lost_edges_follow_their_maps(tmp_path):
    path = tmp_path / "scene.ply"
    middle = np.median(SCENE.means, axis=0)
    save_upright(SCENE[np.linalg.norm(SCENE.means - middle, axis=1) < 1], path)  # an object without ground
    half = f"half:1,0,0,{middle[0]:.3f}"

    def painted(*flags):
        seeing = {"maps": tuple(map(Map.parse, flags)), "edges": 1.0, "see": "views"}
        config = blind("oil", 400, (120, 90), strokes=seeing)
        return prepare(path, config, Report(), asks=("painting", "edges", "background"))

    plain, mapped = painted(), painted(f"relief={half}:0..1", f"edge={half}:0..1")
    coats = [next(one for one in found.painting.coats if one.name == "strokes") for found in (plain, mapped)]
    heights = [coat.options.relief.of_strokes(coat.strokes)[:, 0] for coat in coats]
    right = coats[1].strokes.means[:, 0] - middle[0]
    is_in, is_out = right > 0.4, right < -0.4
    assert heights[1][is_out].max() == 0
    # Lights are thick, and softened edges change the lightness.
    np.testing.assert_allclose(heights[1][is_in], heights[0][is_in], rtol=0.05)
    assert plain.edges.lost[is_out].max() > 0
    assert mapped.edges.lost[is_out].max() == 0


WRITTEN = "size=column:confidence:0.5..2", "size=height:20%..:0.5..2", "opacity=not height:0.2..1:1..0"


@for_each("text", [*WRITTEN, "density=subject"])
def test_a_map_is_written_as_it_is_read(text):
    assert Map.parse(str(Map.parse(text))) == Map.parse(text)


REFUSED = {
    "size": "map must be PROPERTY=SOURCE",
    "sise=a.png": "did you mean 'size'",
    "size=a.png:1..b": "map must be PROPERTY=SOURCE",
    "size=subject:0..1": "must have factors of 0.2 to 5, got 0",
    "opacity=subject:0..2": "must have factors of 0 to 1, got 2",
    "size=mask:a.png": "cameras of its own",
    "size=sphere:1,2": "sphere",
    "size=none.png": "none.png",
    "chroma=wide.png": "must have the sides of the first view",
}


@for_each("text", REFUSED)
def test_what_cannot_be_used_is_refused_in_a_sentence(text, scene, folder, capsys):
    Image.new("L", (90, 30)).save("wide.png")
    words = ["--size", "32x24", "--strokes", "20", "--see", "off", "--map", text, "-o", "a.png"]
    assert REFUSED[text] in refused(capsys, "render", scene, *words)
    assert not Path("a.png").exists()


def test_a_map_is_taken_by_look_files_and_keywords(tmp_path):
    look = tmp_path / "look.toml"
    look.write_text('[strokes]\nmaps = ["size=subject:1..2", "chroma=subject"]\n')
    assert len(bg.Look.open(look).config.strokes.maps) == 2
    how = {"strokes": 40, "size": (32, 24), "up": "-y", "see": "off"}
    plain, mapped = (bg.paint(SCENE, **how, map=maps) for maps in ([], ["chroma=subject:0..0"]))
    assert np.ptp(mapped.rgb, axis=2).max() < 0.5 * np.ptp(plain.rgb, axis=2).max()
    with pytest.raises(ValueError, match="list of texts"):
        bg.paint(SCENE, map=[3])
