"""`project`: the compiled core against the float64 definition, and the laws both must keep."""

from dataclasses import fields, replace
from math import factorial

import numpy as np
import pytest
from numpy.polynomial import legendre

import brushgs as bg
from brushgs.rendering import reference
from brushgs.rendering.options import ProjectOptions
from brushgs.rendering.project import SOFTNESS, Directions, ProjectCounts, project_by
from brushgs.values.sh import sh_basis
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.passes.scenes import gaussians_at
from tests.rendering.strokes import scattered

SIZE = {"width": 200, "height": 150}
FRONT = bg.Camera.look_at((0, 0, -4), (0, 0, 0), **SIZE)  # world axes are camera axes: x right, y down


def random_scene(n: int, *, degree: int = 3, dtype=np.float64, seed: int = 0) -> bg.Gaussians:
    """Gaussians of all shapes in and around the view of `FRONT`, some behind it, some faint."""
    how = {"spread": (1.5, 1.5, 3), "sizes": (1e-3, 1.0), "opacities": (0, 1), "shade": 0.3}
    return scattered(np.random.default_rng(seed), n, terms=(degree + 1) ** 2, **how, dtype=dtype)


def single(*, mean=(0, 0, 0), quat=(1, 0, 0, 0), scale=(1, 1, 1), dtype=np.float64) -> bg.Gaussians:
    return gaussians_at([mean], [scale], quats=[quat], opacity=1, dtype=dtype)


def turned(angle: float) -> tuple[float, float, float, float]:
    """Quaternion w, x, y, z that turns by `angle` about z: from +x towards +y."""
    return (np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2))


def by_id(boxes: bg.Boxes) -> dict[str, np.ndarray]:
    """The columns by name, in the order of the Gaussians."""
    order = np.argsort(boxes.ids)
    assert len(np.unique(boxes.ids)) == len(boxes)
    taken = {f.name: getattr(boxes, f.name) for f in fields(boxes)}
    return {name: column[order] for name, column in taken.items() if column is not None}


def assert_same_boxes(actual: bg.Boxes, expected: bg.Boxes, *, rtol: float, atol: float) -> None:
    """Equal within tolerance, row by row whatever the order; angles modulo pi, weighed by what they move."""
    actual, expected = by_id(actual), by_id(expected)
    np.testing.assert_array_equal(actual["ids"], expected["ids"])
    for name in ("centers", "depths", "colors", "opacities"):
        np.testing.assert_allclose(actual[name], expected[name], rtol=rtol, atol=atol, err_msg=name)
    # Rounding in M is some 1e-16 of the longer axis, so a needle's shorter one is known to that.
    # Measured worst: 8.6e-16, over aspect ratios to 1e14.
    allowed = atol + rtol * expected["half_extents"] + 4e-15 * expected["half_extents"][:, :1]
    assert (np.abs(actual["half_extents"] - expected["half_extents"]) <= allowed).all()
    turn = np.abs(actual["angles"] - expected["angles"])
    turn = np.minimum(turn, np.pi - turn)
    major, minor = expected["half_extents"].T
    anisotropy = (major**2 - minor**2) / (major**2 + minor**2)  # a round box has no angle to be wrong
    assert (turn * anisotropy).max(initial=0) <= rtol + atol


def assert_identical(actual: bg.Boxes, expected: bg.Boxes) -> None:
    for f in fields(expected):
        np.testing.assert_array_equal(getattr(actual, f.name), getattr(expected, f.name), err_msg=f.name)


# The core against the definition


NEAR = {np.float64: {"rtol": 1e-9, "atol": 1e-9}, np.float32: {"rtol": 1e-4, "atol": 1e-5}}
OPTIONS = {
    "": {},
    "low-pass 0": {"low_pass": 0.0},
    "low-pass 2, cut at 0.5": {"low_pass": 2.0, "num_sigmas": 0.5},
    "cut at 3": {"num_sigmas": 3.0},
}


