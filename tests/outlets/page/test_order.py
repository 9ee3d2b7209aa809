"""The order in which the page draws strokes."""

import numpy as np

from tests.kit.for_each import for_each

RESOLUTION = 2.0**-17  # of a distance, where the farthest is less than 16 times as far as the nearest


@for_each("with_underpaint", [False, True])
@for_each("axis", [None, [0.0, 0.6, 0.8]])
def test_all_are_drawn_once_farthest_first(studio, axis, with_underpaint):
    draw, eye = np.random.default_rng(0), (0.5, -2, -3)
    means = draw.uniform(-1, 1, (3000, 3)).astype(np.float32)
    setbacks = draw.uniform(0, 0.2, 3000).astype(np.float32) if with_underpaint else None
    ids = studio.order(means, eye, setbacks=setbacks, axis=axis)
    rays = means.astype(np.float64) - eye
    distances = np.linalg.norm(rays, axis=1) if axis is None else rays @ axis
    if with_underpaint:
        distances = np.stack([distances, distances + setbacks], axis=1).ravel()
    assert sorted(ids) == list(range(len(distances)))
    assert (np.diff(distances[ids]) < RESOLUTION * distances.max()).all()
    # What lies behind the camera is left out, with its underpaint.
    if axis is not None:
        is_ahead = means @ np.float32(axis) > 0
        seen = studio.order(means, (0, 0, 0), setbacks=setbacks, axis=axis)
        layers = 2 if with_underpaint else 1
        assert sorted(seen // layers) == np.flatnonzero(is_ahead).repeat(layers).tolist()
    # Of strokes at one depth the first is nearest, and its underpaint behind all.
    ids = studio.order(np.zeros((4, 3), np.float32), (0, 0, -3), setbacks=np.zeros(4, np.float32))
    assert ids.tolist() == [7, 5, 3, 1, 6, 4, 2, 0]
