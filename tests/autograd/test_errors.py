"""What brushgs.autograd refuses, by name."""

import subprocess
import sys

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install torch")

import brushgs.autograd as ba  # noqa: E402
from tests.kit.for_each import for_each  # noqa: E402
from tests.rendering.strokes import boxes_of, bristles, softened  # noqa: E402
from tests.rendering.test_project_backward import CAMERA, scene_of  # noqa: E402

SIZE = {"width": 20, "height": 20}
BOXES, ONES = boxes_of([[9, 9]], 4.0), torch.ones(4, dtype=torch.float64)
ON_META = torch.zeros(4, 4, 3, dtype=torch.float64, device="meta")


def swapped():
    boxes = ba.Boxes.of(boxes_of([[9, 9], [9, 9]], 4.0))
    boxes.depths.copy_(torch.tensor([2.0, 1.0]))
    return boxes


def painted(boxes):
    return ba.rasterize(ba.Boxes.of(boxes), bristles(), **SIZE)


def strokes(**changes):
    given = vars(scene_of(4)).items()
    columns = {name: torch.tensor(values) for name, values in given if values is not None}
    return ba.Gaussians(**{**columns, **changes})


TYPES = [
    (lambda: strokes(scales=torch.ones(4, 3)), "Gaussians: scales must be float64 like means, got float32"),
    (lambda: strokes(means=np.zeros((4, 3))), "Gaussians: means must be a torch tensor, got ndarray"),
    (lambda: strokes(means=torch.zeros(4, 3).half()), r"float32 or float64, got float16; call .float\(\)"),
    (lambda: strokes(sh=ON_META), r"Gaussians: sh must be on the CPU, got meta; call .cpu\(\) on it"),
    (lambda: ba.project(scene_of(4), CAMERA), "must be brushgs.autograd.Gaussians, got Gaussians; use G"),
    (lambda: ba.rasterize(BOXES, bristles(), **SIZE), "brushgs.autograd.Boxes, got Boxes; use Boxes.of"),
    (lambda: ba.render(strokes(), CAMERA, 3), "texture must be a StrokeTexture, .* got int"),
]
VALUES = [
    (lambda: painted(BOXES).over([1] * 4), r"over: background must have shape .*\[20, 20, 3\], got \[4\]"),
    (lambda: ba.rasterize(swapped(), bristles(), **SIZE), "Boxes: depths must ascend"),
    (lambda: ba.project(strokes(opacities=1.5 * ONES), CAMERA), "Gaussians: opacities must lie in 0 to 1"),
    (lambda: ba.render(strokes(), CAMERA, "flat", order="soft"), "'soft'; the soft order has no gradient"),
    (lambda: painted(softened(BOXES, 0.1)), 'must have no softness here; project with order="depth"'),
]


@for_each("call, message, error", [(*t, TypeError) for t in TYPES] + [(*v, ValueError) for v in VALUES])
def test_wrong_tensors_and_options_are_refused_by_name(call, message, error):
    with pytest.raises(error, match=message):
        call()


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