OBLONG = np.array([[170.0, 0, 20.5], [0, 90.0, 130.25], [0, 0, 1]])  # pixels, and off the middle
ASIDE = bg.Camera(bg.Camera.look_at((1, -2, -4), (0.3, 0, 0), (0.2, -1, 0.1), **SIZE).viewmat, OBLONG, **SIZE)
CAMERAS = {"front": FRONT, "aside": ASIDE}
ON_OFF = False, True


@for_each(
    ("degree", "options", "lock", "fade", "antialiased", "seen_from"),
    pairs_of((0, 1, 2, 3), OPTIONS, ("off", "anchor", "given", "scaled"), ON_OFF, ON_OFF, CAMERAS),
)
@for_each("dtype", NEAR)
def test_core_agrees_with_the_definition(dtype, degree, options, lock, fade, antialiased, seen_from):
    scene = replace(random_scene(800, degree=degree, dtype=dtype), antialiased=antialiased)
    angles = np.random.default_rng(1).uniform(-3, 3, len(scene)).astype(np.float32)
    given = {"given": Directions(angles), "scaled": Directions(angles, 1 + np.abs(angles[::-1]))}
    how, camera = {"lock": given.get(lock, lock), "fade": fade, **OPTIONS[options]}, CAMERAS[seen_from]
    boxes = bg.project(scene, camera, **how)
    assert 200 < len(boxes) < 800
    assert_same_boxes(boxes, reference.project(scene, camera, **how), **NEAR[dtype])
    assert boxes.depths.dtype == dtype


@for_each("dtype", NEAR)
def test_softness_setbacks_and_reliefs_are_those_of_the_definition_and_change_nothing_else(dtype):
    scene = random_scene(300, dtype=dtype)
    how = {"order": "soft", "underpaint": True, "relief": True}
    boxes, expected = (function(scene, FRONT, **how) for function in (bg.project, reference.project))
    larger = np.sort(scene.scales[boxes.ids].astype(np.float64), axis=1)[:, 1:]
    mean = np.sqrt(larger.prod(axis=1))
    np.testing.assert_allclose(boxes.softness, SOFTNESS * mean, rtol=1e-6)
    np.testing.assert_allclose(boxes.setbacks, mean, rtol=1e-6)
    for name in ("softness", "setbacks", "reliefs"):
        assert getattr(boxes, name).dtype == dtype
        np.testing.assert_allclose(getattr(boxes, name), getattr(expected, name), rtol=1e-6)
    plain = bg.project(scene, FRONT)
    assert_identical(replace(boxes, softness=None, setbacks=None, reliefs=None), plain)


# Antialiased scenes


@for_each("dtype", [np.float32, np.float64])
@for_each("aspect", [1.0, 1e2, 1e4, 1e8])
def test_an_antialiased_needle_keeps_the_share_of_its_scales(aspect, dtype):
    """Facing the camera the two variances are known; a determinant ac - b^2 would be lost from 1e8 on.

    Measured worst in float64: 1.6e-16. The opacity of 1 in float32 needs a needle that is not too faint.
    """
    pixels = FRONT.K[0, 0] / 4
    length = aspect * 0.05 / pixels
    for angle in np.linspace(-1.5, 1.5, 31):
        needle = single(quat=turned(angle), scale=(length, length / aspect, length / aspect), dtype=dtype)
        boxes = bg.project(replace(needle, antialiased=True), FRONT)
        long, short = (pixels * length) ** 2, (pixels * length / aspect) ** 2
        expected = np.sqrt(long / (long + 0.3) * short / (short + 0.3))
        assert boxes.opacities[0] == pytest.approx(expected, rel=1e-14 if dtype == np.float64 else 1e-6)


# Shapes that are hard


