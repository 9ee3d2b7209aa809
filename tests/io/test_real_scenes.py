"""Real scenes, where they are present: the facts known of each, and an independent decode."""

import numpy as np

from brushgs.formats import load, load_cameras, read_scene
from tests.kit.for_each import for_each
from tests.scenes import real_scene

# name, rows, degree stored, degree used


@for_each("name", ["koala.ply", "derived/skull_sh3.ply"])
def test_a_real_scene_equals_a_decode_row_by_row_of_the_format(name):
    header, data = real_scene(name).read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2] for line in header.decode().splitlines() if line.startswith("property")]
    table = dict(
        zip(names, np.frombuffer(data, "<f4").reshape(-1, len(names)).T.astype(np.float64), strict=True)
    )
    gaussians, notes = read_scene(real_scene(name))
    assert (len(gaussians), notes.rows_read, notes.rows_dropped) == (len(table["x"]), len(table["x"]), 0)
    np.testing.assert_array_equal(gaussians.means, np.stack([table[n] for n in "xyz"], 1))
    np.testing.assert_array_equal(gaussians.quats, np.stack([table[f"rot_{i}"] for i in range(4)], 1))
    scales = np.exp(np.stack([table[f"scale_{i}"] for i in range(3)], 1))
    np.testing.assert_allclose(gaussians.scales, scales, rtol=1e-6)
    np.testing.assert_allclose(gaussians.opacities, 1 / (1 + np.exp(-table["opacity"])), rtol=1e-6)
    num_rest = sum(name.startswith("f_rest_") for name in names) // 3
    for channel in range(3):
        np.testing.assert_array_equal(gaussians.sh[:, 0, channel], table[f"f_dc_{channel}"])
        for term in range(num_rest):
            expected = table[f"f_rest_{channel * num_rest + term}"]
            np.testing.assert_array_equal(gaussians.sh[:, 1 + term, channel], expected)


@for_each(
    ("cameras", "scene", "share"),
    [
        ("chair_transforms_train.json", "derived/chair.ply", 0.95),
        ("train_cameras.json", "train_first1000.ply", 0.7),
    ],
)
def test_real_cameras_see_their_scene(cameras, scene, share):
    """Wrong handedness or a transposed rotation turns cameras away: then next to nothing is in view.

    Measured over all views: 0.782, 0.995, 0.995, 0.732 of the Gaussians.
    """
    means = load(real_scene(scene)).means.astype(np.float64)
    seen = []
    for camera in load_cameras(real_scene(cameras))[::10]:
        x, y, z = camera.viewmat[:3, :3] @ means.T + camera.viewmat[:3, 3:]
        u, v = camera.K[:2] @ np.stack([x, y, z]) / z
        seen.append(np.mean((z > 0) & (u > 0) & (u < camera.width) & (v > 0) & (v < camera.height)))
    assert np.mean(seen) > share
