"""Splats in USD stages: what usd-core finds in ours, and what we find in stages that usd-core wrote."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.formats import load_cameras, read_scene
from brushgs.formats import usd as process
from brushgs.formats.scenes import usd as usd_write
from brushgs.formats.scenes.write import write_scene
from brushgs.values.camera import FirstView
from tests.io.scenes.test_written import make
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdVol, Vt

UP = np.array([0.6, -0.8, 0.0])
VIEW = FirstView(np.arange(12.0).reshape(4, 3), UP, 1 / 3, -0.1)


def opened(path):
    """The prim of splats as a program of USD finds it."""
    stage = Usd.Stage.Open(str(path))
    (prim,) = [prim for prim in stage.Traverse() if prim.IsA(UsdVol.ParticleField3DGaussianSplat)]
    assert stage.GetDefaultPrim() == prim
    return stage, UsdVol.ParticleField3DGaussianSplat(prim)


@for_each("suffix, num_terms", [(".usd", 1), (".usda", 16), (".usdc", 16), (".usdz", 1)])
def test_usd_finds_what_the_schema_asks_for(tmp_path, suffix, num_terms):
    written = make(50, num_terms)
    bg.save(written, tmp_path / f"a{suffix}")
    _stage, prim = opened(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(np.array(prim.GetPositionsAttr().Get()), written.means)
    np.testing.assert_allclose(np.array(prim.GetScalesAttr().Get()), written.scales, rtol=1e-6)
    np.testing.assert_array_equal(np.array(prim.GetOpacitiesAttr().Get()), written.opacities)
    quats = [[quat.GetReal(), *quat.GetImaginary()] for quat in prim.GetOrientationsAttr().Get()]
    expected = written.quats / np.linalg.norm(written.quats, axis=1, keepdims=True)
    np.testing.assert_allclose(quats, expected, atol=1e-6)
    assert prim.GetRadianceSphericalHarmonicsDegreeAttr().Get() == round(num_terms**0.5) - 1
    # Of one particle after the other, with all of its coefficients together.
    coefficients = np.array(prim.GetRadianceSphericalHarmonicsCoefficientsAttr().Get())
    np.testing.assert_array_equal(coefficients.reshape(50, num_terms, 3), written.sh)
    low, high = np.array(prim.GetExtentAttr().Get())
    assert (low <= written.means.min(axis=0)).all()
    assert (high >= written.means.max(axis=0)).all()
    defined = Usd.SchemaRegistry().FindConcretePrimDefinition("ParticleField3DGaussianSplat")
    for attribute in prim.GetPrim().GetAuthoredAttributes():
        if not attribute.GetName().startswith("xformOp:"):
            spec = defined.GetSchemaAttributeSpec(attribute.GetName())
            assert attribute.GetTypeName() == spec.typeName
            assert attribute.GetVariability() == spec.variability


def test_a_turned_prim_and_a_camera_around_it_come_back_in_the_coordinates_of_the_scene(tmp_path):
    written = make(30, 9)
    write_scene(written, tmp_path / "a.usdc", first_view=VIEW)
    stage, prim = opened(tmp_path / "a.usdc")
    matrix = np.array(prim.ComputeLocalToWorldTransform(Usd.TimeCode.Default())).T
    np.testing.assert_allclose(matrix[:3, :3] @ UP, [0, 1, 0], atol=1e-12)
    found, notes = read_scene(tmp_path / "a.usdc")
    np.testing.assert_array_equal(found.means, written.means)
    np.testing.assert_array_equal(notes.first_view.up, UP)
    UsdGeom.Camera.Define(stage, "/Camera").AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    stage.GetRootLayer().Save()
    (camera,) = load_cameras(tmp_path / "a.usdc")
    np.testing.assert_allclose(np.linalg.norm(camera.position), np.linalg.norm([1, 2, 3]))
    assert camera.position @ UP == pytest.approx(2)
    assert camera.viewmat[:3, :3] @ UP == pytest.approx([0, -1, 0])  # up in the picture


def stage_of_others(path, *, half=False, terms=4):
    """A stage as other programs write it: numbers of one or both sizes, a prim that is placed, +z up."""
    rng = np.random.default_rng(4)
    columns = {"Positions": rng.normal(size=(20, 3)), "Orientations": rng.normal(size=(20, 4))}
    columns |= {"Scales": rng.uniform(0.01, 0.1, (20, 3)), "Opacities": rng.uniform(0.1, 0.9, 20)}
    columns["RadianceSphericalHarmonicsCoefficients"] = rng.normal(size=(20 * terms, 3)) * 0.2
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    prim = UsdVol.ParticleField3DGaussianSplat.Define(stage, "/World/Splats")
    floats = "", Vt.Vec3fArray, Gf.Quatf, Vt.FloatArray
    name, vec, quat, number = ("h", Vt.Vec3hArray, Gf.Quath, Vt.HalfArray) if half else floats
    for attribute, values in columns.items():
        stored = values.astype(np.float16 if half else np.float32)
        if attribute == "Orientations":
            stored = [quat(*map(float, row)) for row in values]
        else:
            stored = (number if values.ndim == 1 else vec).FromNumpy(stored)
        getattr(prim, f"Create{attribute}{name}Attr")().Set(stored)
    prim.CreateRadianceSphericalHarmonicsDegreeAttr().Set(round(terms**0.5) - 1)
    stage.Save()
    return stage, list(columns.values())


@for_each("half", [False, True])
def test_a_stage_of_others_is_read_with_its_numbers_of_either_size(tmp_path, half):
    path = tmp_path / f"{half}.usdc"
    _, (means, quats, scales, opacities, coefficients) = stage_of_others(path, half=half)
    found, notes = read_scene(path)
    rtol = 1e-3 if half else 1e-6
    np.testing.assert_allclose(found.means, means, rtol=rtol, atol=rtol)
    np.testing.assert_allclose(found.quats, quats, rtol=rtol, atol=rtol)
    np.testing.assert_allclose(found.scales, scales, rtol=rtol)
    np.testing.assert_allclose(found.opacities, opacities, rtol=rtol)
    np.testing.assert_allclose(found.sh.reshape(-1, 3), coefficients, rtol=rtol, atol=rtol)
    assert (notes.up, notes.is_strokes, notes.scene) == ("+z", False, None)


def test_a_prim_that_is_placed_is_read_where_it_is(tmp_path):
    stage, (means, quats, scales, *_) = stage_of_others(tmp_path / "a.usda", terms=1)
    world = UsdGeom.Xform.Define(stage, "/World")
    world.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    world.AddRotateZOp().Set(90.0)
    world.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    stage.Save()
    found = bg.load(tmp_path / "a.usda")
    turn = Rotation.from_euler("z", 90, degrees=True)
    np.testing.assert_allclose(found.means, 2 * turn.apply(means) + [1, 2, 3], atol=1e-5)
    np.testing.assert_allclose(found.scales, 2 * scales, rtol=1e-5)
    expected = turn * Rotation.from_quat(quats, scalar_first=True)
    turns = Rotation.from_quat(found.quats, scalar_first=True)
    np.testing.assert_allclose(turns.as_matrix(), expected.as_matrix(), atol=1e-5)


def set_on(name, value):
    return lambda stage: stage.GetPrimAtPath("/World/Splats").GetAttribute(name).Set(value)


DEGREE = "radiance:sphericalHarmonicsDegree"


@for_each(
    "change, sentence",
    [
        (set_on("scales", Vt.Vec3fArray(3)), "attribute scales must have 20 rows, like positions, got 3"),
        (set_on(DEGREE, 99), "must have a sphericalHarmonicsDegree of 0 to 10, got 99"),
        (lambda stage: stage.RemovePrim("/World/Splats"), "is a USD stage without Gaussian splats"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path, change, sentence):
    path = tmp_path / f"{sentence[:9]}.usda"
    stage, _ = stage_of_others(path)
    change(stage)
    stage.Save()
    refuse(path, sentence)


@pytest.mark.filterwarnings("ignore:.*the notes on its strokes .* cannot be read")
def test_notes_that_are_damaged_are_left_out(tmp_path):
    stage, _ = stage_of_others(tmp_path / "a.usda")
    for notes in ("[" * 9999, "3", json.dumps({"turn": [0, 0, 0, 1], "scene": 3})):
        stage.GetPrimAtPath("/World/Splats").SetCustomDataByKey("brushgs", notes)
        stage.Save()
        found = read_scene(tmp_path / "a.usda")[1]
        assert (found.scene, found.first_view) == (None, None)


def test_without_the_package_a_sentence_says_how_to_install_it(tmp_path, monkeypatch):
    stage_of_others(tmp_path / "a.usda")
    monkeypatch.setattr(process, "PACKAGE", "no_such_package")
    refuse(tmp_path / "a.usda", r"usd-core reads; install it with pip install 'brushgs\[usd\]'")
    assert usd_write.is_usd_here is process.is_usd_here
    sentence = r"usd-core writes; install it with pip install 'brushgs\[usd\]'"
    refuse(tmp_path / "b.usda", sentence, lambda path: bg.save(make(3), path))