@for_each("dtype", [np.float32, np.float64])
def test_scenes_of_any_unit_agree_with_the_definition(dtype):
    """Extents to 2e7, depths 1e-6 to 1e6, scales 1e-8 to 1e6, quaternions of any length."""
    g = np.random.default_rng(2)
    n = 4000
    depth = np.exp(g.uniform(np.log(1e-6), np.log(1e6), n))
    means = np.stack([depth * g.normal(size=n), depth * g.normal(size=n), depth], axis=1)
    means[:100] = g.uniform(-2e7, 2e7, (100, 3))
    smallest, largest = (1e-44, 1e38) if dtype is np.float32 else (1e-320, 1e300)
    columns = (
        means,
        g.normal(size=(n, 4)) * np.exp(g.uniform(np.log(smallest), np.log(largest), (n, 1))),
        np.exp(g.uniform(np.log(1e-8), np.log(1e6), (n, 3))),
        g.uniform(0.1, 1, n),
        g.normal(size=(n, 16, 3)),
    )
    columns = [column.astype(dtype) for column in columns]
    columns[1][~columns[1].any(axis=1)] = (1, 0, 0, 0)
    scene = bg.Gaussians(*columns)
    camera = bg.Camera(np.eye(4), FRONT.K, **SIZE, near=1e-7)
    boxes = bg.project(scene, camera)
    assert len(boxes) > 2000
    assert_same_boxes(boxes, reference.project(scene, camera), **NEAR[dtype])


@for_each("dtype", [np.float32, np.float64])
@for_each("noise", [0.0, 1e-17, -1e-17, 1e-15, -1e-15])
def test_horizontal_is_zero_and_vertical_is_plus_a_quarter_turn(dtype, noise):
    across = bg.project(single(quat=(1, 0, 0, noise), scale=(1, 0.1, 0.1), dtype=dtype), FRONT)
    np.testing.assert_allclose(across.angles, 0, atol=1e-14)
    down = bg.project(single(quat=(1, 0, 0, noise), scale=(0.1, 1, 0.1), dtype=dtype), FRONT)
    assert down.angles[0] == dtype(np.pi / 2)


@for_each("dtype", [np.float32, np.float64])
def test_angles_lie_in_the_half_open_half_turn(dtype):
    angles = np.linspace(-np.pi, np.pi, 721)
    for angle in (*angles, -np.pi / 2 + 1e-9, -np.pi / 2 + 1e-8, -np.pi / 2 - 1e-9):
        box = bg.project(single(quat=turned(angle), scale=(1, 0.1, 0.1), dtype=dtype), FRONT)
        assert -dtype(np.pi / 2) < box.angles[0] <= dtype(np.pi / 2)
        turn = (box.angles[0] - angle) / np.pi
        assert abs(turn - round(turn)) < 1e-7


def test_what_lies_at_the_near_plane_is_left_out_and_beyond_it_stays():
    camera = bg.Camera(np.eye(4), FRONT.K, **SIZE, near=0.5)
    for z, is_kept in ((0.5, False), (np.nextafter(0.5, 1), True), (-1.0, False), (0.0, False)):
        boxes, counts = project_by(single(mean=(0, 0, z)), camera, ProjectOptions())
        assert len(boxes) == is_kept
        assert counts == ProjectCounts(behind_near=1 - is_kept, not_finite=0, faint=0, outside=0)


# Laws


@for_each("dtype", [np.float32, np.float64])
def test_boxes_come_by_depth_over_the_whole_range(dtype):
    depth = np.exp(np.random.default_rng(6).uniform(np.log(0.011), np.log(1e30), 5000))
    depth[::5] = 2  # ties keep the order of the rows
    means = np.stack([0 * depth, 0 * depth, depth], axis=1)
    scene = random_scene(5000)
    scene = replace(scene, means=means, opacities=np.ones(5000)).astype(dtype)
    boxes = bg.project(scene, bg.Camera(np.eye(4), FRONT.K, **SIZE))
    np.testing.assert_array_equal(boxes.ids, np.argsort(scene.means[:, 2], kind="stable"))


# Determinism


@for_each("dtype", [np.float32, np.float64])
def test_any_number_of_threads_gives_the_same_bits(dtype):
    scene = random_scene(60_000, degree=1, dtype=dtype)
    one = bg.project(scene, FRONT, num_threads=1)
    for num_threads in (2, 5):
        assert_identical(bg.project(scene, FRONT, num_threads=num_threads), one)


# Color


