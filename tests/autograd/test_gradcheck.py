"""torch's own check of derivatives, in float64, for every named input: small pictures, few strokes."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install torch")

import brushgs.autograd as ba  # noqa: E402
from brushgs.rendering.backward import BOX_COLUMNS, GAUSSIAN_COLUMNS  # noqa: E402
from brushgs.values.camera import Camera  # noqa: E402
from tests.kit.for_each import for_each  # noqa: E402
from tests.rendering.strokes import PATHS, boxes_of, bristles, texture_of  # noqa: E402
from tests.rendering.test_project_backward import directions, scene_of  # noqa: E402

SIZE = {"width": 12, "height": 12}
CAMERA = Camera.look_at((0.3, -0.4, 2.4), (0, 0, 0), **SIZE, near=0.2)
HOW = {"eps": 1e-6, "rtol": 1e-5, "atol": 1e-6}


def check(function, columns, name):
    """By one input, the others held.

    Each output enters by three sums with random weights: a derivative for every pixel would take minutes.
    """
    tensors = {other: torch.tensor(values) for other, values in columns.items()}
    tensors[name].requires_grad_()

    def of_one(values):
        g = torch.Generator().manual_seed(1)
        outputs = function(**{**tensors, name: values})
        weights = [torch.randn((3, *out.shape), generator=g, dtype=out.dtype) for out in outputs]
        return tuple((w * out).flatten(1).sum(1) for w, out in zip(weights, outputs, strict=True))

    assert torch.autograd.gradcheck(of_one, (tensors[name],), **HOW)


def columns_of(value, names):
    return {name: getattr(value, name) for name in names}


def small_boxes():
    """Four strokes over each other, two beyond the picture's edge."""
    g, centers = np.random.default_rng(2), [[4.2, 5.3], [6.1, 4.4], [9.7, 8.2], [1.3, 10.6]]
    half_extents, how = g.uniform(2.5, 5, (4, 2)), {"depths": [1.0, 1.7, 2.1, 4.0]}
    how |= {"angles": g.uniform(-3, 3, 4), "colors": g.uniform(0, 1, (4, 3))}
    return boxes_of(centers, half_extents, opacities=[0.6, 0.95, 0.8, 0.9], **how)


LOCKS = {"directions": directions(3), "scaled directions": directions(3, area_scales=True)}


@for_each("name", GAUSSIAN_COLUMNS)
@for_each(
    ("lock", "fade", "degree"),
    [
        *(("off", False, degree) for degree in range(4)),
        *((lock, fade, 1) for lock in ("anchor", *LOCKS) for fade in (False, True)),
    ],
)
def test_project_of_every_degree_and_lock(lock, fade, degree, name):
    def function(**columns):
        boxes = ba.project(ba.Gaussians(**columns), CAMERA, lock=LOCKS.get(lock, lock), fade=fade)
        return [getattr(boxes, column) for column in BOX_COLUMNS]

    check(function, columns_of(scene_of(3, degree, seed=1, sizes=(0.01, 0.3)), GAUSSIAN_COLUMNS), name)


@for_each("name", BOX_COLUMNS)
@for_each("depth", [False, True])
@for_each("path", PATHS)
def test_rasterize_of_every_filter_and_kernel(path, depth, name):
    kind, filter = PATHS[path]
    boxes, texture = small_boxes(), texture_of(kind)
    ids = torch.tensor(boxes.ids)

    def function(**columns):
        frame = ba.rasterize(ba.Boxes(**columns, ids=ids), texture, **SIZE, filter=filter, depth=depth)
        return [plane for plane in (frame.rgb, frame.alpha, frame.depth) if plane is not None]

    check(function, columns_of(boxes, BOX_COLUMNS), name)


@for_each("name", GAUSSIAN_COLUMNS)
@for_each(
    ("path", "how"),
    [
        ("bilinear", {"lock": "off"}),
        ("mip", {"lock": "anchor"}),
        ("gaussian", {"lock": "anchor"}),
        ("bilinear", {"underpaint": True, "streaks": 0.4}),
    ],
)
def test_render(path, how, name):
    kind, filter = PATHS[path]
    texture, scene = texture_of(kind), scene_of(3, 2, seed=1, sizes=(0.1, 0.4))

    def function(**columns):
        frame = ba.render(ba.Gaussians(**columns), CAMERA, texture, filter=filter, **how)
        return frame.rgb, frame.alpha, frame.depth

    check(function, columns_of(scene, GAUSSIAN_COLUMNS), name)


def test_coverage_by_whole_steps_of_8_bits():
    """Coverage is rounded to 8 bits, so its steps are whole ones: alpha is linear in each texel."""
    boxes = ba.Boxes.of(small_boxes().take(np.s_[:1]))
    coverage = torch.tensor(bristles(5, 7).coverage.clip(20, 235) / 255, requires_grad=True)

    def function(coverage):
        frame = ba.rasterize(boxes, coverage, **SIZE, filter="bilinear", depth=False)
        return frame.rgb, frame.alpha

    assert torch.autograd.gradcheck(function, (coverage,), eps=1 / 255, rtol=1e-9, atol=1e-9)
