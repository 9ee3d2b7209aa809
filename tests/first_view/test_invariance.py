"""The first view depends on what a scene shows, not on unit, place, rows or threads; and there is one."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import AXES, frame_scene
from brushgs.cameras.ground import level_up
from brushgs.core.threads import at_most
from brushgs.first_view import find_first_view
from tests.first_view.scenes import moved, on_a_plaza, statue, statue_view
from tests.kit.for_each import for_each


def assert_alike(view, other, *, points=None, tolerance=1e-2):
    """Equal views but for rounding; `points` is how the points of the first correspond to the second's."""
    assert np.allclose(view.up, other.up, atol=1e-3)
    assert view.probability == pytest.approx(other.probability, abs=tolerance)
    assert (view.azimuth, view.front) == pytest.approx((other.azimuth, other.front), abs=1e-6)
    assert view.elevation == other.elevation
    assert view.has_surroundings == other.has_surroundings
    expected = other.points if points is None else points(other.points)
    size = np.ptp(expected, axis=0).max()
    for bound in (np.min, np.max):
        assert np.allclose(bound(view.points, axis=0), bound(expected, axis=0), atol=2e-2 * size)


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_the_unit_of_a_scene_does_not_matter(scale):
    assert_alike(
        find_first_view(moved(statue(), scale=scale)),
        statue_view(),
        points=lambda points: scale * points,
    )


def test_the_place_of_a_scene_does_not_matter():
    offset = np.array([30.0, -200.0, 7.0])
    assert_alike(
        find_first_view(moved(statue(), offset=offset)),
        statue_view(),
        points=lambda points: points + offset,
    )


def test_the_order_of_rows_does_not_matter():
    shuffle = np.random.default_rng(5).permutation(len(statue()))
    assert_alike(find_first_view(statue().take(shuffle)), statue_view())


@pytest.mark.parametrize("scene", [statue, on_a_plaza])
def test_threads_and_repetition_do_not_change_a_bit(scene):
    with at_most(1):
        one = find_first_view(scene())
    with at_most(3):
        three = find_first_view(scene())
    for name in ("points", "up"):
        assert np.array_equal(getattr(one, name), getattr(three, name))
    assert (one.azimuth, one.front, one.elevation, one.ups) == (
        three.azimuth,
        three.front,
        three.elevation,
        three.ups,
    )


def cloud(count, *, means=None, sizes=0.02, opacities=0.8, dtype=np.float32):
    """Gaussians at random places, or at given ones."""
    rng = np.random.default_rng(0)
    columns = (
        rng.normal(size=(count, 3)) if means is None else means(rng),
        rng.normal(size=(count, 4)),
        np.full((count, 3), sizes),
        np.full(count, opacities),
        rng.normal(size=(count, 4, 3)),
    )
    return bg.Gaussians(*(np.ascontiguousarray(column, dtype) for column in columns))


def with_outliers(distance, count=6000):
    def means(rng):
        places = rng.normal(size=(count, 3))
        places[:200] *= distance
        return places

    return cloud(count, means=means)


EXTREME = {
    **{f"{count} rows": lambda count=count: cloud(count) for count in (1, 2, 3, 4, 50)},
    "one point": lambda: cloud(1, sizes=0.0),
    "all equal": lambda: cloud(300, means=lambda rng: np.full((300, 3), 3.0)),
    "all equal points": lambda: cloud(300, means=lambda rng: np.full((300, 3), 3.0), sizes=0.0),
    "all transparent": lambda: cloud(300, opacities=0.0),
    "points": lambda: cloud(300, sizes=0.0),
    "a plane": lambda: cloud(900, means=lambda rng: rng.uniform(-1, 1, (900, 3)) * (1, 0, 1)),
    "a line": lambda: cloud(900, means=lambda rng: rng.uniform(-1, 1, (900, 3)) * (0, 0, 1)),
    "outliers at 2e7": lambda: with_outliers(2e7),
    "outliers at 1e18": lambda: with_outliers(1e18),
    "larger than the scene": lambda: cloud(900, sizes=1e15),
    "tiny": lambda: cloud(900, means=lambda rng: 1e-20 * rng.normal(size=(900, 3)), sizes=1e-22),
    "huge": lambda: cloud(900, means=lambda rng: 1e17 * rng.normal(size=(900, 3)), sizes=1e15),
    "far from the origin": lambda: cloud(900, means=lambda rng: 1e6 + rng.normal(size=(900, 3))),
    "two places": lambda: cloud(900, means=lambda rng: np.repeat([[0.0] * 3, [1.0] * 3], 450, axis=0)),
    "float64": lambda: cloud(900, dtype=np.float64),
}


@for_each("name", EXTREME)
def test_an_extreme_scene_has_a_first_view(name):
    scene = EXTREME[name]()
    with np.errstate(all="raise", under="ignore"):
        view = find_first_view(scene)
        camera = frame_scene(view, width=64, height=48)
        assert np.linalg.norm(level_up(scene, np.array(AXES["+z"]))) == pytest.approx(1)
    assert view.points.shape[1] == 3
    assert np.isfinite(view.points).all()
    assert np.linalg.norm(view.up) == pytest.approx(1)
    assert np.isfinite([view.azimuth, view.elevation, view.front]).all()
    assert sum(p for _, p in view.ups) == pytest.approx(1)
    assert np.isfinite(camera.viewmat).all()
    if name.startswith("outliers"):
        assert np.ptp(view.points, axis=0).max() < 10


def test_a_scene_without_gaussians_is_refused():
    with pytest.raises(ValueError, match="at least one row"):
        find_first_view(statue().take(slice(0, 0)))
