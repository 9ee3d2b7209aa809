"""The derivative of projecting against differences of its definition, and where there is none. No torch."""

from dataclasses import replace
from functools import partial

import numpy as np

from brushgs.rendering import reference
from brushgs.rendering.backward import BOX_COLUMNS, GAUSSIAN_COLUMNS, BoxGradients, project_backward
from brushgs.rendering.project import Directions, ProjectOptions, project
from brushgs.values.camera import Camera
from brushgs.values.gaussians import SH_TERMS, Gaussians
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at
from tests.rendering.strokes import scattered

CAMERA = Camera.look_at((0.5, -0.6, 2.6), (0, 0, 0), width=80, height=60, near=0.2)
TERMS = {degree: terms for terms, degree in SH_TERMS.items()}


def scene_of(n=9, degree=1, *, seed=0, sizes=(0.02, 0.4), dtype=np.float64) -> Gaussians:
    how = {"spread": 0.6, "sizes": sizes, "opacities": (0.3, 0.95), "shade": 0.3}
    return scattered(np.random.default_rng([seed, n]), n, terms=TERMS[degree], **how, dtype=dtype)


def near_scene() -> Gaussians:
    """Strokes around a place close to the camera, from half the picture to many pictures in size."""
    scene = scene_of(30, sizes=(0.2, 2.5))
    return replace(scene, means=0.8 * scene.means + 0.6 * CAMERA.position)


def directions(n=9, *, area_scales=False) -> Directions:
    g = np.random.default_rng([5, n])
    angles = g.uniform(-3, 3, n).astype(np.float32)
    return Directions(angles, g.uniform(1, 3, n).astype(np.float32) if area_scales else None)


def weights(boxes) -> BoxGradients:
    g = np.random.default_rng(3)
    columns = {name: getattr(boxes, name) for name in BOX_COLUMNS}
    return BoxGradients(**{name: g.normal(size=c.shape).astype(c.dtype) for name, c in columns.items()})


def backward(scene, v=None, camera=CAMERA, columns=GAUSSIAN_COLUMNS, num_threads=None, **options):
    boxes = project(scene, camera, **options)
    v = weights(boxes) if v is None else v
    how = ProjectOptions(num_threads=num_threads, **options)
    return project_backward(scene, camera, boxes, v, how, columns=columns)


CASES = {
    **{f"SH degree {degree}": (scene_of(4, degree), {}) for degree in TERMS},
    "anchor": (scene_of(), {"lock": "anchor"}),
    "directions": (scene_of(), {"lock": directions()}),
    "scaled directions": (scene_of(), {"lock": directions(area_scales=True), "fade": True}),
    "fade of small strokes": (scene_of(sizes=(0.003, 0.01)), {"fade": True}),
    "fade of near and large strokes": (
        near_scene(), {"fade": True, "lock": "anchor", "num_sigmas": 1.5},
    ),
    "no low-pass": (scene_of(), {"low_pass": 0.0}),
    "a size for each": (scene_of(), {"num_sigmas": np.linspace(1, 2.6, 9), "lock": "anchor", "fade": True}),
    **{
        f"antialiased, {name}": (replace(scene_of(sizes=sizes), antialiased=True), options)
        for name, sizes, options in (
            ("off", (0.01, 0.1), {}),
            ("anchor", (0.01, 0.1), {"lock": "anchor"}),
            ("directions", (0.01, 0.1), {"lock": directions(area_scales=True), "fade": True}),
            ("fade", (0.005, 0.03), {"fade": True}),
            ("no low-pass", (0.02, 0.4), {"low_pass": 0.0}),
        )
    },
}  # fmt: skip


@for_each("case", CASES)
def test_gradients_are_differences_of_the_definition(case):
    scene, options = CASES[case]
    boxes = reference.project(scene, CAMERA, **options)
    assert len(boxes) >= len(scene) - 1
    v = weights(boxes)
    actual = backward(scene, v, **options)

    def loss(moved):
        boxes_of_it = reference.project(moved, CAMERA, **options)
        np.testing.assert_array_equal(boxes_of_it.ids, boxes.ids)
        return sum(float((getattr(boxes_of_it, n) * getattr(v, n)).sum()) for n in BOX_COLUMNS)

    for name in GAUSSIAN_COLUMNS:
        moved = partial(lambda name, values: loss(replace(scene, **{name: values})), name)
        numerical = central_differences(moved, getattr(scene, name))
        assert numerical.any()
        assert_same_gradient(f"{case} {name}", getattr(actual, name), numerical)


def test_a_missing_gradient_is_one_of_zeros():
    scene = scene_of(degree=2)
    boxes = project(scene, CAMERA, lock="anchor", fade=True)
    v = weights(boxes)
    for name in BOX_COLUMNS:
        none, zeros = (
            backward(scene, replace(v, **{name: value}), lock="anchor", fade=True)
            for value in (None, np.zeros_like(getattr(boxes, name)))
        )
        for column in GAUSSIAN_COLUMNS:
            np.testing.assert_array_equal(getattr(none, column), getattr(zeros, column), err_msg=name)


def test_only_what_is_wanted_is_computed_and_the_rest_does_not_change():
    scene = scene_of(degree=2)
    everything = backward(scene, fade=True)
    for name in GAUSSIAN_COLUMNS:
        alone = backward(scene, fade=True, columns=(name,))
        np.testing.assert_array_equal(getattr(alone, name), getattr(everything, name), err_msg=name)
        assert all(getattr(alone, other) is None for other in GAUSSIAN_COLUMNS if other != name)


