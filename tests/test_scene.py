"""The containers: what they refuse and in which words, what they share, and the geometry of a camera."""

import re
from dataclasses import FrozenInstanceError, fields, replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import brushgs as bg
from brushgs.core.threads import at_most
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians

N = 6


def gaussians(dtype=np.float32, terms: int = 4) -> bg.Gaussians:
    return random_gaussians(N, terms=terms, dtype=dtype)


def boxes(dtype=np.float32) -> bg.Boxes:
    g = np.random.default_rng(0)
    shapes = ((N, 2), (N, 2), (N,), (N,), (N, 3), (N,))
    columns = [g.uniform(0, 1, shape).astype(dtype) for shape in shapes]
    columns[3].sort()
    softness, setbacks = (g.uniform(0, 1, N).astype(dtype) for _ in range(2))
    reliefs = g.uniform(0, 1, (N, 2)).astype(dtype)
    return bg.Boxes(*columns, np.arange(N, dtype=np.int32), softness, setbacks, reliefs=reliefs)


def camera(**changes) -> bg.Camera:
    K = [[100, 0, 40], [0, 90, 30], [0, 0, 1]]
    return bg.Camera(**{"viewmat": np.eye(4), "K": K, "width": 80, "height": 60} | changes)


def changed(column: np.ndarray, row: int, value) -> np.ndarray:
    column = column.copy()
    column[row] = value
    return column


def refused(error: type[Exception], message: str):
    return pytest.raises(error, match=f"^{re.escape(message)}")


# Gaussians and Boxes


def columns_of(value):
    return {name: column for name, column in vars(value).items() if isinstance(column, np.ndarray)}


@for_each("make", [gaussians, boxes])
@for_each("dtype", [np.float32, np.float64])
def test_columns_are_read_only_views_without_a_copy(make, dtype):
    source = make(dtype)
    columns = {name: column.copy() for name, column in columns_of(source).items()}
    value = type(source)(**columns)
    for name, column in columns.items():
        assert np.shares_memory(getattr(value, name), column)
        assert column.flags.writeable  # the caller's own array stays as it was
        strided = np.repeat(column, 2, axis=0)[::2]
        assert getattr(replace(value, **{name: strided}), name).flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            getattr(value, name)[0] = 0
    with pytest.raises(FrozenInstanceError):
        setattr(value, next(iter(columns)), None)


@for_each(
    ("name", "shape", "message"),
    [
        ("means", (N, 2), "means must have shape [N=6, 3], got [6, 2]"),
        ("quats", (N, 3), "quats must have shape [N=6, 4], got [6, 3]"),
        ("scales", (N - 1, 3), "scales must have shape [N=6, 3], got [5, 3]"),
        ("opacities", (N, 1), "opacities must have shape [N=6], got [6, 1]"),
        ("sh", (N, 3), "sh must have shape [N=6, k=3, 3], got [6, 3]"),
        ("sh", (N, 5, 3), "sh must have 1, 4, 9 or 16 terms, got 5"),
        ("sh", (N, 0, 3), "sh must have 1, 4, 9 or 16 terms, got 0"),
    ],
)
def test_gaussians_of_a_wrong_shape_are_refused(name, shape, message):
    with refused(ValueError, f"Gaussians: {message}"):
        replace(gaussians(), **{name: np.zeros(shape, np.float32)})


@for_each(
    ("name", "row", "value", "message"),
    [
        ("scales", 2, -0.1, "scales must be >= 0, got 1 other rows, first at 2"),
        ("opacities", 3, 1.5, "opacities must lie in 0 to 1 (decoded, not logits), got 1 other"),
        ("opacities", slice(2, 5), -1, "opacities must lie in 0 to 1 (decoded, not logits), got 3"),
        ("quats", 5, 0, "quats must have a length above zero, got 1 other rows, first at 5"),
    ],
)
def test_values_out_of_range_are_refused_by_column_and_row(name, row, value, message):
    source = gaussians()
    with refused(ValueError, f"Gaussians: {message}"):
        replace(source, **{name: changed(getattr(source, name), row, value)})


