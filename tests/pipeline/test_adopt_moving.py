"""Paint over one moment of a moving scene moves with what it lies on."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.cli import main
from brushgs.formats.marks import read_marks
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.passes.marks.moving import carried
from brushgs.rendering.motion import Pose
from brushgs.values.frame import Frame
from brushgs.values.marks import Overpaint
from brushgs.values.quats import rotation_matrices
from tests.clips import ANGLE, DURATION, NUM_WALL, WAY, first_moment, moving_scene, save_clip
from tests.io.marks_maker import example

YELLOW = np.float32([1, 0.95, 0])
VIEW = ("--look-at", "0,0,0", "--distance", "5", "--azimuth", "0", "--elevation", "0", "--size", "160x120")
T1, T2 = 1 / 24, 3 / 24


def body_at(points, before, after):
    """Points on the body at one moment, at another: it turns about its middle, and shifts."""
    center = first_moment().means[NUM_WALL:].mean(axis=0).astype(float)
    share = [time / DURATION for time in (before, after)]
    angle = ANGLE * (share[1] - share[0])
    turn = rotation_matrices(np.array([[np.cos(angle / 2), 0, 0, np.sin(angle / 2)]]))[0]
    return (points - center - share[0] * WAY) @ turn.T + center + share[1] * WAY


def test_patches_take_the_motion_of_what_is_around_them():
    scene = moving_scene()
    before, after = scene.at(T1), scene.at(T2)
    marks = example().marks
    on_body, on_wall = before.means[NUM_WALL:].mean(axis=0), before.means[:NUM_WALL].mean(axis=0)
    means = np.array([on_body, on_wall], np.float64)
    overpaint = Overpaint(replace(marks, means=means), time=T1)
    found = carried(overpaint, before, after).marks
    np.testing.assert_allclose(found.means[0], body_at(on_body, T1, T2), atol=2e-3)
    np.testing.assert_allclose(found.means[1], on_wall, atol=1e-6)
    turned = body_at(marks.directions[0], T1, T2) - body_at(np.zeros(3), T1, T2)
    np.testing.assert_allclose(found.directions[0], turned, atol=5e-3)
    np.testing.assert_allclose(found.directions[1], marks.directions[1], atol=1e-6)


def test_a_pose_and_its_way_back_are_as_at_rest():
    g, count = np.random.default_rng(0), 50
    numbers = g.normal(size=(count, 12)).astype(np.float32) * 0.3
    numbers[:, 3:7] = g.normal(size=(count, 4))
    numbers[:, 3:7] /= np.linalg.norm(numbers[:, 3:7], axis=1, keepdims=True)
    numbers[:, 8] = 1
    pose = Pose(np.arange(count, dtype=np.int32), g.normal(size=(count, 3)), numbers)
    strokes = moving_scene().at(0).take(slice(count))
    strokes = strokes.__class__(**strokes.columns(), ids=np.arange(count, dtype=np.int32))
    found = pose.at_rest(pose.moved(strokes))
    for name in ("means", "scales", "opacities", "sh"):
        np.testing.assert_allclose(getattr(found, name), getattr(strokes, name), atol=1e-5, err_msg=name)
    same = rotation_matrices(found.quats) - rotation_matrices(strokes.quats)
    assert np.abs(same).max() <= 1e-5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The clip, one frame of it, and the marks of a dot that is painted on the body there."""
    folder = tmp_path_factory.mktemp("moving")
    save_clip(folder / "clip")
    render(folder, "frame.png", "--time", str(T1), "--sidecar")
    frame = read_image(folder / "frame.png")
    red = (frame[..., 0] > frame[..., 1] + 0.3) & (frame[..., 0] > frame[..., 2] + 0.3)
    y, x = np.argwhere(red).mean(axis=0)
    alpha = np.float32(np.hypot(*(np.mgrid[:120, :160] - np.array([y, x])[:, None, None])) < 7)
    write_frame(Frame(alpha[..., None] * YELLOW, alpha), folder / "layer.png")
    words = ("adopt", folder / "layer.png", "--on", folder / "frame.png", folder / "clip", "--time", T1)
    assert main([*map(str, words), "-o", str(folder / "a.marks"), "--quiet"]) == 0
    return folder


def render(folder, output, *words):
    own = ("--strokes", "150", "--see", "off", "--quiet", "-o", str(folder / output))
    assert main(["render", str(folder / "clip"), *own, *VIEW, *words]) == 0


def middle(path):
    """(x, y) of the paint in a picture, pixels, and how much there is."""
    near = np.abs(read_image(path)[..., :3] - YELLOW).max(axis=2) < 0.3
    return np.argwhere(near).mean(axis=0)[::-1] + 0.5, near.sum()


def test_marks_of_a_moment_go_with_the_body_in_stills_and_films(folder):
    found = read_marks(folder / "a.marks")
    assert found.time == pytest.approx(T1)
    marks = ("--marks", str(folder / "a.marks"))
    render(folder, "film_%d.png", "--fps", "24", *marks)
    first, size = middle(folder / "layer.png")
    for frame in (0, 1, 3):
        render(folder, f"still_{frame}.png", "--time", str(frame / 24), *marks)
        still, area = middle(folder / f"still_{frame}.png")
        film, in_film = middle(folder / f"film_{frame}.png")
        assert np.linalg.norm(still - film) <= 1.5
        assert min(area, in_film) >= 0.6 * size
        assert np.linalg.norm(still - first) >= 5 or frame == 1
