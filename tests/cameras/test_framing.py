import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brushgs.cameras.framing import AXES, MARGIN, frame_scene, subject, up_vector
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at


def cloud(points, opacity=0.9):
    return gaussians_at(np.reshape(points, (-1, 3)), 0.01, opacity=opacity, dtype=np.float32)


def box(size=(2.0, 1.0, 1.5), center=(0, 0, 0), num=3000, seed=0):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (num, 3)) * size + center


def pixels(camera, points):
    """[n, 2] in units of half the picture from its middle, and [n] camera z."""
    seen = np.asarray(points) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    xy = seen[:, :2] / seen[:, 2:] * np.diag(camera.K)[:2] + camera.K[:2, 2]
    half = np.array([camera.width, camera.height]) / 2
    return (xy - half) / half, seen[:, 2]


angle = st.floats(-3.2, 3.2)


@settings(max_examples=40, deadline=None)
@given(
    azimuth=angle,
    elevation=st.floats(-1.55, 1.55),
    fov_y=st.floats(0.2, 2.2),
    size=st.sampled_from([(640, 480), (100, 700), (1280, 72)]),
    up=st.sampled_from(sorted(AXES)),
)
@example(azimuth=2.0, elevation=0.75, fov_y=2.0, size=(1280, 72), up="+y")  # the eye was among the points
@example(azimuth=-1.0, elevation=0.75, fov_y=2.0, size=(1280, 72), up="+y")  # and a point at the eye
def test_the_whole_subject_is_in_the_picture_and_fills_it_one_way(azimuth, elevation, fov_y, size, up):
    scene, shape = cloud(box(center=(3, -4, 5))), {"width": size[0], "height": size[1], "fov_y": fov_y}
    camera = frame_scene(scene, up=AXES[up], azimuth=azimuth, elevation=elevation, **shape)
    xy, z = pixels(camera, scene.means.astype(float))
    assert (z > camera.near).all()
    reach = np.abs(xy).max(axis=0)
    assert (reach < 1).all()
    # A camera may not come nearer than half the subject's size, which bounds it where the lens is wide.
    assert reach.max() > (1 - 2 * MARGIN) * 0.97 or fov_y > 1.2


@for_each(("up", "front"), [("-y", (0, 0, -1)), ("+y", (0, 0, 1)), ("+z", (0, -1, 0)), ("-z", (0, 1, 0))])
def test_azimuth_zero_looks_at_the_front(up, front):
    camera = frame_scene(cloud(box((1, 1, 1))), width=64, height=64, up=AXES[up], azimuth=0, elevation=0)
    np.testing.assert_allclose(camera.position / np.linalg.norm(camera.position), front, atol=0.03)


def test_azimuth_grows_to_the_right_of_the_viewer_and_elevation_upward():
    scene = cloud(box((1, 1, 1)))
    front = frame_scene(scene, width=64, height=64, azimuth=0, elevation=0)
    moved = frame_scene(scene, width=64, height=64, azimuth=0.3, elevation=0.3)
    right, down, _ = front.viewmat[:3, :3]
    assert (moved.position - front.position) @ right > 0.1
    assert (moved.position - front.position) @ down < -0.1


def test_a_subject_in_wide_surroundings_is_framed_without_them():
    rng = np.random.default_rng(0)
    around = rng.standard_cauchy((1500, 3)) * 4
    scene = cloud(np.concatenate([box((1, 1, 1), num=3000), around]))
    points, has_surroundings = subject(scene)
    assert has_surroundings
    assert np.ptp(points, axis=0).max() < 3
    assert not subject(cloud(box()))[1]


@for_each("points", [[[0, 0, 0]], [[7, -2, 1e6]], np.zeros((5, 3)), [[0, 0, 0], [1, 0, 0]]])
def test_one_point_or_a_line_of_them_gives_a_camera_that_sees_it(points):
    camera = frame_scene(cloud(points), width=32, height=32)
    xy, z = pixels(camera, np.asarray(points, dtype=float))
    assert (np.abs(xy) < 1).all()
    assert (z > camera.near).all()


VECTORS = {"-y": (0, -1, 0), "+Z": (0, 0, 1), "z": (0, 0, 1), "0,-2,0": (0, -1, 0), " 0 3 4 ": (0, 0.6, 0.8)}


def test_up_vector_reads_axes_and_numbers_and_refuses_the_rest():
    for text, vector in VECTORS.items():
        np.testing.assert_allclose(up_vector(text), vector)
    for text in ("", "up", "+w", "0,0,0", "1,2", "1,2,3,4", "nan,0,1", "inf,0,0"):
        with pytest.raises(ValueError, match=r"up must be one of .* or three numbers"):
            up_vector(text)


@for_each(
    ("options", "sentence"),
    [
        ({"zoom": 0.0}, "zoom must be > 0"),
        ({"zoom": np.inf}, "zoom must be > 0"),
        ({"fov_y": 3.2}, "fov_y must be in"),
        ({"elevation": 1.6}, "elevation must lie in"),
        ({"up": (0, 0, 0)}, "up must be a direction"),
        ({"distance": 2.0}, r"distance must be > 0, and look_at a point, got 2\.0, None"),
    ],
)
def test_frame_scene_refuses_what_makes_no_view(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        frame_scene(cloud(box()), width=64, height=64, **options)