def test_extremes_are_legitimate():
    """Sums that overflow, half turns, scales of zero, opacities of zero and one."""
    source = gaussians()
    replace(source, means=np.full((N, 3), 3e38, np.float32))
    replace(source, means=np.array([3e38, -3e38] * 9, np.float32).reshape(N, 3))
    replace(source, quats=changed(source.quats, slice(None), (0, 0, 1, 0)))
    replace(source, scales=0 * source.scales, opacities=np.array([0, 1] * 3, np.float32))


@for_each(
    ("make", "name", "value", "message"),
    [
        (gaussians, "means", [[0, 0, 0], [0, 0]], "must be an array or a list of numbers, in"),
        (gaussians, "opacities", ["1"] * N, "must be an array or a list of numbers, in"),
        (gaussians, "means", np.zeros((N, 3), bool), "must be float32 or float64, got bool"),
        (gaussians, "sh", np.zeros((N, 4, 3)), "must be float32 like means, got float64"),
        (gaussians, "scales", np.ones((N, 3), np.float16), "must be float32 like means, got"),
        (gaussians, "brushes", np.zeros(N), "must be uint8, got float64"),
        (boxes, "ids", [0.0] * N, "must be an array or a list of whole numbers"),
        (boxes, "colors", np.zeros((N, 3), np.uint8), "must be float32 or float64, got uint8"),
        (boxes, "angles", None, "must be a NumPy array, got NoneType"),
        (boxes, "depths", np.arange(N, dtype=float), "must be float32 like centers, got float64"),
        (boxes, "ids", np.arange(N, dtype=float), "must be int32, got float64"),
    ],
)
def test_columns_of_another_type_are_refused(make, name, value, message):
    with refused(TypeError, f"{type(make()).__name__}: {name} {message}"):
        replace(make(), **{name: value})


def test_boxes_must_come_nearest_first():
    source = boxes()
    with refused(ValueError, "Boxes: depths must ascend: sort by depth, got 5 other rows, first at 0"):
        replace(source, depths=source.depths[::-1])
    replace(source, depths=np.full(N, 2, np.float32))  # equal depths are in order


@for_each("make", [gaussians, boxes])
def test_astype_changes_every_column_and_copies_none_in_vain(make):
    source = make(np.float32)
    double = source.astype(np.float64)
    for name, column in columns_of(source).items():
        if name == "ids":
            continue
        assert getattr(double, name).dtype == np.float64
        assert np.shares_memory(getattr(source.astype(np.float32), name), column)
        np.testing.assert_array_equal(getattr(double.astype(np.float32), name), column)


# Camera


RIGID = "viewmat must be a rotation and a translation; remove scale and mir"
PINHOLE = "K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got"


