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
from tests.kit.for_each import for_each  # noqa: E402
from tests.rendering.strokes import bristles  # noqa: E402
from tests.rendering.test_project_backward import CAMERA, scene_of  # noqa: E402
from tests.scenes import real_scene  # noqa: E402

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
    assert ba.render(ba.Gaussians.of(scene), CAMERA, TEXTURES[kind], depth=False).depth is None


def test_strokes_and_colours_are_taken_by_name():
    scene = scene_of(50, 3)
    expected = bg.render(scene, CAMERA, bg.StrokeTexture.open("flat"))
    actual = ba.render(ba.Gaussians.of(scene), CAMERA, "flat")
    np.testing.assert_array_equal(actual.over("navy"), expected.over("navy"))
    assert not np.array_equal(expected.over("navy"), expected.over("white"))


@cache
def strokes_of(name):
    """2000 float32 strokes of a trained scene, and a camera that sees it whole."""
    scene = bg.load(real_scene(name))
    camera = frame_scene(scene, width=400, height=400, up=up_vector("+z" if "chair" in name else "-y"))
    return bg.cluster(bg.prune(scene, 0.7), 2000).astype(np.float32), camera


@for_each("name", ["koala.ply", "derived/chair.ply"])
@for_each("stroke", ["swirl", "flat", "gaussian"])
def test_float32_gradients_are_those_of_float64_on_trained_scenes(name, stroke):
    """2000 strokes; a loss by colour, alpha and depth. The difference is taken value by value.

    The derivative of a picture jumps where a pixel lies on the edge of a box or on a line of texels. There
    the two precisions may take different sides, and one stroke be off by some 5 %: three such strokes are
    allowed.
    """
    strokes, camera = strokes_of(name)
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
        print(f"{name} {stroke} {column}: {norms[column]:.1e} of {float(double.norm()):.3g}")
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


def test_arguments_and_results_are_not_copied():
    strokes = ba.Gaussians.of(scene_of(20))
    for name in GAUSSIAN_COLUMNS:
        assert np.shares_memory(getattr(strokes.numpy(), name), getattr(strokes, name).numpy())
    boxes = ba.project(strokes, CAMERA)
    boxes.colors.mul_(2)  # their own memory, free to be changed


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


def test_a_step_down_the_gradient_lowers_the_loss():
    strokes = ba.Gaussians.of(scene_of(60, 1, dtype=np.float32), requires_grad=True)
    target = torch.full((CAMERA.height, CAMERA.width, 3), 0.3)
    losses = []
    optimizer = torch.optim.Adam(columns(strokes).values(), lr=1e-3)
    for _ in range(10):
        with torch.no_grad():
            strokes.opacities.clamp_(0, 1)
            strokes.scales.clamp_(min=1e-4)
        optimizer.zero_grad()
        loss = ((ba.render(strokes, CAMERA, bristles()).over((1, 1, 1)) - target) ** 2).mean()
        loss.backward()
        optimizer.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.95 * losses[0]
