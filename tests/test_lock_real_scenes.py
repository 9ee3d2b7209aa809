"""The lock on trained scenes: an orbit and a path straight over the poles, 240 steps of 1.5 degrees."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.framing import up_vector
from brushgs.metrics import covers_ellipse, off_axis_share, orientation_events
from brushgs.paths import orbit
from brushgs.project import project
from tests.scenes import real_scene

SIZE = {"width": 800, "height": 800}
SCENES = {
    "koala.ply": "-y",
    "derived/chair.ply": "+z",
    "derived/truck.ply": "-y",
    "derived/skull_sh3.ply": "-y",
}


@pytest.fixture(scope="module", params=SCENES)
def painted(request):
    """The 7000 strokes of a scene, and the views of its orbit and of its way over the poles."""
    gaussians = bg.load(real_scene(request.param))
    up = up_vector(SCENES[request.param])
    paths = {over: orbit(gaussians, 240, **SIZE, up=up, over_poles=over) for over in (False, True)}
    return bg.cluster(bg.prune(gaussians, 0.7), 7000), paths


@pytest.mark.parametrize("over_poles", [False, True])
@pytest.mark.parametrize("is_closed", [False, True])
def test_tracked_strokes_do_not_flip_spin_or_pop(painted, over_poles, is_closed):
    strokes, paths = painted
    cameras = [*paths[over_poles], *paths[over_poles][: int(is_closed)]]
    ellipses = [project(strokes, camera, fade=True) for camera in cameras]
    boxes = list(bg.track(strokes, cameras, fade=True))
    events = orientation_events(boxes, ellipses=ellipses, **SIZE)
    off_axis = off_axis_share(boxes, ellipses)
    assert events.stroke_frames > 500_000
    assert (events.flips, events.spins, events.size_pops) == (0, 0, 0)
    assert np.degrees(events.largest_step) < (15 if is_closed else 6)
    assert off_axis <= (0.02 if is_closed else 0.001)
    assert covers_ellipse(boxes, ellipses) < 1e-4
