"""A .glb of Gaussians: its structure by the rules of glTF 2.0, and how its node turns it upright."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.scenes.write import write_scene
from brushgs.values.camera import FirstView
from tests.io.scenes.gltf_maker import Model
from tests.io.scenes.test_written import degrees_between, make
from tests.kit.for_each import for_each
from tests.outlets.glb.glb import Glb

UP = np.array([0.6, -0.64, 0.48])


def view_of(up: np.ndarray) -> FirstView:
    return FirstView(np.eye(3), up, 0.1, 0.2)


def chunks_of(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk."""
    glb = Glb(path.read_bytes())
    return glb.top, glb.binary


def write_chunks(path: Path, top: dict[str, Any], binary: bytes) -> None:
    model = Model()
    model.top, model.data = top, binary
    model.write(path)


def attributes_of(path: Path) -> dict[str, np.ndarray]:
    """Every attribute, read by the rules of the standard alone."""
    glb = Glb(path.read_bytes())
    (primitive,) = glb.top["meshes"][0]["primitives"]
    assert primitive["mode"] == 0
    assert set(glb.top["extensionsUsed"]) == set(primitive["extensions"])
    assert glb.top["buffers"] == [{"byteLength": len(glb.binary)}]
    found = {name: glb.array(index) for name, index in primitive["attributes"].items()}
    for name, index in primitive["attributes"].items():
        accessor = glb.top["accessors"][index]
        view = glb.top["bufferViews"][accessor["bufferView"]]
        assert (accessor["componentType"], view["buffer"], view["byteOffset"] % 4) == (5126, 0, 0)
        assert view["byteLength"] == found[name].nbytes
    position = glb.top["accessors"][primitive["attributes"]["POSITION"]]
    assert position["min"] == found["POSITION"].min(axis=0).tolist()
    assert position["max"] == found["POSITION"].max(axis=0).tolist()
    return found


def test_attributes_hold_what_the_extension_says(tmp_path):
    scene = make(100, 16)
    bg.save(scene, tmp_path / "a.glb")
    found = attributes_of(tmp_path / "a.glb")
    own = {name.removeprefix("KHR_gaussian_splatting:"): values for name, values in found.items()}
    np.testing.assert_array_equal(own["POSITION"], scene.means)
    np.testing.assert_array_equal(own["SCALE"], scene.scales)
    np.testing.assert_array_equal(own["OPACITY"][:, 0], scene.opacities)
    np.testing.assert_allclose(np.linalg.norm(own["ROTATION"], axis=1), 1, atol=1e-6)
    x, y, z, w = own["ROTATION"].T
    turned = replace(scene, quats=np.stack([w, x, y, z], axis=1))
    assert degrees_between(turned, scene).max() < 1e-4
    terms = [(degree, index) for degree in range(4) for index in range(2 * degree + 1)]
    for term, (degree, index) in enumerate(terms):
        np.testing.assert_array_equal(own[f"SH_DEGREE_{degree}_COEF_{index}"], scene.sh[:, term])
    assert len(own) == 4 + len(terms)


@for_each("up", [UP, *(np.array(up, float) for up in ((0, -1, 0), (0, 1, 0), (0, 0, 1)))])
def test_viewers_see_a_scene_upright_and_its_numbers_stay(tmp_path, up):
    scene = make(100)
    write_scene(scene, tmp_path / "a.glb", first_view=view_of(up))
    model, _ = chunks_of(tmp_path / "a.glb")
    turn = Rotation.from_quat(model["nodes"][0]["rotation"])
    np.testing.assert_allclose(turn.apply(up), [0, 1, 0], atol=1e-12)
    found, notes = read_scene(tmp_path / "a.glb")
    np.testing.assert_array_equal(found.means, scene.means)
    assert notes.up is None
    assert notes.first_view is not None


def test_a_node_that_was_moved_afterwards_counts(tmp_path):
    scene = replace(make(100), brushes=np.zeros(100, np.uint8))
    path = tmp_path / "a.glb"
    write_scene(scene, path, is_strokes=True, first_view=view_of(UP), brushes=["flat"])
    model, binary = chunks_of(path)
    model["nodes"][0]["translation"] = [1, 2, 3]
    write_chunks(path, model, binary)
    found, notes = read_scene(path)
    upright = Rotation.from_quat(model["nodes"][0]["rotation"]).apply(scene.means) + np.array([1, 2, 3])
    np.testing.assert_allclose(found.means, upright, atol=1e-5)
    assert (notes.up, notes.first_view, notes.is_strokes) == ("+y", None, True)


@for_each("turn", [None, "x", [0, 0, 0, 0], [0, 0, 1], [1e9, 0, 0, 1], [True, 0, 0, 0]])
def test_damaged_notes_are_as_none(tmp_path, turn):
    path = tmp_path / "a.glb"
    write_scene(make(10), path, is_strokes=True)
    model, binary = chunks_of(path)
    model["extras"]["brushgs"]["turn"] = turn
    write_chunks(path, model, binary)
    _, notes = read_scene(path)
    assert (notes.up, notes.is_strokes) == ("+y", False)
