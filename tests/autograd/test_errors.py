"""What brushgs.autograd refuses, by name."""

import subprocess
import sys

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install torch")

import brushgs.autograd as ba  # noqa: E402
from tests.rendering.strokes import boxes_of, bristles, softened  # noqa: E402
from tests.rendering.test_project_backward import CAMERA, scene_of  # noqa: E402

SIZE = {"width": 20, "height": 20}
BOXES = boxes_of([[9, 9]], 4.0)


def strokes(**changes):
    given = vars(scene_of(4)).items()
    columns = {name: torch.tensor(values) for name, values in given if values is not None}
    return ba.Gaussians(**{**columns, **changes})


def test_other_types_and_dtypes_are_refused():
    with pytest.raises(TypeError, match="Gaussians: means must be a torch tensor, got ndarray"):
        strokes(means=np.zeros((4, 3)))
    with pytest.raises(TypeError, match="Gaussians: scales must be float64 like means, got float32"):
        strokes(scales=torch.ones(4, 3, dtype=torch.float32))
    with pytest.raises(
        TypeError, match=r"Gaussians: means must be float32 or float64, got float16; call .float\(\)"
    ):
        strokes(means=torch.zeros(4, 3, dtype=torch.float16))
    with pytest.raises(TypeError, match=r"Gaussians: sh must be on the CPU, got meta; call .cpu\(\) on it"):
        strokes(sh=torch.zeros(4, 4, 3, dtype=torch.float64, device="meta"))
    with pytest.raises(
        TypeError, match=r"project: gaussians must be brushgs.autograd.Gaussians, got Gaussians; use G"
    ):
        ba.project(scene_of(4), CAMERA)
    with pytest.raises(
        TypeError, match=r"rasterize: boxes must be brushgs.autograd.Boxes, got Boxes; use Boxes.of"
    ):
        ba.rasterize(BOXES, bristles(), **SIZE)
    with pytest.raises(
        TypeError,
        match=r"texture must be a StrokeTexture, .*, a path or a picture as an array, got int",
    ):
        ba.render(strokes(), CAMERA, 3)


def test_wrong_values_are_refused_where_they_are_used():
    with pytest.raises(ValueError, match="Gaussians: opacities must lie in 0 to 1"):
        ba.project(strokes(opacities=torch.full((4,), 1.5, dtype=torch.float64)), CAMERA)
    with pytest.raises(ValueError, match=r"Gaussians: quats must have shape \[N=4, 4\], got \[4, 3\]"):
        strokes(quats=torch.ones(4, 3, dtype=torch.float64)).numpy()
    boxes = ba.Boxes.of(boxes_of([[9, 9], [9, 9]], 4.0))
    boxes.depths.copy_(torch.tensor([2.0, 1.0]))
    with pytest.raises(ValueError, match="Boxes: depths must ascend"):
        ba.rasterize(boxes, bristles(), **SIZE)
    with pytest.raises(
        ValueError, match=r"over: background must have shape \[3\] or \[20, 20, 3\], got \[4\]"
    ):
        ba.rasterize(ba.Boxes.of(BOXES), bristles(), **SIZE).over((1, 1, 1, 1))


def test_the_soft_order_is_refused_with_the_cure():
    for call in (
        lambda: ba.project(strokes(), CAMERA, order="soft"),
        lambda: ba.render(strokes(), CAMERA, bristles(), order="soft"),
    ):
        with pytest.raises(
            ValueError, match="order must be \"depth\", got 'soft'; the soft order has no gradient"
        ):
            call()
    with pytest.raises(
        ValueError, match='Boxes: boxes must have no softness here; project with order="depth"'
    ):
        ba.Boxes.of(softened(BOXES, 0.1))


@pytest.mark.parametrize("who", ["project", "rasterize"])
def test_second_derivatives_are_refused(who):
    if who == "project":
        leaf = strokes().means.requires_grad_()
        out = ba.project(strokes(means=leaf), CAMERA).centers
    else:
        leaf = torch.tensor(BOXES.centers, requires_grad=True)
        boxes = ba.Boxes(leaf, *(torch.tensor(c) for c in list(vars(BOXES).values())[1:7]))
        out = ba.rasterize(boxes, bristles(), **SIZE).rgb
    (first,) = torch.autograd.grad(out.square().sum(), leaf, create_graph=True)
    assert first.any()
    with pytest.raises(RuntimeError, match="twice a function that was marked with @once_differentiable"):
        first.sum().backward()


def test_changing_a_tensor_between_forward_and_backward_is_noticed():
    tensors = strokes(means=strokes().means.requires_grad_())
    boxes = ba.project(tensors, CAMERA)
    with torch.no_grad():
        tensors.scales.mul_(2)
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        boxes.centers.sum().backward()


def test_without_torch_the_import_says_what_to_install():
    code = "import sys; sys.modules['torch'] = None\nimport brushgs.autograd"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "brushgs.autograd: needs PyTorch, which is not installed; pip install torch" in run.stderr
