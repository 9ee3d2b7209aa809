"""Whole paintings in each look: what they are laid on, of what, and that they hold still."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.choices import LOOKS
from brushgs.options.look_parts import BrushesConfig
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from tests.kit import blind, changed, for_each, stages, still_life_of

SIZE = 120, 90
SCENE = still_life_of(1500)
NOTHING = SCENE.take(np.zeros(0, int))
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])


def config_of(name, *, num_strokes=250, see="off", **draw):
    """A look; strokes see only where a test is about that, for it takes most of the time."""
    return blind(name, num_strokes, SIZE, strokes={"see": see}, draw=draw)


def painted(name, scene=SCENE, camera=CAMERA, **draw):
    report = Report()
    return bg.paint(scene, config_of(name, **draw), camera=camera, report=report), report


@pytest.fixture(scope="module")
def paintings():
    """A frame and its report by look."""
    return {name: painted(name, threads=1) for name in ("oil", "watercolour", "charcoal", "plain")}


@for_each("name", ["oil", "watercolour", "charcoal"])
def test_a_painting_is_the_same_in_any_number_of_threads_and_hides_its_ground(paintings, name):
    again, _ = painted(name, threads=3)
    np.testing.assert_array_equal(again.rgb, paintings[name][0].rgb)
    assert np.isfinite(again.rgb).all()
    assert (again.alpha == 1).all()


@for_each("name", LOOKS)
def test_an_empty_scene_is_the_bare_ground(name):
    with pytest.warns(bg.SceneWarning, match="no stroke is in the picture"):
        frame = painted(name, NOTHING)[0]
    if name == "plain":
        assert not frame.alpha.any()
    else:
        assert (frame.alpha == 1).all()
        assert np.abs(frame.rgb - frame.rgb.mean(axis=(0, 1))).max() < 0.2  # grain, and nothing else


@for_each(
    ("name", "see", "unit"),  # clustering turns on the last bits of sums
    [("oil", "views", 2.0**-10), ("charcoal", "off", 2.0**-10), ("watercolour", "off", 2.0**13)],
)
def test_a_painting_does_not_depend_on_the_unit_of_the_scene(name, see, unit):
    # Variants of brushes and broken color are hashes of places.
    of_places = {"brushes": BrushesConfig(), "strokes": {"broken_color": 0.0}}
    config = changed(config_of(name, see=see, stroke="flat"), **of_places)
    scene = replace(SCENE, means=SCENE.means * np.float32(unit), scales=SCENE.scales * np.float32(unit))
    viewmat = CAMERA.viewmat.copy()
    viewmat[:3, 3] *= unit
    camera = replace(CAMERA, viewmat=viewmat, near=CAMERA.near * unit)
    expected, frame = bg.paint(SCENE, config, camera=CAMERA), bg.paint(scene, config, camera=camera)
    assert np.abs(frame.rgb - expected.rgb).mean() < 1e-3


@for_each("name", ["oil", "charcoal", "watercolour"])
def test_a_transparent_background_gives_strokes_alone(name):
    config = changed(config_of(name, background="transparent"), ground={"ground": "none", "backdrop": 0})
    away = bg.Camera.look_at((0, -3, -12), (0, 0, 0), width=SIZE[0], height=SIZE[1])
    frame = bg.paint(SCENE, config, camera=away)
    assert frame.alpha.min() == 0
    assert frame.alpha.max() > 0.9
    assert (frame.rgb <= frame.alpha[..., None] + 0.2).all()  # highlights alone exceed it


def test_plain_leaves_out_every_stage_and_module_of_looks(paintings):
    script = (
        "import sys, brushgs as bg\n"
        "from brushgs.still_life import still_life, still_life_camera\n"
        "bg.paint(still_life(1000), 'plain', camera=still_life_camera(width=80, height=60))\n"
        "print(*sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    names = ("add.backdrop", "add.lines", "color.tone", "color.pigments")
    of_looks = {"brushgs.pipeline.media.charcoal", *(f"brushgs.passes.{name}" for name in names)}
    assert not of_looks & set(run.stdout.split())
    frame, report = paintings["plain"]
    assert frame.alpha.min() < 1
    assert not {"ground", "backdrop", "lines", "light", "brushes", "color"} & set(stages(report))