@for_each(
    ("change", "message"),
    [
        ({"viewmat": np.eye(3)}, "viewmat must have shape [4, 4], got [3, 3]"),
        ({"K": np.eye(4)}, "K must have shape [3, 3], got [4, 4]"),
        ({"viewmat": np.eye(4) * np.nan}, "viewmat must be finite, got [[nan"),
        ({"K": np.diag([np.inf, 1, 1])}, "K must be finite, got [[inf"),
        ({"viewmat": np.diag([2.0, 2, 2, 1])}, RIGID),
        ({"viewmat": np.diag([-1.0, 1, 1, 1])}, RIGID),
        ({"viewmat": np.diag([1.0, 1, 1, -1])}, RIGID),
        ({"K": np.diag([-1.0, 1, 1])}, PINHOLE),
        ({"K": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, PINHOLE),
        ({"K": np.diag([1.0, 1, 2])}, PINHOLE),
        ({"width": 0}, "size must be at least 1x1, got 0x60"),
        ({"height": -5}, "size must be at least 1x1, got 80x-5"),
        ({"near": 0.0}, "near must be > 0, got 0.0"),
        ({"near": np.nan}, "near must be > 0, got nan"),
    ],
)
def test_cameras_that_are_none_are_refused(change, message):
    with refused(ValueError, f"Camera: {message}"):
        camera(**change)


@for_each(
    ("change", "message"),
    [
        ({"target": (1, 2, 3)}, "eye and target must differ, got [1.0, 2.0, 3.0] and [1.0, 2.0, 3.0]"),
        ({"target": (np.nan, 0, 0)}, "eye and target must differ"),
        ({"fov_y": 0.0}, "fov_y must be in (0, pi) radians, got 0.0"),
        ({"fov_y": 50}, "fov_y must be in (0, pi) radians, got 50"),
    ],
)
def test_look_at_refuses_what_gives_no_view(change, message):
    with refused(ValueError, f"Camera: {message}"):
        bg.Camera.look_at(**{"eye": (1, 2, 3), "target": (0, 0, 0), "width": 8, "height": 6} | change)


def pixel_of(value: bg.Camera, point) -> np.ndarray:
    """(x, y) in pixels and z of a point in the world."""
    x, y, z = value.viewmat[:3, :3] @ point + value.viewmat[:3, 3]
    return np.array([*(value.K[:2, :2] @ (x / z, y / z) + value.K[:2, 2]), z])


def test_look_at_puts_the_target_in_the_middle_and_up_upwards():
    eye, target = np.array([3.0, -2, 5]), np.array([0.5, 0, 1])
    value = bg.Camera.look_at(eye, target, up=(0, 1, 0), width=200, height=100, fov_y=np.radians(60))
    distance = np.linalg.norm(eye - target)
    np.testing.assert_allclose(pixel_of(value, target), (100, 50, distance), atol=1e-12)
    np.testing.assert_allclose(value.position, eye, atol=1e-12)
    above = pixel_of(value, target + np.array((0, 0.1, 0)))
    assert above[1] < 49
    np.testing.assert_allclose(above[0], 100, atol=1e-9)
    # The top edge lies half the field of view above the axis.
    top = eye + value.viewmat[:3, :3].T @ (0, -np.tan(np.radians(30)), 1)
    np.testing.assert_allclose(pixel_of(value, top)[:2], (100, 0), atol=1e-9)
    right = eye + value.viewmat[:3, :3].T @ (0.1, 0, 1)
    assert pixel_of(value, right)[0] > 100


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-13, 1e-7, 1.0]), st.sampled_from([1e-6, 1.0, 1e6]))
def test_look_at_is_a_rotation_whatever_the_direction(seed, lean, unit):
    """Also where `up` is parallel to the view, or nearly.

    Up leans from the view by at least 1e-9 or is replaced, so the cross product keeps 1e-16 / 1e-9.
    """
    g = np.random.default_rng(seed)
    eye, forward = g.normal(size=3), g.normal(size=3)
    up = (forward + lean * g.normal(size=3)) * unit
    value = bg.Camera.look_at(eye * unit, (eye + forward) * unit, up=up, width=4, height=4)
    rotation = value.viewmat[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-7)
    assert np.linalg.det(rotation) > 0
    np.testing.assert_allclose(rotation[2], forward / np.linalg.norm(forward), atol=1e-8)
    axis = np.sign(forward[0]) * np.eye(3)[seed % 3]
    along = bg.Camera.look_at(-5 * axis, (0, 0, 0), up=axis, width=40, height=30)
    np.testing.assert_allclose(pixel_of(along, np.zeros(3)), (20, 15, 5), atol=1e-12)


def test_resizing_keeps_the_vertical_field_of_view_and_the_middle():
    value = camera()
    wider = value.resized(400, 120)
    assert (wider.width, wider.height) == (400, 120)
    point = np.array([0.1, 0.2, 1.0])
    x, y, _ = pixel_of(value, point)
    np.testing.assert_allclose(pixel_of(wider, point)[:2], (200 + 2 * (x - 40), 2 * y), atol=1e-12)
    np.testing.assert_array_equal(value.resized(80, 60).K, value.K)
    np.testing.assert_array_equal(wider.viewmat, value.viewmat)


# Frame


