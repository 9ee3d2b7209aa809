"""The depth of table and wall in a view."""

import numpy as np

import brushgs as bg
from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_surface import depth_of, surface_around


def test_lines_of_sight_end_on_table_and_wall():
    axes = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]])
    place = Place(np.array([0.3, 0.5, -0.2]), axes, 1.0, 0.8, 1.0, np.array([0, 1.0, 0]))
    camera = bg.Camera.look_at((0.3, -1.5, -6), (0.3, 0, -0.2), (0, -1, 0), width=32, height=24, fov_y=0.9)
    surface = surface_around(place, 6.0)
    z = depth_of(surface, place, camera)
    assert np.isfinite(z).all()
    y, x = np.mgrid[:24, :32] + 0.5
    K = camera.K
    rays = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)], axis=-1)
    points = (rays * z[..., None] - camera.viewmat[:3, 3]) @ camera.viewmat[:3, :3]
    right, up, away = place.local(points.reshape(-1, 3)).T
    rho = np.hypot(right, away)
    is_table = rho < surface.table
    assert 0.2 < is_table.mean() < 0.9
    np.testing.assert_allclose(up[is_table], 0, atol=1e-4)
    cove = np.interp(rho, surface.rho, surface.height)
    is_cove = ~is_table & (rho < 0.99 * surface.wall)
    np.testing.assert_allclose(up[is_cove], cove[is_cove], atol=1e-3)
    assert rho.max() <= surface.wall * 1.001