def harmonics(directions: np.ndarray, degree: int) -> np.ndarray:
    """Real spherical harmonics from Legendre polynomials, with the Condon-Shortley sign."""
    x, y, z = directions.T
    columns = []
    for l in range(degree + 1):  # noqa: E741
        for m in range(-l, l + 1):
            k = abs(m)
            norm = np.sqrt((2 * l + 1) / (4 * np.pi) * factorial(l - k) / factorial(l + k))
            slope = legendre.Legendre.basis(l).deriv(k)(z) if k else legendre.Legendre.basis(l)(z)
            turn = (x + 1j * y) ** k
            part = 1 if m == 0 else np.sqrt(2) * (-1) ** k * (turn.real if m > 0 else turn.imag)
            columns.append(norm * slope * part)
    return np.stack(columns, axis=1)


@for_each("dtype", [np.float32, np.float64])
def test_every_harmonic_is_the_real_spherical_harmonic_of_its_place(dtype):
    means = np.random.default_rng(7).normal(size=(40, 3))
    directions = means - FRONT.position
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected = harmonics(directions, 3)
    np.testing.assert_allclose(sh_basis(directions, 3), expected, rtol=1e-12, atol=1e-13)
    for term in range(16):
        sh = np.zeros((len(means), 16, 3))
        sh[:, term] = (0.3, -0.2, 0.1)
        scene = replace(gaussians_at(means, 0.1, opacity=1), sh=sh)
        boxes = bg.project(scene.astype(dtype), FRONT)
        shade = 0.5 + expected[boxes.ids, term, None] * (0.3, -0.2, 0.1)
        np.testing.assert_allclose(boxes.colors, shade, atol=2e-7 if dtype is np.float32 else 1e-14)


# What is culled


@for_each("dtype", [np.float32, np.float64])
def test_everything_left_out_is_counted_under_its_reason(dtype):
    largest, far = (3e38 if dtype is np.float32 else 1.7e308), 1e5
    rows = {  # mean, scale, opacity, sh
        "kept": ((0, 0, 0), 0.1, 1, 0),
        "behind": ((0, 0, -5), 0.1, 0, 0),
        "faint": ((0, 0, 0), 0.1, 0.99 / 255, 0),
        "barely": ((0, 0, 0), 0.1, dtype(1) / dtype(255), 0),
        "left": ((-far, 0, 0), 0.1, 1, 0),
        "below": ((0, far, 0), 0.1, 1, 0),
        "wide": ((0, 0, 0), largest, 1, 0),
        "glaring": ((0, 0, 0), 0.1, 1, largest),
        "zero": ((0, 0, 0), 0.1, 0, 0),
    }
    mean, scale, opacity, shade = zip(*rows.values(), strict=True)
    scene = gaussians_at(mean, np.reshape(scale, (-1, 1)), opacity=opacity, dtype=dtype)
    scene = replace(scene, sh=np.tile(np.reshape(shade, (-1, 1, 1)), (1, 16, 3)).astype(dtype))
    camera = replace(FRONT, K=FRONT.K * [[100, 1, 1], [1, 100, 1], [1, 1, 1]])
    boxes, counts = project_by(scene, camera, ProjectOptions())
    assert [list(rows)[i] for i in boxes.ids] == ["kept", "barely"]
    assert counts == ProjectCounts(behind_near=1, not_finite=2, faint=2, outside=2)
    assert counts.total == 7


@for_each("side", [-1, 1])
@for_each("axis", [0, 1])
@for_each(("gap", "num_boxes"), [(-1e-6, 1), (1e-6, 0)])
def test_a_box_is_outside_only_if_its_upright_rectangle_is(side, axis, gap, num_boxes):
    pixels = FRONT.K[0, 0] / 4  # of one world unit, at the needle
    size = (SIZE["width"], SIZE["height"])[axis]
    parts = np.cos(0.5), np.sin(0.5)
    reach = 2 * (10 * parts[axis] + 3 * parts[1 - axis])
    mean = np.zeros(3)
    mean[axis] = side * (size / 2 + reach + gap) / pixels
    needle = single(mean=mean, quat=turned(0.5), scale=(10 / pixels, 3 / pixels, 0))
    assert len(bg.project(needle, FRONT, low_pass=0.0)) == num_boxes
    assert len(reference.project(needle, FRONT, low_pass=0.0)) == num_boxes
