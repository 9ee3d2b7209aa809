"""Strokes moved on tensors: as `Pose.moved` moves arrays, with the derivative of that."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install torch")

import brushgs.autograd as ba  # noqa: E402
from brushgs.rendering.backward import GAUSSIAN_COLUMNS  # noqa: E402
from brushgs.rendering.motion import COLOR, NUM_NUMBERS, OPACITY, SHIFT, SIZE, TURN, Pose  # noqa: E402
from brushgs.values.quats import normalized  # noqa: E402
from tests.kit.for_each import for_each  # noqa: E402
from tests.rendering.test_project_backward import scene_of  # noqa: E402

NUM = 9
MOVING = np.array([1, 2, 5, 11], np.int32)  # of no row: 11


@pytest.fixture
def strokes():
    """Rows 1, 5 and 7 move; ids in any order, one of them twice, one of no stroke."""
    ids = np.array([0, 5, 3, 4, 7, 2, 9, 5, -1], np.int32)
    return replace(scene_of(NUM, 1, seed=3), ids=ids)


def pose_of(seed=0, *, far=0.0, opacity=None):
    g = np.random.default_rng(seed)
    numbers = np.zeros((len(MOVING), NUM_NUMBERS), np.float32)
    numbers[:, SHIFT] = g.normal(0, 0.5, (len(MOVING), 3))
    numbers[:, TURN] = normalized(g.normal(0, 1, (len(MOVING), 4)))
    numbers[:, SIZE] = g.normal(0, 0.3, len(MOVING))
    numbers[:, OPACITY] = g.uniform(0.2, 0.9, len(MOVING)) if opacity is None else opacity
    numbers[:, COLOR] = g.normal(0, 0.2, (len(MOVING), 3))
    return Pose(MOVING, far + g.normal(0, 1, (len(MOVING), 3)), numbers)


@for_each("has_color", [True, False])
@for_each("dtype", [np.float32, np.float64])
@for_each("far", [0.0, 1e4])
def test_tensors_move_as_arrays_do(strokes, dtype, far, has_color):
    strokes = replace(strokes, means=strokes.means + far).astype(dtype)
    pose = pose_of(far=far)
    expected = pose.moved(strokes, has_color=has_color)
    found = ba.moved(ba.Gaussians.of(strokes), pose, has_color=has_color).numpy()
    for name in GAUSSIAN_COLUMNS:
        column = getattr(found, name)
        assert column.dtype == dtype
        np.testing.assert_allclose(column, getattr(expected, name), rtol=1e-6, atol=1e-6, err_msg=name)
    assert not np.array_equal(found.means[[1, 5, 7]], strokes.means[[1, 5, 7]])
    np.testing.assert_array_equal(found.ids, strokes.ids)


def test_what_rests_is_as_it_was_bit_for_bit(strokes):
    found = ba.moved(ba.Gaussians.of(strokes), pose_of()).numpy()
    rests = ~np.isin(strokes.ids, MOVING)
    for name in GAUSSIAN_COLUMNS:
        np.testing.assert_array_equal(getattr(found, name)[rests], getattr(strokes, name)[rests])
    for at_rest in (replace(strokes, ids=None), replace(strokes, ids=np.full(NUM, -1, np.int32))):
        tensors = ba.Gaussians.of(at_rest)
        assert ba.moved(tensors, pose_of()) is tensors


def test_opacities_stay_in_range_and_have_no_gradient_beyond_it(strokes):
    tensors = ba.Gaussians.of(strokes, requires_grad=True)
    found = ba.moved(tensors, pose_of(opacity=1e3))
    assert found.opacities.detach().max() == 1
    found.opacities.sum().backward()
    np.testing.assert_array_equal(tensors.opacities.grad, ~np.isin(strokes.ids, MOVING))


@for_each("name", GAUSSIAN_COLUMNS)
def test_gradients_are_those_of_finite_differences(strokes, name):
    columns = {other: torch.tensor(getattr(strokes, other)) for other in GAUSSIAN_COLUMNS}
    columns[name].requires_grad_()

    def of_one(values):
        tensors = ba.Gaussians(**{**columns, name: values}, ids=torch.tensor(strokes.ids))
        found = ba.moved(tensors, pose_of())
        return tuple(getattr(found, other) for other in GAUSSIAN_COLUMNS)

    assert torch.autograd.gradcheck(of_one, (columns[name],), eps=1e-6, rtol=1e-6, atol=1e-8)


def test_wrong_ids_and_arrays_are_refused(strokes):
    tensors = ba.Gaussians.of(strokes)
    with pytest.raises(TypeError, match="Gaussians: ids must be a torch tensor of int32, got int64"):
        replace(tensors, ids=tensors.ids.long())
    with pytest.raises(TypeError, match=r"moved: gaussians must be brushgs\.autograd.Gaussians, got Gaus"):
        ba.moved(strokes, pose_of())
