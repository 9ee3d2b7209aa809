"""Cameras of glTF models, against the formulas of the specification and SciPy's rotations."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from brushgs import SceneError, SceneWarning
from brushgs.formats import load_cameras
from brushgs.formats.cameras.animated import slerp
from brushgs.formats.cameras.read import read_cameras
from brushgs.formats.scenes.write import write_scene
from brushgs.values.camera import FirstView
from tests.io.camera_models import LENS, CameraModel, moving_model, write
from tests.io.scenes.test_gltf_write import chunks_of, write_chunks
from tests.io.scenes.test_written import make
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

FLIP = np.diag([1.0, -1.0, -1.0])  # from axes x right, y up, z backward to x right, y down, z forward


def pose(camera: Any) -> tuple[np.ndarray, np.ndarray]:
    """Position [3] and rotation [3, 3], world from camera, in the axes of glTF."""
    rotation = camera.viewmat[:3, :3]
    return -rotation.T @ camera.viewmat[:3, 3], rotation.T @ FLIP


def check_pose(camera: Any, position: Any, rotation: Rotation, atol: float = 2e-6) -> None:
    found_position, found_rotation = pose(camera)
    np.testing.assert_allclose(found_position, position, atol=atol)
    np.testing.assert_allclose(found_rotation, rotation.as_matrix(), atol=atol)


def test_a_camera_looks_along_minus_z_with_y_up_and_its_lens_is_its_vertical_angle(tmp_path):
    model = CameraModel()
    model.camera("Wide", {"yfov": 0.8, "aspectRatio": 16 / 9, "znear": 0.25, "zfar": 100})
    model.camera("Tall", {"yfov": 0.8, "aspectRatio": 0.5, "znear": 0.1})
    model.camera("Any", {"yfov": 0.8, "znear": 0.1})
    cameras = load_cameras(write(model, tmp_path))
    for camera, shape in zip(cameras, ((1280, 720, 0.25), (640, 1280, 0.1), (1280, 720, 0.1)), strict=True):
        assert (camera.width, camera.height, camera.near) == shape
        np.testing.assert_allclose(camera.viewmat, np.diag([1.0, -1, -1, 1]))
        assert 2 * np.arctan(camera.height / 2 / camera.K[1, 1]) == pytest.approx(0.8)
        assert camera.K[0, 0] == camera.K[1, 1]
        assert (camera.K[0, 2], camera.K[1, 2]) == (camera.width / 2, camera.height / 2)


def test_cameras_hang_on_nodes_that_turn_move_and_scale(tmp_path):
    turns = Rotation.random(3, random_state=1)
    model = CameraModel()
    camera = model.camera("Camera", translation=[1, 2, 3], rotation=turns[0].as_quat().tolist())
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turns[1].as_matrix() * 0.5, [4, 0, -1]
    middle = model.node("Middle", matrix=matrix.T.ravel().tolist(), children=[camera])
    model.node("Top", children=[middle], scale=[3, 3, 3], rotation=turns[2].as_quat().tolist())
    (found,) = load_cameras(write(model, tmp_path))
    inner = 0.5 * turns[1].apply([1, 2, 3]) + [4, 0, -1]
    check_pose(found, 3 * turns[2].apply(inner), turns[2] * turns[1] * turns[0])


def test_the_frames_of_an_animated_camera_on_an_animated_arm_in_the_coordinates_of_the_scene(tmp_path):
    file = read_cameras(write(moving_model(), tmp_path))
    assert file.choice == "the animated camera 'Shot' of 2"
    assert len(file.cameras) == 2 * 24 + 1
    scene = Rotation.from_euler("x", 90, degrees=True)
    arm = Slerp([0.5, 2.5], Rotation.from_euler("y", [[0], [90]], degrees=True))
    own = Rotation.from_quat([0.1, 0.2, 0, 0.9])
    for index, camera in enumerate(file.cameras):
        time = 0.5 + index / 24
        place = [np.interp(time, [0.5, 1, 2.5], values) for values in ([0, 1, 1], [0, 0, 2], [4, 4, 4])]
        world = arm(time).apply(2 * np.array(place))
        check_pose(camera, scene.inv().apply(world) / 3, scene.inv() * arm(time) * own)
        assert camera.near == pytest.approx(0.1 / 3)


def spline(keys: Any, times: Any, time: float) -> np.ndarray:
    """Appendix C.5 of the specification, key by key."""
    k = min(max(int(np.searchsorted(times, time, side="right")) - 1, 0), len(times) - 2)
    length = times[k + 1] - times[k]
    t = (time - times[k]) / length
    keys = np.asarray(keys, float).reshape(len(times), 3, -1)
    value, leave, arrive, end = keys[k, 1], keys[k, 2], keys[k + 1, 0], keys[k + 1, 1]
    tangents = length * ((t**3 - 2 * t**2 + t) * leave + (t**3 - t**2) * arrive)
    return (2 * t**3 - 3 * t**2 + 1) * value + (3 * t**2 - 2 * t**3) * end + tangents


def test_cubic_splines_have_tangents(tmp_path):
    rng, times = np.random.default_rng(5), [0.0, 0.5, 2.0]
    places, quats = rng.normal(size=(9, 3)), rng.normal(size=(9, 4))
    quats[1::3] /= np.linalg.norm(quats[1::3], axis=1, keepdims=True)
    model = CameraModel()
    camera = model.camera("Camera")
    model.animate(camera, "translation", times, places, "CUBICSPLINE")
    model.animate(camera, "rotation", times, quats, "CUBICSPLINE")
    for index, found in enumerate(load_cameras(write(model, tmp_path))):
        time = index / 24
        check_pose(found, spline(places, times, time), Rotation.from_quat(spline(quats, times, time)), 2e-5)


def test_steps_hold_their_value_lenses_zoom_and_keys_that_are_all_equal_are_no_animation(tmp_path):
    model = CameraModel()
    camera = model.camera("Camera")
    model.animate(camera, "translation", [0, 1, 1.5], [[1, 0, 0], [2, 0, 0], [3, 0, 0]], "STEP")
    places = [pose(found)[0][0] for found in load_cameras(write(model, tmp_path))]
    assert places == [1] * 24 + [2] * 12 + [3]
    model = CameraModel()
    pointer = {"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}
    model.animate(model.camera("Camera"), "pointer", [0, 1], [[0.8], [0.4]], extensions=pointer)
    angles = [2 * np.arctan(c.height / 2 / c.K[1, 1]) for c in load_cameras(write(model, tmp_path))]
    np.testing.assert_allclose(angles, np.linspace(0.8, 0.4, 25), rtol=1e-6)
    model = CameraModel()
    for x in (1, 2):
        camera = model.camera("Camera")
        model.animate(camera, "translation", [0, 1], [[x, 0, 0]] * 2)
        model.animate(camera, "scale", [0, 1], [[0] * 3, [1] * 3, [0] * 3] * 2, "CUBICSPLINE")
    assert [pose(camera)[0][0] for camera in load_cameras(write(model, tmp_path))] == [1, 2]


# ---- what is refused


def lens(**fields):
    model = CameraModel()
    model.camera("Camera", LENS | fields)
    return model


def animated(part="translation", width=3, times=None, values=None, **changes):
    """An animation; `changes` are of its channel, sampler, or the accessor of its values."""
    model = CameraModel()
    camera = model.camera("Camera")
    plain = np.arange(1, 1 + 3 * width).reshape(3, width)
    animation = model.animate(camera, part, [0, 1, 2], plain)
    if times is not None:
        animation["samplers"][0]["input"] = model.accessor(np.array(times, np.float32)[:, None])
    if values is not None:
        animation["samplers"][0]["output"] = model.accessor(np.array(values, np.float32))
    places = {"channel": animation["channels"][0], "sampler": animation["samplers"][0]}
    places |= {"buffer": model.top["buffers"][0], "node": model.top["nodes"][0], "top": model.top}
    for place, fields in changes.items():
        places[place].update(fields)
    return model


def nodes(first, *others):
    model = CameraModel()
    model.camera("Camera", **first)
    for node in others:
        model.node(**{"name": "Node", **node})
    return model


def ring():
    model = nodes({}, {"name": "First", "children": [0]})
    model.top["nodes"][0]["children"] = [1]
    model.top["scenes"] = [{"nodes": [1]}]
    return model


IDENTITY, STRETCHED = np.eye(4).ravel().tolist(), {"name": "brushgs_scene", "scale": [1, 2, 1]}
BROKEN = [
    (CameraModel(), "holds no camera; export it with its cameras"),
    (lens(yfov=0), r"cameras\[0\]\.perspective\.yfov must be a number above 0, got 0"),
    (lens(yfov=4), "yfov of camera 'Camera' must be above 0 and below half a turn, got 4 to 4"),
    (lens(znear="x"), r'cameras\[0\]\.perspective\.znear must be a number above 0, got "x"'),
    (lens(aspectRatio=1000), "aspect ratio must be 0.02 to 50, got 1000"),
    (nodes({"scale": [1, 0, 1]}), "'Camera' is scaled to nothing or beyond all numbers"),
    (nodes({"scale": [1, -1, 1]}), "'Camera' is mirrored by what it hangs on"),
    (nodes({}, STRETCHED), "node 'brushgs_scene' must be scaled equally along all axes"),
    (nodes({"translation": [1e17, 0, 0]}), "the position must lie within 1e\\+15 of the origin"),
    (ring(), "its nodes form a ring"),
    (
        animated(channel={"sampler": 7}),
        "translation of node 0 in animation 0 refers to samplers 7, which is missing",
    ),
    (animated(channel={"target": None}), r"animations\[0\]\.channels\[0\]\.target must be an object"),
    (animated(sampler={"interpolation": "BEZIER"}), 'must be "CUBICSPLINE", "LINEAR" or "STEP", got "BEZ'),
    (animated(width=1), "1 number a time and 3 a value, got 1 and 1"),
    (animated(values=np.ones((2, 3))), "got 3 times and 2 values"),
    (animated(times=[0, 2, 1]), "the times of .* must be finite and ascend"),
    (animated(values=np.full((3, 3), np.nan)), "must be finite, with values below 1e18"),
    (animated("rotation", 4, values=np.zeros((3, 4))), "must not be zero"),
    (animated(times=[0, 1, 1e6]), "moves for 1,000,000 s, which is more than 50,000"),
    (animated(buffer={"uri": "../other.bin"}), "'../other.bin', which lies outside its folder"),
    (animated(node={"matrix": IDENTITY}), "node 0 has a matrix, so it cannot be animated"),
    (animated(top={"animations": [3]}), r"animations\[0\] must be an object, got 3"),
]


@for_each("model, sentence", BROKEN)
def test_what_is_broken_is_named(tmp_path, model, sentence):
    refuse(write(model, tmp_path), sentence, load_cameras)


@for_each(
    "name, content, sentence",
    [
        ("a.glb", b"", "is empty"),
        ("a.glb", b"glTF\2", "is damaged|version"),
        ("a.abc", b"Ogawa", "is an Alembic scene, which is not read; export its cameras as glTF"),
    ],
)
def test_a_file_that_is_no_model(tmp_path, name, content, sentence):
    refuse_bytes(tmp_path / name, content, sentence, load_cameras)


def test_orthographic_cameras_are_left_out_or_refused(tmp_path):
    model = CameraModel()
    model.camera("Plan")
    model.top["cameras"][0] = {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1}}
    with pytest.raises(SceneError, match="camera 'Plan' must be a perspective one; export it again as such"):
        load_cameras(write(model, tmp_path))
    model.camera("Camera")
    with pytest.warns(SceneWarning, match="camera 'Plan' is no perspective one and was left out"):
        assert len(load_cameras(write(model, tmp_path))) == 1


def test_a_camera_around_an_exported_scene_comes_back_in_its_coordinates(tmp_path):
    up = np.array([0.6, -0.8, 0.0])
    path, first_view = tmp_path / "scene.glb", FirstView(np.eye(3), up, 0.0, 0.0)
    write_scene(make(10), path, first_view=first_view)
    model, binary = chunks_of(path)
    model["cameras"] = [{"type": "perspective", "perspective": LENS}]
    model["nodes"].append({"camera": 0, "translation": [1, 2, 3]})
    model["scenes"][0]["nodes"].append(1)
    write_chunks(path, model, binary)
    (camera,) = load_cameras(path)
    position, rotation = pose(camera)
    assert (np.linalg.norm(position), position @ up) == pytest.approx((14**0.5, 2))
    np.testing.assert_allclose(rotation[:, 1], up, atol=1e-6)


def test_cameras_turn_the_shorter_way() -> None:
    """Keys of equal rotations may have quaternions of other signs."""
    first, second = np.array([[1.0, 0, 0, 0]]), np.array([[np.cos(0.3), 0, np.sin(0.3), 0]])
    middle = np.array([[np.cos(0.15), 0, np.sin(0.15), 0]])
    for sign in (1, -1):
        np.testing.assert_allclose(slerp(first, sign * second, np.array([[0.5]])), middle, atol=1e-12)
