"""Cameras of USD stages, against what usd-core itself computes of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brushgs.formats import load_cameras
from brushgs.formats import usd as process
from brushgs.formats.cameras.read import read_cameras
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom

POINTS = np.random.default_rng(3).normal(size=(40, 3))


def seen_by_usd(stage: Any, prim: str, time: float, size: tuple[int, int], points: np.ndarray) -> np.ndarray:
    """Pixels [N, 2] and depths [N, 1] of points of the stage, by the frustum of usd-core."""
    frustum = UsdGeom.Camera(stage.GetPrimAtPath(prim)).GetCamera(Usd.TimeCode(time)).frustum
    view = np.array(frustum.ComputeViewMatrix())
    clip = np.c_[points, np.ones(len(points))] @ view @ np.array(frustum.ComputeProjectionMatrix())
    device = clip[:, :2] / clip[:, 3:]
    pixels = (device * [0.5, -0.5] + 0.5) * size
    return np.c_[pixels, -(np.c_[points, np.ones(len(points))] @ view)[:, 2]]


def seen(camera: Any, points: np.ndarray) -> np.ndarray:
    """The same by a camera."""
    there = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    image = there @ camera.K.T
    return np.c_[image[:, :2] / image[:, 2:], there[:, 2]]


def new_stage(path: Path, up: str = "Y") -> Any:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    return stage


def add_camera(stage: Any, prim: str, **attributes: object) -> Any:
    camera = UsdGeom.Camera.Define(stage, prim)
    values = {"horizontalAperture": 36.0, "verticalAperture": 24.0, "focalLength": 40.0} | attributes
    for name, value in values.items():
        camera.GetPrim().GetAttribute(name).Set(value)
    camera.GetClippingRangeAttr().Set(Gf.Vec2f(0.25, 1000))
    return camera


def moving_stage(path: Path) -> Any:
    """A camera that moves for two seconds of 30 frames under an arm that turns, and one that stands still."""
    stage = new_stage(path, "Z")
    stage.SetTimeCodesPerSecond(30)
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(61)
    add_camera(stage, "/Still").AddTranslateOp().Set(Gf.Vec3d(0, 0, 9))
    arm = UsdGeom.Xform.Define(stage, "/Arm")
    turn = arm.AddRotateZOp()
    arm.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    shot = add_camera(stage, "/Arm/Shot", horizontalApertureOffset=3.0, verticalApertureOffset=-2.0)
    move = shot.AddTranslateOp()
    shot.AddRotateXYZOp().Set(Gf.Vec3f(10, 20, 30))
    for frame in range(1, 62):
        turn.Set(1.5 * frame, frame)
        move.Set(Gf.Vec3d(0.1 * frame, 0, 6 + 0.05 * frame), frame)
        shot.GetFocalLengthAttr().Set(30 + 0.5 * frame, frame)
    stage.Save()
    return stage


@for_each("suffix", [".usd", ".usda", ".usdc", ".usdz"])
def test_a_camera_sees_what_usd_says_it_sees(tmp_path, suffix):
    path = tmp_path / f"{suffix[1:]}{suffix}".replace(".usdz", ".usdc")
    stage = new_stage(path)
    camera = add_camera(stage, "/Camera", horizontalApertureOffset=4.0, verticalApertureOffset=3.0)
    camera.AddTranslateOp().Set(Gf.Vec3d(1, 2, 8))
    camera.AddRotateXYZOp().Set(Gf.Vec3f(5, -10, 15))
    stage.Save()
    if suffix == ".usdz":
        from pxr import UsdUtils

        path = tmp_path / "a.usdz"
        assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(tmp_path / "usdz.usdc")), str(path))
    (found,) = load_cameras(path)
    assert (found.width, found.height, found.near) == (1280, 854, 0.25)
    # 36 x 24 is 1280 x 853.3: the principal point is as far off the middle in heights.
    np.testing.assert_allclose(found.K[1, 1], 40 / 24 * 854)
    np.testing.assert_allclose(found.K[:2, 2] - [640, 427], np.array([-4, 3]) / 24 * 854)
    expected = seen_by_usd(stage, "/Camera", 0, (1281, 854), POINTS) - [0.5, 0, 0]
    np.testing.assert_allclose(seen(found, POINTS), expected, atol=1e-3)


def test_the_frames_of_an_animated_camera_are_those_of_the_stage(tmp_path):
    stage = moving_stage(tmp_path / "move.usda")
    file = read_cameras(tmp_path / "move.usda")
    assert (len(file.cameras), file.fps) == (61, 30)
    assert file.choice == "the animated camera 'Shot' of 2"
    for frame in (1, 2, 30, 61):
        camera = file.cameras[frame - 1]
        expected = seen_by_usd(stage, "/Arm/Shot", frame, (1281, 854), POINTS) - [0.5, 0, 0]
        np.testing.assert_allclose(seen(camera, POINTS), expected, rtol=1e-5, atol=1e-3)


def test_views_are_those_of_the_scene_where_the_stage_has_it(tmp_path):
    stage = moving_stage(tmp_path / "move.usda")
    scene = UsdGeom.Xform.Define(stage, "/root/brushgs_scene_001")
    scene.AddTranslateOp().Set(Gf.Vec3d(0.5, 0, 1))
    scene.AddRotateXOp().Set(90.0)
    scene.AddScaleOp().Set(Gf.Vec3f(3, 3, 3))
    stage.Save()
    placed = np.array(scene.ComputeLocalToWorldTransform(0))
    camera = load_cameras(tmp_path / "move.usda")[29]
    in_stage = np.c_[POINTS, np.ones(len(POINTS))] @ placed
    expected = seen_by_usd(stage, "/Arm/Shot", 30, (1281, 854), in_stage[:, :3]) - [0.5, 0, 0]
    np.testing.assert_allclose(seen(camera, POINTS)[:, :2], expected[:, :2], rtol=1e-4, atol=1e-2)
    np.testing.assert_allclose(seen(camera, POINTS)[:, 2], expected[:, 2] / 3, rtol=1e-5)
    assert camera.near == pytest.approx(0.25 / 3)


def test_a_layer_beside_the_file_is_read_and_one_elsewhere_is_not(tmp_path):
    (tmp_path / "shots").mkdir()
    stage = new_stage(tmp_path / "shots" / "shot.usda")
    add_camera(stage, "/Camera")
    stage.Save()
    top = Sdf.Layer.CreateNew(str(tmp_path / "top.usda"))
    top.subLayerPaths.append("./shots/shot.usda")
    top.Save()
    assert len(load_cameras(tmp_path / "top.usda")) == 1
    inner = Sdf.Layer.CreateNew(str(tmp_path / "shots" / "inner.usda"))
    inner.subLayerPaths.append("../top.usda")
    inner.Save()
    sentence = r"names the file '\.\./top\.usda', which lies outside its folder"
    refuse(tmp_path / "shots" / "inner.usda", sentence, load_cameras)


@for_each(
    "cameras, sentence",
    [
        ({}, "holds no camera; export it with its cameras"),
        ({"/Plan": {"projection": "orthographic"}}, "camera 'Plan' must be a perspective one; export it"),
        ({"/A": {"focalLength": 0.0}}, "camera 'A' must have a focal length, apertures and a near clipping"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path, cameras, sentence):
    path = tmp_path / f"{len(sentence)}.usda"
    stage = new_stage(path)
    for prim, attributes in cameras.items():
        add_camera(stage, prim, **attributes)
    stage.Save()
    refuse(path, sentence, load_cameras)


# The first makes usd-core call itself until the process dies.
NESTED = b"#usda 1.0\n" + b'def "a" {\n' * 100_000


def test_a_damaged_file_gives_a_sentence_even_where_it_ends_the_process_that_reads_it(tmp_path, monkeypatch):
    damaged = "is damaged, or no USD file; export it again"
    for content, sentence in ((NESTED, damaged), (b"PXR-USDC" + b"\xff" * 99, damaged), (b"", "is empty")):
        refuse_bytes(tmp_path / "a.usd", content, sentence, load_cameras)
    moving_stage(tmp_path / "a.usda")
    monkeypatch.setattr(process, "_MIN_SECONDS", 0)
    sentence = "was not read within 0 s; export only what is needed of it"
    refuse(tmp_path / "a.usda", sentence, load_cameras)
