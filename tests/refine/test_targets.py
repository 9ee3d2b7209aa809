"""Plain pictures as targets: each of its own view and moment, whatever the threads."""

import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs.refine.targets import TargetView, draw_targets  # noqa: E402
from brushgs.refine.views import TimedView, views_around  # noqa: E402
from tests.scenes import still_life_of  # noqa: E402


@pytest.mark.parametrize("num_threads", [1, 3, 16])
def test_targets_are_those_of_their_views_in_order_for_any_number_of_threads(num_threads):
    scenes = {None: still_life_of(3000), 1: still_life_of(2000, seed=1)}
    cameras = views_around(scenes[None], 5, width=32, height=24)
    moments = (None, 1, None, None, 1)
    views = [TimedView(camera, moment) for camera, moment in zip(cameras, moments, strict=True)]
    asked = []

    def shown_at(moment):
        asked.append(moment)
        return scenes[moment]

    targets = draw_targets(views, shown_at, num_threads)
    assert asked == [None, 1]  # each moment once
    for target, view in zip(targets, views, strict=True):
        alone = TargetView.of(scenes[view.moment], view.camera)
        assert (target.camera, target.moment) == (view.camera, view.moment)
        assert torch.equal(target.rgb, alone.rgb)
        assert torch.equal(target.alpha, alone.alpha)
        assert float(target.alpha.max()) > 0.5
