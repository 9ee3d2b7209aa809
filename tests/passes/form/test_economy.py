"""Economy: errors that an eye sees from afar, and groups of fewer strokes where few describe a scene."""

import numpy as np

from brushgs.cameras.around import ring_views
from brushgs.cameras.framing import plain_first_view
from brushgs.passes.form.economy import SEEN, ViewingError
from brushgs.passes.reduce.cluster import group
from brushgs.rendering.plain import plain_views
from brushgs.values.arrays import smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, grid
from tests.passes.test_moments import with_threads
from tests.scenes import still_life_of


def frame(rgb, alpha=1.0):
    return Frame(np.full((9, 12, 3), rgb * alpha, np.float32), np.full((9, 12), alpha, np.float32))


def test_what_an_eye_does_not_see_is_no_error_and_what_it_sees_is():
    seen = ViewingError.of(frame(0.5))
    np.testing.assert_array_equal(seen.of_painted(frame(0.515)), np.zeros((9, 12)))
    assert (seen.of_painted(frame(0.7)) > 0.02).all()
    assert (seen.of_painted(frame(0.5, 0.6)) > 0.005).all()


def twin(plain, painted):
    """The same in NumPy, float64: half the size, over black and white, OKLab by its formula."""

    def seen(picture, back):
        height, width = picture.alpha.shape
        over = picture.rgb + back * (1 - picture.alpha[..., None])
        over = np.pad(over, ((0, height % 2), (0, width % 2), (0, 0)), "edge")
        over = over.reshape(-(-height // 2), 2, -(-width // 2), 2, 3).mean(axis=(1, 3), dtype=np.float64)
        return oklab_of(np.clip(over, 0, 1).reshape(-1, 3)).reshape(over.shape)

    error = 0
    for back in (0, 1):
        squares = ((seen(plain, back) - seen(painted, back)) ** 2).sum(axis=2)
        error += 0.5 * squares * smoothstep((np.sqrt(squares) - SEEN[0]) / (SEEN[1] - SEEN[0]))
    return error.repeat(2, axis=0).repeat(2, axis=1)[: plain.alpha.shape[0], : plain.alpha.shape[1]]


@for_each("size", [(40, 70), (41, 71), (1, 1), (2, 1)])
def test_the_error_is_that_of_the_twin_for_any_number_of_threads(size):
    rng = np.random.default_rng(0)

    def picture():
        alpha = rng.uniform(size=size).astype(np.float32)
        rgb = alpha[..., None] * rng.uniform(size=(*size, 3)).astype(np.float32)
        return Frame(rgb, alpha)

    plain, painted = picture(), picture()
    found = with_threads(lambda: ViewingError.of(plain).of_painted(painted))
    np.testing.assert_allclose(found, twin(plain, painted), atol=0.002)  # the tables are right to 0.002


def wall(num=50):
    """A grey wall of one color, with a small red patch."""
    means = grid(num)
    is_red = np.hypot(means[:, 0] - 0.3, means[:, 1]) < 0.15
    colors = np.where(is_red[:, None], (0.8, 0.1, 0.1), (0.5, 0.5, 0.5))
    return gaussians_at(means, (0.03, 0.03, 0.002), colors, opacity=0.95)


CAMERA = Camera.look_at((0, 0, -3), (0, 0, 0), width=120, height=90)


def test_a_flat_wall_takes_fewer_strokes_than_asked_for():
    scene = wall()
    usual, economic = (group(scene, 800, views=[CAMERA], economy=economy) for economy in (0.0, 1.0))
    assert usual.num_clusters == 800
    assert 120 <= economic.num_clusters < 600
    assert len(economic.parents) >= 1


def test_economy_zero_is_what_there_was():
    scene = still_life_of(1500)
    views = plain_views(scene, ring_views(plain_first_view(scene), 120, 90)[:3])
    usual, same = group(scene, 200, views=views), group(scene, 200, views=views, economy=0.0)
    np.testing.assert_array_equal(usual.labels, same.labels)
    more = group(scene, 200, views=views, economy=0.5)
    assert more.num_clusters <= 200
    assert (more.labels != usual.labels).any()
