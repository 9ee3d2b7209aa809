"""The cameras of the add-on for Blender, which is no part of the tests: the rest was tried by hand."""

import importlib.util
import json
import sys
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from tests.kit.for_each import for_each

ADDON = Path(__file__).parent.parent / "examples" / "blender_addon.py"
TO_GL = np.diag([1.0, -1.0, -1.0, 1.0])  # axes of a camera
TO_BLENDER = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@pytest.fixture
def addon(monkeypatch):
    """The add-on as a module, on a stand-in for Blender."""
    bpy = MagicMock()
    bpy.types = MagicMock(**{name: type(name, (), {}) for name in ("Operator", "Panel", "PropertyGroup")})
    monkeypatch.setitem(sys.modules, "bpy", bpy)
    spec = importlib.util.spec_from_file_location("blender_addon", ADDON)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@for_each("has_scene", [True, False])
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
    model = addon.camera_model(camera.tolist(), lens.tolist(), None if scene is None else scene.tolist())
    (tmp_path / "view.gltf").write_text(json.dumps(model))
    (found,) = bg.load_cameras(tmp_path / "view.gltf")
    assert np.allclose(found.viewmat, wanted.viewmat, atol=1e-6)
    assert found.K[1, 1] / found.height == pytest.approx(wanted.K[1, 1] / 360)
    assert found.width / found.height == pytest.approx(16 / 9, abs=1e-3)
    with pytest.raises(ValueError, match="orthographic"):
        addon.camera_model(np.eye(4).tolist(), np.eye(4).tolist())
