"""Relief: how high the paint of the strokes stands in each pixel."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.coat import Coat
from brushgs.rendering.motion import COLOR
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import project
from brushgs.rendering.relief import GAIN, LEAST_LIGHT_RANGE, THICKNESS, Relief, light_range
from brushgs.still_life import still_life_camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.hashing import GOLDEN, uniform
from brushgs.values.sh import base_colors, in_colors
from tests.kit import for_each, still_life_of
from tests.rendering.moving_strokes import motion_of, with_ids

# Of the core, see stroke_relief.hpp.
LEAST_SIZE, MOST_SIZE = 0.4, 2.5
GAIN_SPREAD, MOST_DEVIATIONS, THICKNESS_SPREAD = 0.25, 2.5, 0.5
THIN, THICK = 0.25, 1.35
DARKEST, LIGHTEST = 0.4, 0.8


# Levels


# Projecting


SCENE = still_life_of(3000)
CAMERA = still_life_camera(width=160, height=120)


def test_reliefs_scale_with_the_picture():
    large = replace(CAMERA, width=320, height=240, K=CAMERA.K * [[2], [2], [1]])
    larger, smaller = (project(SCENE, camera, relief=True) for camera in (large, CAMERA))
    shared, a, b = np.intersect1d(larger.ids, smaller.ids, return_indices=True)
    assert len(shared) > 1000
    np.testing.assert_allclose(larger.reliefs[a], 2 * smaller.reliefs[b], rtol=1e-12)
    of_strokes = Relief(THICKNESS, GAIN).of_strokes(SCENE)[smaller.ids]
    np.testing.assert_allclose(smaller.reliefs, np.sqrt(160 * 120 / 750_000) * of_strokes, rtol=1e-6)


# Lights thick, darks thin


def greys(lightness):
    """The still life, its strokes of one size and solid, in greys of OKLab L."""
    strokes = SCENE.take(np.s_[: len(lightness)])
    grey = rgb_of_oklab(np.stack([lightness, 0 * lightness, 0 * lightness], axis=1))
    scales, opacities = np.full_like(strokes.scales, 0.02), np.ones_like(strokes.opacities)
    return in_colors(replace(strokes, scales=scales, opacities=opacities), grey)


def factors_of(strokes, **how):
    """[N, 2] by what both numbers of each stroke are multiplied."""
    return Relief(1, 1, by_light=1, **how).of_strokes(strokes) / Relief(1, 1).of_strokes(strokes)


def range_in_numpy(strokes, logs, lightness):
    areas = strokes.opacities * np.exp(2 * (logs - logs.max()))
    order = np.lexsort((areas, lightness))
    shares = np.cumsum(areas[order])
    return lightness[order[np.searchsorted(shares / shares[-1], (DARKEST, LIGHTEST))]]


def reliefs_in_numpy(strokes, by_light, size):
    logs = np.log(np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)).sum(axis=1) / 2
    middle = np.median(logs) if size is None else np.log(size)
    sizes = np.exp(np.clip(logs - middle, np.log(LEAST_SIZE), np.log(MOST_SIZE)) / 2)
    lightness = oklab_of(base_colors(strokes.sh))[:, 0]
    dark, light = range_in_numpy(strokes, logs, lightness)
    away = (lightness - (dark + light) / 2) / max(light - dark, LEAST_LIGHT_RANGE)
    sizes *= 1 + by_light * (THIN + (THICK - THIN) * np.clip(0.5 + away, 0, 1) - 1)
    states = np.arange(1, 3 * len(strokes) + 1, dtype=np.uint64) * np.uint64(GOLDEN)
    one, two, three = uniform(states).reshape(-1, 3).T
    normal = np.sqrt(-2 * np.log1p(-one)) * np.cos(2 * np.pi * two)
    gains = np.exp(GAIN_SPREAD * np.clip(normal, -MOST_DEVIATIONS, MOST_DEVIATIONS))
    return np.stack([sizes * (1 + THICKNESS_SPREAD * (2 * three - 1)), sizes * gains], axis=1)


@for_each("dtype", [np.float32, np.float64])
@for_each("by_light, size", [(0.0, None), (1.0, None), (0.4, 0.02)])
def test_reliefs_are_those_of_numpy(dtype, by_light, size):
    for strokes in (SCENE.astype(dtype), SCENE.take(np.s_[:-1]).astype(dtype)):
        found = Relief(1, 1, by_light=by_light, size=size).of_strokes(strokes)
        np.testing.assert_allclose(found, reliefs_in_numpy(strokes, by_light, size), rtol=1e-12)


def test_lights_are_thick_and_darks_thin_by_their_place_between_those_of_the_painting():
    lightness = np.linspace(0.3, 0.7, 1001)
    found = factors_of(greys(lightness))
    expected = THIN + (THICK - THIN) * np.clip((lightness - 0.46) / 0.16, 0, 1)
    np.testing.assert_allclose(found, np.stack([expected, expected], 1), atol=2e-3)
    assert light_range(greys(lightness)) == pytest.approx((0.46, 0.62), abs=1e-3)
    fixed = factors_of(greys(lightness), lights=(0.0, 1.0))
    np.testing.assert_allclose(fixed[:, 0], THIN + (THICK - THIN) * lightness, atol=1e-5)


@for_each(
    ("name", "value"), [("scales", 0.0), ("scales", 1e20), ("opacities", 0.0), ("sh", 1e6), ("sh", -1e6)]
)
def test_strokes_of_any_size_and_color_have_a_relief_by_light(name, value):
    strokes = SCENE.take(np.s_[:50])
    strokes = replace(strokes, **{name: np.full_like(getattr(strokes, name), value)})
    for some in (strokes, strokes.take(np.s_[:1]), strokes.take(np.s_[:0])):
        found = Relief(1, 1, by_light=1).of_strokes(some)
        assert found.shape == (len(some), 2)
        assert np.isfinite(found).all()
        assert (found > 0).all()


@for_each("by_light", [0.0, 1.0])
def test_paint_of_what_moves_and_grows_is_that_at_rest_whatever_moment_is_painted_first(by_light):
    """As in a process that paints some frames of a film: nobody there has painted the first moment."""
    strokes = with_ids(still_life_of(1000))
    num = len(strokes)
    turns = np.tile((1.0, 0, 0, 0), (2, num, 1))
    motion = motion_of(strokes, turns, sizes=np.stack([np.zeros(num), np.linspace(-1, 1, num)]))
    brighter = motion.table.copy()
    brighter[1, :, COLOR] = np.linspace(-0.5, 0.5, num)[:, None]
    motion = replace(motion, table=brighter)
    texture, camera = StrokeTexture.open("dry_brush"), still_life_camera(width=320, height=180)
    options = RenderOptions.of(texture, relief=Relief(by_light=by_light))

    def painted_first(position):
        coat = Coat("strokes", replace(strokes), texture, options)
        boxes = coat.posed(motion.pose(position)).boxes(camera)[0]
        return boxes, options.relief.of_strokes(coat.strokes)

    (still, at_rest), (moved, after) = painted_first(0.0), painted_first(1.0)
    np.testing.assert_array_equal(after, at_rest)
    _, i, j = np.intersect1d(still.ids, moved.ids, return_indices=True)
    assert len(i) > 100
    np.testing.assert_array_equal(moved.reliefs[j], still.reliefs[i])
    assert np.abs(moved.colors[j] - still.colors[i]).max() > 0.2
    assert np.abs(np.log(moved.half_extents[j] / still.half_extents[i])).max() > 0.5