def test_a_frame_lies_over_a_color_or_a_picture():
    alpha = np.array([[0.0, 0.25, 1.0]])
    frame = bg.Frame(alpha[..., None] * np.array([0.2, 0.4, 0.8]), alpha)
    over = frame.over((1, 1, 0))
    np.testing.assert_allclose(over[0], [[1, 1, 0], [0.8, 0.85, 0.2], [0.2, 0.4, 0.8]])
    ground = np.random.default_rng(0).uniform(0, 1, (1, 3, 3))
    np.testing.assert_allclose(frame.over(ground), frame.rgb + (1 - alpha[..., None]) * ground)
    np.testing.assert_array_equal(frame.over("#ff0080"), frame.over((1, 0, 128 / 255)))
    np.testing.assert_array_equal(frame.bytes_over("white"), frame.bytes_over((1, 1, 1)))
    with refused(ValueError, "a color must be '#rrggbb' or one of white, black"):
        frame.over("redish")
    single = bg.Frame(frame.rgb.astype(np.float32), alpha.astype(np.float32))
    assert single.over((0, 0, 0)).dtype == np.float32


@for_each("dtype", [np.float32, np.float64])
@for_each("num_threads", [1, 3])
def test_bytes_are_rounded_the_same_by_any_number_of_threads(num_threads, dtype):
    rng = np.random.default_rng(1)
    planes = rng.uniform(-0.1, 1.1, (190, 201, 3)), rng.uniform(0, 1, (190, 201))
    planes[1][:100] = 1  # a piece of the work is opaque
    frame = bg.Frame(*(plane.astype(dtype) for plane in planes))
    for background in ((1, 0.5, 0), rng.uniform(0, 1, (190, 201, 3))):
        expected = np.floor(np.clip(frame.over(background), 0, 1) * 255 + dtype(0.5))
        with at_most(num_threads):
            np.testing.assert_array_equal(frame.bytes_over(background), expected)


@for_each("dtype", [np.float32, np.float64])
def test_lists_become_arrays_in_the_dtype_beside_them(dtype):
    for source in (gaussians(dtype), boxes(dtype)):
        columns = {f.name: getattr(source, f.name) for f in fields(source) if f.type is not bool}
        lists = {name: None if column is None else column.tolist() for name, column in columns.items()}
        for name in columns:
            changed_to = getattr(replace(source, **{name: lists[name]}), name)
            assert changed_to is None or changed_to.dtype == columns[name].dtype
            np.testing.assert_array_equal(changed_to, columns[name])
        whole = type(source)(**lists)
        for name, column in columns.items():
            if column is not None:
                assert getattr(whole, name).dtype == (np.int32 if name == "ids" else np.float32)
                np.testing.assert_array_equal(getattr(whole, name), column.astype(getattr(whole, name).dtype))


def test_whole_numbers_are_taken_where_numbers_are_meant():
    source = gaussians()
    value = replace(source, means=np.arange(18).reshape(N, 3), brushes=np.arange(N), ids=np.arange(N))
    assert value.means.dtype == np.float32
    np.testing.assert_array_equal(value.means.ravel(), np.arange(18))
    assert (value.brushes.dtype, value.ids.dtype) == (np.uint8, np.int32)
    assert value.brushes.tolist() == value.ids.tolist() == list(range(N))
    ones = np.ones((3, 3), int)
    only = bg.Gaussians(np.eye(3, dtype=int), [[1, 0, 0, 0]] * 3, ones, [1, 1, 1], [[[0] * 3]] * 3)
    assert only.scales.dtype == np.float32
    with refused(ValueError, "Gaussians: brushes must lie in 0 to 255, got 256 to 261"):
        replace(source, brushes=np.arange(N) + 256)
    with refused(ValueError, "Gaussians: means has whole numbers that float32 cannot hold; give them as"):
        replace(source, means=np.full((N, 3), 2**24 + 1))
    assert replace(gaussians(np.float64), means=np.full((N, 3), 2**24 + 1)).means[0, 0] == 2**24 + 1