def fill_fresh_arrays(monkeypatch):
    """Memory may hold anything: here it holds NaN, which stays where nothing is written."""
    fresh = np.empty_like

    def filled(array, **how):
        return fresh(array, **how) if how else np.full_like(array, np.nan)

    monkeypatch.setattr(np, "empty_like", filled)


def test_culled_gaussians_get_zeros(monkeypatch):
    fill_fresh_arrays(monkeypatch)
    for scene in (scene_of(0), replace(scene_of(3), means=np.full((3, 3), 50.0))):
        nothing = backward(scene)
        for name in GAUSSIAN_COLUMNS:
            assert getattr(nothing, name).shape == getattr(scene, name).shape
            assert not getattr(nothing, name).any()
    scene = scene_of(40)
    behind = np.arange(40) % 3 == 0
    scene = replace(scene, means=np.where(behind[:, None], [5.0, -5, 9], scene.means))
    actual = backward(scene)
    assert not np.isin(np.flatnonzero(behind), project(scene, CAMERA).ids).any()
    for name in GAUSSIAN_COLUMNS:
        assert not getattr(actual, name)[behind].any(), name
        assert getattr(actual, name)[~behind].any(), name


@for_each("name", BOX_COLUMNS)
def test_boxes_that_the_loss_does_not_depend_on_pass_zeros_on(name, monkeypatch):
    fill_fresh_arrays(monkeypatch)
    scene = scene_of(200, degree=2)
    boxes = project(scene, CAMERA, lock="anchor", fade=True)
    v = getattr(weights(boxes), name).copy()
    whole = backward(scene, BoxGradients(**{name: v}), lock="anchor", fade=True)
    v[::2] = 0
    half = backward(scene, BoxGradients(**{name: v}), lock="anchor", fade=True)
    kept, dropped = boxes.ids[1::2], np.setdiff1d(np.arange(200), boxes.ids[1::2])
    for column in GAUSSIAN_COLUMNS:
        assert not getattr(half, column)[dropped].any()
        np.testing.assert_array_equal(
            getattr(half, column)[kept], getattr(whole, column)[kept], err_msg=column
        )


@for_each("lock", ["off", "anchor"])
def test_round_ellipses_pass_no_angle_on_and_nothing_that_is_not_finite(lock):
    """A ball before the camera: exactly round on the image, and its axes are equally long."""
    scene = gaussians_at([(0, 0, 0)], 0.2, opacity=0.5)
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), width=80, height=60)
    boxes = project(scene, camera, lock=lock)
    actual = backward(scene, BoxGradients(angles=np.ones(1)), camera, lock=lock)
    if lock == "off":
        assert boxes.angles[0] == 0
        assert not any(getattr(actual, name).any() for name in GAUSSIAN_COLUMNS)
    everything = backward(scene, None, camera, lock=lock)
    assert all(np.isfinite(getattr(everything, name)).all() for name in GAUSSIAN_COLUMNS)


@for_each("lock", ["off", "anchor"])
def test_the_angle_of_a_nearly_round_ellipse_turns_as_fast_as_it_does(lock):
    scene = scene_of(4, sizes=(0.2, 0.2000001))
    v = BoxGradients(angles=np.ones(4))
    actual = backward(scene, v, lock=lock).scales

    def loss(scales):
        return float(project(replace(scene, scales=scales), CAMERA, lock=lock).angles.sum())

    assert_same_gradient("angles", actual, central_differences(loss, scene.scales, step=1e-11), rtol=1e-3)


@for_each("antialiased", [False, True])
@for_each("shape", ["flat", "needle", "point", "far quats"])
def test_extreme_gaussians_have_finite_gradients(shape, antialiased):
    scene = scene_of(9, degree=3)
    scales = {"flat": (1, 1, 0), "needle": (1, 1e-7, 1e-7), "point": (0, 0, 0), "far quats": (1, 1, 1)}[shape]
    quats = scene.quats * (1e-200 if shape == "far quats" else 1)
    scene = replace(scene, scales=scene.scales * scales, quats=quats, antialiased=antialiased)
    for options in ({}, {"lock": "anchor"}, {"lock": directions()}, {"fade": True}):
        if shape == "point" and "fade" in options:
            assert len(project(scene, CAMERA, **options)) == 0
        actual = backward(scene, **options)
        for name in GAUSSIAN_COLUMNS:
            assert np.isfinite(getattr(actual, name)).all(), (name, options)


@for_each("dtype", [np.float32, np.float64])
def test_any_number_of_threads_gives_the_same_bits(dtype):
    scene = scene_of(2000, degree=3, dtype=dtype)
    one = backward(scene, num_threads=1, lock="anchor", fade=True)
    assert one.sh.dtype == dtype
    for num_threads in (2, 3, 40):
        other = backward(scene, num_threads=num_threads, lock="anchor", fade=True)
        for name in GAUSSIAN_COLUMNS:
            np.testing.assert_array_equal(getattr(other, name), getattr(one, name), err_msg=name)


def test_float32_is_close_to_float64():
    scene = scene_of(500, degree=3, dtype=np.float32)
    boxes = project(scene, CAMERA, fade=True)
    v = weights(boxes)
    double = BoxGradients(**{name: getattr(v, name).astype(np.float64) for name in BOX_COLUMNS})
    single, exact = (backward(s, u, fade=True) for s, u in ((scene, v), (scene.astype(np.float64), double)))
    for name in GAUSSIAN_COLUMNS:
        expected = getattr(exact, name)
        assert np.linalg.norm(getattr(single, name) - expected) <= 1e-6 * np.linalg.norm(expected), name
