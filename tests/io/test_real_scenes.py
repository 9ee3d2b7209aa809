"""Real scenes, where they are present: the facts known of each, and an independent decode."""

import json

import numpy as np
import pytest

from brushgs.formats import load, load_cameras, read_scene
from tests.scenes import real_scene

# name, rows, degree stored, degree used
SCENES = [
    ("koala.ply", 54804, 0, 0),
    ("rubber_toy_cloud.ply", 14364, 3, 3),
    ("sunflower_tile.ply", 14051, 3, 0),
    ("train_first1000.ply", 1000, 3, 3),
    ("biker.compressed.ply", 152746, 0, 0),
    ("derived/truck.ply", 116544, 0, 0),
    ("derived/chair.ply", 111650, 0, 0),
    ("derived/skull_sh3.ply", 94936, 3, 3),
    ("derived/playbot_sh2.ply", 125000, 2, 2),
    ("derived/campsite.ply", 212464, 0, 0),
    *((f"hanabi_frames/frame_{index:03d}.ply", 4000, 0, 0) for index in range(6)),
]


@pytest.mark.parametrize(("name", "num_rows", "stored", "used"), SCENES)
def test_a_real_scene_has_its_known_rows_and_degree(name: str, num_rows: int, stored: int, used: int) -> None:
    gaussians, notes = read_scene(real_scene(name))
    assert len(gaussians) == notes.rows_read == num_rows
    assert notes.rows_dropped == 0
    assert (notes.sh_degree_stored, notes.sh_degree_used, gaussians.sh_degree) == (stored, used, used)


@pytest.mark.parametrize("name", ["koala.ply", "derived/skull_sh3.ply", "derived/campsite.ply"])
def test_a_real_scene_equals_a_decode_row_by_row_of_the_format(name: str) -> None:
    header, data = real_scene(name).read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2] for line in header.decode().splitlines() if line.startswith("property")]
    table = dict(
        zip(names, np.frombuffer(data, "<f4").reshape(-1, len(names)).T.astype(np.float64), strict=True)
    )
    gaussians = load(real_scene(name))
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


def test_the_compressed_biker_equals_the_same_scene_in_another_format() -> None:
    """The figures are those of its .spz sister file as Open3D reads it, with y and z turned back.

    Row by row, positions differed by at most 1.2e-4, log-scales above -10 by 0.03125 (half a step of
    .spz), rotations by 1e-6 in 1 - |dot|, opacities by 6e-8.
    """
    biker = load(real_scene("biker.compressed.ply"))
    np.testing.assert_allclose(np.linalg.norm(biker.quats, axis=1), 1, atol=1e-6)
    box = np.percentile(biker.means, [1, 99], axis=0)
    np.testing.assert_allclose(box, [[-0.51611, -3.10522, -0.48535], [0.30542, -0.03687, 0.54590]], atol=2e-4)
    assert (biker.opacities > 0.5).mean() == pytest.approx(0.219881, abs=1e-6)
    np.testing.assert_allclose(biker.sh[:, 0].mean(axis=0), [-0.64202, -0.68166, -0.70651], atol=2e-4)


def test_the_sunflowers_have_unnormalised_quaternions_that_stay_as_they_are() -> None:
    lengths = np.linalg.norm(load(real_scene("sunflower_tile.ply")).quats, axis=1)
    assert lengths.min() == pytest.approx(0.46, abs=0.01)
    assert lengths.max() == pytest.approx(3.18, abs=0.01)


@pytest.mark.parametrize(
    ("name", "count", "size"),
    [
        ("derived/koala_cameras.json", 102, (1064, 1898)),
        ("koala_cameras_original.json", 102, (1064, 1898)),
        ("train_cameras.json", 301, (1959, 1090)),
        ("nerf_synthetic_cameras.json", 300, (800, 800)),
        ("chair_transforms_train.json", 20, (800, 800)),
        ("chair_transforms_test.json", 200, (800, 800)),
        ("nerfstudio_camera_path.json", 60, None),
    ],
)
def test_a_real_camera_file_has_its_known_cameras(
    name: str, count: int, size: tuple[int, int] | None
) -> None:
    cameras = load_cameras(real_scene(name))
    assert len(cameras) == count
    if size:
        assert {(camera.width, camera.height) for camera in cameras} == {size}


@pytest.mark.parametrize(
    ("cameras", "scene", "share"),
    [
        ("derived/koala_cameras.json", "koala.ply", 0.7),
        ("chair_transforms_train.json", "derived/chair.ply", 0.95),
        ("nerf_synthetic_cameras.json", "derived/chair.ply", 0.95),
        ("train_cameras.json", "train_first1000.ply", 0.7),
    ],
)
def test_real_cameras_see_their_scene(cameras: str, scene: str, share: float) -> None:
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


def test_the_two_descriptions_of_the_same_synthetic_views_agree() -> None:
    """The same rig wrote both files; both look at the origin from a distance of 4.03."""
    for name in ("nerf_synthetic_cameras.json", "chair_transforms_train.json"):
        for camera in load_cameras(real_scene(name)):
            assert camera.K[0, 0] == pytest.approx(1111.111, abs=1e-2)
            assert np.linalg.norm(camera.position) == pytest.approx(4.0311, abs=1e-3)
            towards_origin = -camera.position / np.linalg.norm(camera.position)
            np.testing.assert_allclose(camera.viewmat[2, :3], towards_origin, atol=1e-3)


def test_a_phone_capture_reports_the_ignored_distortion() -> None:
    path = real_scene("nerfstudio_transforms.json")
    with pytest.warns(
        UserWarning, match=r"camera model OPENCV was ignored \(k1 = 0\.0424585, k2 = .*p1 = .*p2 = "
    ):
        cameras = load_cameras(path)
    assert len(cameras) == len(json.loads(path.read_text())["frames"])
    assert cameras[0].K[0].tolist() == pytest.approx([1506.158113353335, 0, 542.2541280231942])