@for_each("make", [gaussians, boxes])
@for_each(
    "rows", [slice(1, 4), [0, 2], (1,), np.array([3, 5]), np.arange(N) % 2 == 0, [True] * 3 + [False] * 3, []]
)
def test_rows_are_taken_by_index_mask_list_or_slice(make, rows):
    source = make()
    taken = source[rows]
    plain = rows if isinstance(rows, slice) or len(rows) else slice(0)
    expected = np.arange(N)[list(plain) if isinstance(plain, tuple) else plain]
    assert len(taken) == len(expected)
    if make is gaussians:
        assert replace(source, antialiased=True)[rows].antialiased > taken.antialiased
    for name, column in columns_of(source).items():
        np.testing.assert_array_equal(getattr(taken, name), column[expected])


def test_a_sum_of_gaussians_loses_nothing():
    plain, rich = gaussians(terms=1), gaussians(np.float64, 9)
    rich = replace(rich, brushes=np.full(N, 2), ids=np.arange(N), regions=[1] * N)
    for both, ours, theirs in (
        (plain + rich, slice(0, N), slice(N, None)),
        (rich + plain, slice(N, None), slice(0, N)),
    ):
        assert (len(both), both.sh_degree, both.means.dtype) == (2 * N, 2, np.float64)
        np.testing.assert_array_equal(both.sh[ours, :1], plain.sh)
        assert not both.sh[ours, 1:].any()
        np.testing.assert_array_equal(both.sh[theirs], rich.sh)
        np.testing.assert_array_equal(both.quats[ours], plain.quats)
        assert both.brushes.tolist()[ours] == both.regions.tolist()[ours] == [0] * N
        assert (both.ids.tolist()[ours], both.ids.tolist()[theirs]) == ([-1] * N, list(range(N)))
    assert (plain + plain).brushes is None
    first = bg.Gaussians.joined([plain, rich, plain])  # the columns of the first
    assert (len(first), first.sh_degree, first.means.dtype, first.ids) == (3 * N, 0, np.float32, None)
    np.testing.assert_array_equal(first.sh[N : 2 * N], rich.sh[:, :1].astype(np.float32))
    with refused(ValueError, "Gaussians: both must be antialiased, or neither"):
        plain + replace(plain, antialiased=True)
    with pytest.raises(TypeError, match="unsupported operand"):
        plain + 1


@pytest.fixture
def half_painted():
    """Red at half opacity, solid green, nothing; and a color above 1."""
    alpha = np.array([[0.5, 1, 0, 1]], np.float32)
    straight = np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 0], [0.25, 2, 0]]], np.float32)
    return bg.Frame(straight * alpha[..., None], alpha)


def test_a_frame_is_an_array_of_rgba(half_painted):
    rgba = [[[1, 0, 0, 0.5], [0, 1, 0, 1], [0, 0, 0, 0], [0.25, 1, 0, 1]]]
    np.testing.assert_array_equal(np.asarray(half_painted), np.float32(rgba))
    assert np.array(half_painted, copy=True).dtype == np.float32
    assert np.asarray(half_painted, np.float64).dtype == np.float64
    eight, sixteen = np.asarray(half_painted, np.uint8), np.asarray(half_painted, "uint16")
    assert eight.tolist() == [[[255, 0, 0, 128], [0, 255, 0, 255], [0, 0, 0, 0], [64, 255, 0, 255]]]
    assert (sixteen.dtype, sixteen[0, 0].tolist()) == (np.uint16, [65535, 0, 0, 32768])
    with refused(TypeError, "Frame: dtype must be one of floats, uint8 or uint16, got int32"):
        np.asarray(half_painted, np.int32)
    with refused(ValueError, "Frame: its RGBA is a new array, so copy must not be False"):
        half_painted.__array__(copy=False)


def shown(frame):
    """What a notebook shows, decoded by Pillow."""
    with Image.open(BytesIO(frame._repr_png_())) as picture:
        return np.asarray(picture)


def test_a_notebook_shows_a_frame_as_it_is(half_painted):
    np.testing.assert_array_equal(shown(half_painted), np.asarray(half_painted, np.uint8))
    solid = bg.Frame(half_painted.rgb, np.ones_like(half_painted.alpha))
    np.testing.assert_array_equal(shown(solid), solid.bytes_over("black"))
