"""One order of strokes for a whole film, by mean distance from its cameras."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np

import brushgs as bg
from brushgs.cli import main
from brushgs.pipeline.frame_painter import FramePainter
from brushgs.rendering.coat import Coat
from brushgs.rendering.fixed_order import mean_distances
from brushgs.rendering.options import RenderOptions
from tests.kit.regions import cameras
from tests.scenes import still_life_of

BARE = ["--strokes", "60", "--size", "64x48", "--backdrop", "stage"]
FLAT = bg.StrokeTexture.open("flat")


def test_strokes_keep_their_order_in_all_views_and_fade_into_nothing():
    strokes, views = still_life_of(1000), cameras(3)
    bare = Coat("backdrop", strokes, FLAT, RenderOptions.of(FLAT, order="soft"))
    coat = replace(bare, distances=mean_distances(strokes.means, views))
    orders = [coat.boxes(view)[0].ids for view in views]
    for view, order in zip(views, orders, strict=True):
        np.testing.assert_array_equal(order[np.isin(order, orders[0])], orders[0][np.isin(orders[0], order)])
        boxes, by_depth = coat.boxes(view)[0], bare.boxes(view)[0]
        assert boxes.softness is None
        assert by_depth.softness is not None
        np.testing.assert_array_equal(
            boxes.centers[np.argsort(order)], by_depth.centers[np.argsort(by_depth.ids)]
        )


def test_distances_are_means_over_eyes_at_most_64_of_them():
    views, means = cameras(64), still_life_of(1000).means
    eyes = np.array([view.position for view in views])
    expected = np.linalg.norm(means[:, None] - eyes, axis=2).mean(axis=1)
    for given in (views, [view for view in views for _ in range(2)]):
        np.testing.assert_allclose(mean_distances(means, given), expected, rtol=1e-12)


def test_films_have_it_for_what_surrounds_a_subject_unless_they_must_match_pictures(scene, tmp_path):
    found = []

    def fixed(*words):
        def frame(painter, view):
            found.append({coat.name for coat in painter.painting.coats if coat.distances is not None})
            return np.zeros((48, 64, 3), np.uint8) if painter.kind.suffix is None else b"a file"

        with patch.object(FramePainter, "__call__", frame):
            main(["render", str(scene), *BARE, "-o", str(tmp_path / "film.mp4"), *words])
        return found.pop()

    assert fixed("--orbit", "3") == {"backdrop"}
    assert fixed("--orbit", "3", "-o", str(tmp_path / "png/%05d.png")) == {"backdrop"}
    assert fixed("--orbit", "3", "-o", str(tmp_path / "exr/%05d.exr")) == set()  # a file that holds depth
    for words in (["--order", "soft"], ["--lock", "canonical"], ["--hold", "2"], ["--order", "depth"]):
        assert fixed("--orbit", "3", *words) == set()
