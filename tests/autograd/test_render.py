"""brushgs.autograd as a whole: the same pictures, float32 beside float64, who gets a gradient and who not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install torch")

import brushgs as bg  # noqa: E402
import brushgs.autograd as ba  # noqa: E402
from brushgs.cameras.framing import frame_scene, up_vector  # noqa: E402
from brushgs.rendering.backward import GAUSSIAN_COLUMNS  # noqa: E402
from tests.kit import for_each, real_scene  # noqa: E402
from tests.rendering.strokes import bristles  # noqa: E402
from tests.rendering.test_project_backward import CAMERA, scene_of  # noqa: E402

TEXTURES = {"image": bristles(), "gaussian": bg.StrokeTexture.open("gaussian")}


def columns(strokes):
    return {name: getattr(strokes, name) for name in GAUSSIAN_COLUMNS}


@for_each("dtype", [np.float32, np.float64])
@for_each("kind", TEXTURES)
def test_pictures_are_those_of_brushgs_bit_for_bit(kind, dtype):
    scene = scene_of(50, 3, dtype=dtype)
    expected = bg.render(scene, CAMERA, TEXTURES[kind])
    actual = ba.render(ba.Gaussians.of(scene, requires_grad=True), CAMERA, TEXTURES[kind])
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_array_equal(getattr(actual, name).detach(), getattr(expected, name), err_msg=name)
    np.testing.assert_array_equal(actual.over((1, 0.5, 0)).detach(), expected.over((1, 0.5, 0)))
    named = ba.render(ba.Gaussians.of(scene), CAMERA, "flat", depth=False)
    assert named.depth is None
    np.testing.assert_array_equal(named.over("navy"), bg.render(scene, CAMERA, "flat").over("navy"))


@cache
def trained():
    """2000 float32 strokes of a trained scene, and a camera that sees it whole."""
    scene = bg.load(real_scene("koala.ply"))
    camera = frame_scene(scene, width=400, height=400, up=up_vector("-y"))
    return bg.cluster(bg.prune(scene, 0.7), 2000).astype(np.float32), camera


@for_each("stroke", ["flat", "gaussian"])
def test_float32_gradients_are_those_of_float64_on_a_trained_scene(stroke):
    """2000 strokes; a loss by color, alpha and depth. The difference is taken value by value.

    The derivative of a picture jumps where a pixel lies on the edge of a box or on a line of texels. There
    the two precisions may take different sides, and one stroke be off by some 5 %: three such strokes are
    allowed.
    """
    strokes, camera = trained()
    norms, gradients = {}, {}
    for dtype in (np.float32, np.float64):
        tensors = ba.Gaussians.of(strokes.astype(dtype), requires_grad=True)
        frame = ba.render(tensors, camera, bg.StrokeTexture.open(stroke))
        loss = ((frame.over((1, 1, 1)) - 0.4) ** 2).sum() + (frame.depth * frame.alpha).sum()
        loss.backward()
        gradients[dtype] = {n: c.grad.double() for n, c in columns(tensors).items()}
    for column in GAUSSIAN_COLUMNS:
        single, double = (gradients[dtype][column] for dtype in (np.float32, np.float64))
        off = (single - double).reshape(len(double), -1).norm(dim=1)
        norms[column] = float(off.sort().values[:-3].norm() / double.norm())
        assert off.norm() <= 2e-3 * double.norm()
        print(f"{stroke} {column}: {norms[column]:.1e} of {float(double.norm()):.3g}")
        assert double.norm() > 0
        # No row's gradient is missing where the other precision has a large one.
        rows = [g.flatten(1).norm(dim=1) if g.ndim > 1 else g.abs() for g in (single, double)]
        is_large = rows[1] > 1e-3 * rows[1].max()
        assert (rows[0][is_large] > 0.5 * rows[1][is_large]).double().mean() > 0.995
    assert max(norms.values()) <= 3e-4, norms


def test_only_what_requires_a_gradient_gets_one():
    for wanted in GAUSSIAN_COLUMNS:
        strokes = ba.Gaussians.of(scene_of(20, 2))
        getattr(strokes, wanted).requires_grad_()
        ba.render(strokes, CAMERA, bristles()).rgb.sum().backward()
        for name, column in columns(strokes).items():
            assert (column.grad is not None) == (name == wanted)
        assert getattr(strokes, wanted).grad.any()


def test_the_texture_gets_a_gradient_where_it_is_a_tensor():
    strokes = ba.Gaussians.of(scene_of(20), requires_grad=True)
    coverage = torch.tensor(bristles(30, 60).coverage / 255, dtype=torch.float32, requires_grad=True)
    for filter in ("mip", "bilinear", "nearest"):
        coverage.grad = None
        frame = ba.render(strokes, CAMERA, coverage, filter=filter)
        expected = bg.render(scene_of(20), CAMERA, bristles(30, 60), filter=filter)
        np.testing.assert_array_equal(frame.rgb.detach(), expected.rgb)
        frame.rgb.sum().backward()
        assert coverage.grad.dtype == torch.float32
        assert coverage.grad.shape == coverage.shape
        assert coverage.grad.any()


def test_an_antialiased_scene_stays_one():
    arrays = replace(scene_of(9, degree=1), antialiased=True)
    tensors = ba.Gaussians.of(arrays, requires_grad=True)
    assert tensors.numpy().antialiased
    boxes = ba.project(tensors, CAMERA)
    np.testing.assert_array_equal(boxes.opacities.detach().numpy(), bg.project(arrays, CAMERA).opacities)
    boxes.opacities.sum().backward()
    assert tensors.scales.grad.any()  # only the compensation joins the two


def test_tensors_that_are_not_contiguous_give_the_same():
    scene = scene_of(20, 2)
    plain = ba.Gaussians.of(scene, requires_grad=True)
    turned = [torch.tensor(np.moveaxis(c, 0, -1).copy()).requires_grad_() for c in columns(scene).values()]
    strided = ba.Gaussians(*(c.movedim(-1, 0) for c in turned))
    for strokes in (plain, strided):
        frame = ba.render(strokes, CAMERA, bristles())
        (frame.rgb.sum() + frame.alpha.mean()).backward()  # gradients that come expanded
    for (name, expected), actual in zip(columns(plain).items(), turned, strict=True):
        np.testing.assert_array_equal(actual.grad.movedim(-1, 0), expected.grad, err_msg=name)


def test_no_strokes_and_strokes_out_of_sight_give_zeros():
    for scene in (scene_of(0), scene_of(5).take(np.s_[:0])):
        strokes = ba.Gaussians.of(scene, requires_grad=True)
        ba.render(strokes, CAMERA, bristles()).rgb.sum().backward()
        assert strokes.means.grad.shape == (0, 3)
    strokes = ba.Gaussians.of(scene_of(5), requires_grad=True)
    away = ba.Gaussians(**{**columns(strokes), "means": strokes.means + 100})
    ba.render(away, CAMERA, bristles()).rgb.sum().backward()
    for name, column in columns(strokes).items():
        assert not column.grad.any(), name
