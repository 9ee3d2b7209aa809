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


def assert_alike(view, other, *, points):
    """Equal views but for rounding; `points` is how the points of the first correspond to the second's."""
    assert np.allclose(view.up, other.up, atol=1e-3)
    assert view.probability == pytest.approx(other.probability, abs=1e-2)
    assert (view.azimuth, view.front) == pytest.approx((other.azimuth, other.front), abs=1e-6)
    assert view.elevation == other.elevation
    assert view.has_surroundings == other.has_surroundings
    expected = points(other.points)
    size = np.ptp(expected, axis=0).max()
    for bound in (np.min, np.max):
        assert np.allclose(bound(view.points, axis=0), bound(expected, axis=0), atol=2e-2 * size)


@for_each(
    ("scale", "offset"), [(1e-4, np.zeros(3)), (1e4, np.zeros(3)), (1.0, np.array([30.0, -200.0, 7.0]))]
)
def test_unit_place_and_order_of_rows_do_not_matter(scale, offset):
    shuffle = np.random.default_rng(5).permutation(len(statue()))
    scene = moved(statue().take(shuffle), scale=scale, offset=offset)
    assert_alike(find_first_view(scene), statue_view(), points=lambda points: scale * points + offset)


@for_each("scene", [statue, on_a_plaza])
def test_threads_and_repetition_do_not_change_a_bit(scene):
    views = []
    for count in (1, 3):
        with at_most(count):
            views.append(find_first_view(scene()))
    for name in ("points", "up", "azimuth", "front", "elevation", "ups"):
        assert np.array_equal(*(getattr(view, name) for view in views))


def cloud(count, *, means=None, sizes=0.02, opacities=0.8, dtype=np.float32):
    """Gaussians at random places, or at given ones."""
    rng = np.random.default_rng(0)
    centers, quats = rng.normal(size=(count, 3)) if means is None else means(rng), rng.normal(size=(count, 4))
    columns = (centers, quats, np.full((count, 3), sizes), np.full(count, opacities))
    return bg.Gaussians(*columns, rng.normal(size=(count, 4, 3))).astype(dtype)


def with_outliers(distance, count=6000):
    away = np.where(np.arange(count) < 200, distance, 1)[:, None]
    return cloud(count, means=lambda rng: rng.normal(size=(count, 3)) * away)


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
