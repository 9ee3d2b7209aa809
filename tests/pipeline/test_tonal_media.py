"""Ink, hatching and stippling as whole paintings: figures on the still life, edge cases, films, outlets."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

import brushgs as bg
from brushgs.brushes.soft import pen_brush
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.options.direction import Direction
from brushgs.options.where import Where, WhereConfig
from brushgs.outlets.glb.write import omitted
from brushgs.passes.add.stage_paint import Brushwork
from brushgs.passes.add.tonal_view import TonalView
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.media.flecks import without_flecks
from brushgs.pipeline.media.ink import FILM_SOFTNESS, lightness_in_space
from brushgs.pipeline.media.materials import Materials
from brushgs.pipeline.media.media import stage_of as stage
from brushgs.pipeline.media.sight import Sight
from brushgs.pipeline.media.staging import Staging
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.rendering.effect import without_effect
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.tonal import Tones
from brushgs.still_life import still_life_camera
from brushgs.values.sh import base_colors
from tests.kit import blind, for_each, still_life_of
from tests.passes.add.test_stage import crate, stage_of

LOOKS = "ink", "hatching", "stippling"
SCENE = still_life_of(3000)
SIZE = 480, 270
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])


def prepared(look, scene=SCENE):
    config = blind(look, 600, SIZE, strokes={"focus": None})
    return prepare(scene, config, Report(), views=CAMERA, asks=PICTURE)


@pytest.fixture(scope="module")
def paintings():
    return {look: prepared(look).painting for look in LOOKS}


def coats(painting):
    return {coat.name: coat for coat in painting.coats}


def luminance(frame):
    return frame.rgb @ np.array([0.2126, 0.7152, 0.0722])


def test_each_look_has_its_marks_on_a_ground_that_hides(paintings):
    assert [coat.name for coat in paintings["ink"].coats][-4:] == ["ground", "hatching", "crossed", "lines"]
    assert "crossed" in coats(paintings["hatching"])
    assert coats(paintings["stippling"])["dots"].nested.is_round
    for painting in paintings.values():
        assert coats(painting)["ground"].effect is not None


def test_a_part_in_ink_is_painted_over_the_rest_as_it_is():
    config = blind("ink", 60, (64, 36), strokes={"focus": None})
    config = replace(config, painted=WhereConfig(Where.parse("half:1,0,0,0")))
    found = coats(prepare(SCENE, config, Report(), views=CAMERA, asks=PICTURE).painting)
    rest, ground = found["unpainted"], found["ground"]
    assert (len(rest.strokes), len(rest.plain), rest.effect) == (0, int((SCENE.means[:, 0] < 0).sum()), None)
    assert ground.effect is not None
    assert ground.plain is None
    assert ground.tolerance == config.media.behind


def test_a_still_in_ink_has_fewer_flecks_and_a_film_all_of_its_marks(monkeypatch):
    seen = []

    def remembered(materials, behind, drawn):
        seen[:] = materials, behind, drawn
        return behind, drawn

    monkeypatch.setattr("brushgs.pipeline.steps.laying.cleared", remembered)
    prepared("ink")
    materials, behind, drawn = seen
    cleared_behind, cleared_drawn = without_flecks(materials, behind, drawn)
    camera = materials.sight.cameras[0]

    def areas(coats):
        """px of flecks, of less than 48 at 960 x 540, and of all other ink."""
        frame = Painting.alone(coats).frame(camera)
        is_ink = luminance(frame) + 1 - frame.alpha < 0.5
        sizes = np.bincount(ndimage.label(is_ink, np.ones((3, 3)))[0].ravel())[1:]
        is_fleck = sizes < 48 * camera.width * camera.height / (960 * 540)
        return sizes[is_fleck].sum(), sizes[~is_fleck].sum()

    flecks, ink = areas((*behind, *drawn))
    fewer, rest = areas((*cleared_behind, *cleared_drawn))
    assert flecks > 0
    assert fewer < 0.5 * flecks
    assert rest > 0.97 * ink
    assert [len(coat.strokes) for coat in cleared_drawn] == [len(coat.strokes) for coat in drawn]
    film = replace(materials, sight=replace(materials.sight, is_film=True))
    assert without_flecks(film, behind, drawn) == (behind, drawn)


def test_a_scene_that_moves_before_a_camera_at_rest_is_a_film_in_ink():
    """Its marks are tracked, so no view alone has boxes of them; its blacks are fixed in space."""
    clip = Clip(bg.MovingScene(0.5, True, lambda time: SCENE), bg.ClipConfig(fps=8))
    config = blind("ink", 200, (160, 90), strokes={"focus": None})
    painting = prepare(clip, config, Report(), views=CAMERA.resized(160, 90), asks=PICTURE).painting
    assert coats(painting)["ground"].effect.softness == FILM_SOFTNESS


@for_each("look", LOOKS)
def test_a_frame_alone_in_another_process_is_that_of_the_film_and_one_stroke_is_painted(paintings, look):
    """Nothing is settled in a frame: neither thresholds nor levels depend on what was painted before."""
    painting, other = paintings[look], replace(CAMERA, K=CAMERA.K * [[1.5], [1.5], [1]])
    in_film = [painting.frame(camera).rgb.copy() for camera in (other, CAMERA)]
    alone = pickle.loads(pickle.dumps(painting)).frame(CAMERA)
    np.testing.assert_array_equal(alone.rgb, in_film[1])
    one = prepared(look, SCENE.take(np.arange(1))).painting.frame(CAMERA)
    assert np.isfinite(one.rgb).all()


def test_outlets_without_effects_show_dark_strokes_in_place_of_blacks(paintings):
    ground = coats(paintings["ink"])["ground"]
    shown = without_effect(ground)
    assert shown.effect is None
    colors = base_colors(shown.strokes.sh)
    is_ink = np.abs(colors - ground.effect.ink).max(axis=1) < 1e-5
    assert 0 < is_ink.mean() < 0.6
    assert (is_ink == (base_colors(ground.strokes.sh)[:, 1] < ground.effect.threshold)).all()
    words = " ".join(omitted(Painting(paintings["ink"].coats), CAMERA, for_view=False))
    assert "washes and blacks are not in the file" in words
    assert "denser" in words


def view_of(black, depth):
    """A view of the plane z = 0 and its black pixels: left of the middle, moved by `black` px."""
    mask = np.arange(64)[None, :] < 32 + np.full((64, 1), black)
    tones = Tones.of(np.full((64, 64, 3), 0.5), np.ones((64, 64)), np.full((64, 64), depth), scale=1.0)
    camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=64, height=64)
    flat = np.full((64, 64), np.float32(depth))
    return TonalView(camera, tones, flat, np.zeros((64, 64, 2)), np.zeros((64, 64, 3))), mask


def test_blacks_of_films_are_those_of_most_views_and_of_what_is_near_where_none_shows_it():
    views, masks = zip(view_of(0, 4.0), view_of(0, 4.0), view_of(12, 4.0), strict=True)
    x = np.array([-0.5, -0.2, 0.2, 0.5])
    places = np.concatenate([np.stack([x, 0 * x, 0 * x], axis=1), [[-0.5, 0, 1.0], [0.5, 0, 1.0]]])
    strokes = SCENE.take(np.arange(6))
    strokes = replace(strokes, means=places.astype(strokes.means.dtype))
    lightness = lightness_in_space(strokes, list(views), list(masks))
    np.testing.assert_allclose(lightness, [0, 0, 0.83, 0.83, 0, 0.83], atol=0.02)
    unseen = lightness_in_space(strokes.take(np.arange(4, 6)), list(views), list(masks))
    assert unseen.tolist() == [1, 1], "no view shows any"


@pytest.fixture(scope="module")
def staged():
    """The coat of a stage in each look, and its camera."""
    scene, pen = crate(), pen_brush()
    camera = frame_scene(plain_first_view(scene), width=960, height=540)
    scenery = stage_of(scene)
    staging = Staging(scenery, Brushwork(), [camera], lambda strokes: strokes, 0)
    sight = Sight.of((camera,), None, scene, None, Direction())

    def coat(look):
        config = bg.Look.open(look).config
        options = RenderOptions.of(pen)
        materials = Materials(scene, pen, options, config.media, config.color, None, sight=sight)
        return stage(materials, staging)

    return {look: coat(look) for look in LOOKS}, scenery, camera


def test_the_shadow_of_a_stage_is_as_light_as_the_pen_of_its_drawing(staged):
    coats, _, camera = staged
    alphas = (Painting.alone([coats[look]]).frame(camera).alpha for look in LOOKS)
    ink, hatching, stippling = (float(alpha.sum()) for alpha in alphas)
    assert 0.4 * ink < hatching < 0.7 * ink
    assert 0.15 * hatching < stippling < 0.5 * hatching, "dots leave more paper than lines"


def test_a_stage_of_dots_lies_level_and_is_dense_where_its_shadow_is_dark(staged):
    coats, scenery, _ = staged
    dots = coats["stippling"]
    assert dots.nested.is_round
    np.testing.assert_allclose(scenery.normals_of(dots.strokes) @ scenery.place.axes[1], 1, atol=1e-5)
    shade = scenery.shadow.at(scenery.place.local(dots.strokes.means))[:, 0]
    dark, light = (np.median(dots.nested.spacings[rows]) for rows in (shade > 0.6, shade < 0.3))
    assert dark < 0.6 * light
