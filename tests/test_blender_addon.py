"""The add-on for Blender: its cameras and commands, and what it does to a scene.

Blender is no part of the tests: the add-on is run on a stand-in, and was tried in Blender by hand.
"""

import importlib.util
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.formats import load_cameras

ADDON = Path(__file__).parent.parent / "examples" / "blender_addon.py"
TO_GL = np.diag([1.0, -1.0, -1.0, 1.0])  # axes of a camera
TO_BLENDER = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


class Thing(SimpleNamespace):
    """One of Blender's: equal to itself alone."""

    __hash__, __eq__ = object.__hash__, object.__eq__


class Objects(list):
    """The objects of a file of Blender."""

    def new(self, name, data):
        return Thing(name=name, type="LIGHT", data=data)


def blender_with(things):
    """As much of Blender's module as the add-on uses; importing a file adds these things."""
    objects = Objects(["cube"])
    bpy = MagicMock(data=MagicMock(filepath="", objects=objects))
    bpy.types = MagicMock(**{name: type(name, (), {}) for name in ("Operator", "Panel", "PropertyGroup")})
    bpy.ops.import_scene.gltf = lambda filepath: objects.extend(things)
    bpy.context.scene = SimpleNamespace(
        objects=[],
        render=SimpleNamespace(image_settings=SimpleNamespace(), resolution_x=1920, resolution_y=1080),
        cycles=SimpleNamespace(),
        view_settings=SimpleNamespace(),
        collection=MagicMock(),
        world=MagicMock(),
    )
    background = MagicMock(bl_idname="ShaderNodeBackground")
    bpy.context.scene.world.node_tree.nodes = [background]
    return bpy


@pytest.fixture
def addon(monkeypatch):
    """The add-on as a module, on a stand-in for Blender."""

    def opened(things=()):
        monkeypatch.setitem(sys.modules, "bpy", blender_with(things))
        spec = importlib.util.spec_from_file_location("blender_addon", ADDON)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return opened


def stroke_things(*, is_lit=False):
    color = SimpleNamespace(bl_idname="ShaderNodeVertexColor", layer_name="Color")
    nodes = [color, *([SimpleNamespace(bl_idname="ShaderNodeNormalMap")] if is_lit else [])]
    material = SimpleNamespace(surface_render_method="BLENDED", node_tree=SimpleNamespace(nodes=nodes))
    mesh = MagicMock(materials=[material], color_attributes=MagicMock())
    camera = Thing(type="CAMERA", data={"width": 640, "height": 360})
    return [camera, Thing(type="EMPTY"), Thing(type="MESH", data=mesh)], material, mesh


@pytest.mark.parametrize("more", [[], ["--as-painted"]], ids=["linear", "painted"])
def test_strokes_are_imported_ready_to_render(tmp_path, addon, more):
    things, material, mesh = stroke_things()
    module = addon(things)
    module.main([str(tmp_path / "strokes.glb"), "--render", str(tmp_path / "a.png"), *more])
    scene = module.bpy.context.scene
    assert module.bpy.data.objects == things  # the cube is gone
    assert scene.camera is things[0]
    assert (scene.render.resolution_x, scene.render.resolution_y) == (640, 360)
    assert scene.cycles.transparent_max_bounces == 256
    assert scene.view_settings.view_transform == ("Raw" if more else "Standard")
    assert material.surface_render_method == "DITHERED"
    assert material.node_tree.nodes[0].layer_name == ("display colors" if more else "Color")
    assert mesh.color_attributes.new.called == bool(more)
    assert scene.render.filepath == str(tmp_path / "a.png")
    module.bpy.ops.render.render.assert_called_once_with(write_still=True)
    assert not module.bpy.data.lights.new.called  # unlit strokes need none


def test_a_file_without_a_camera_is_no_file_of_strokes(addon):
    module = addon([Thing(type="MESH")])
    with pytest.raises(RuntimeError, match=r"a.glb has no camera: it is no file of strokes"):
        module.import_strokes("a.glb")


@pytest.mark.parametrize("has_scene", [True, False])
def test_a_view_of_blender_becomes_the_same_camera_of_the_scene(tmp_path, addon, has_scene):
    wanted = bg.Camera.look_at((1.0, -2.0, -4.0), (0.3, 0.2, 0.1), width=640, height=360)
    turn = np.eye(4)  # of the scene, in the world of glTF
    if has_scene:
        turn[:3, :3], turn[:3, 3] = Rotation.random(random_state=3).as_matrix(), (0.4, -1.0, 2.0)
    camera = TO_BLENDER @ turn @ np.linalg.inv(wanted.viewmat) @ TO_GL
    scene = TO_BLENDER @ turn @ TO_BLENDER.T if has_scene else None
    lens = np.zeros((4, 4))
    lens[0, 0], lens[1, 1] = 2 * wanted.K[0, 0] / 640, 2 * wanted.K[1, 1] / 360
    lens[3, 2] = -1
    model = addon().camera_model(camera.tolist(), lens.tolist(), None if scene is None else scene.tolist())
    (tmp_path / "view.gltf").write_text(json.dumps(model))
    (found,) = load_cameras(tmp_path / "view.gltf")
    assert np.allclose(found.viewmat, wanted.viewmat, atol=1e-6)
    assert found.K[1, 1] / found.height == pytest.approx(wanted.K[1, 1] / 360)
    assert found.width / found.height == pytest.approx(16 / 9, abs=1e-3)


def test_an_orthographic_view_is_refused(addon):
    with pytest.raises(ValueError, match="orthographic"):
        addon().camera_model(np.eye(4).tolist(), np.eye(4).tolist())
