"""Pruning and merging a single opaque layer must not punch holes into it."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.likeness import psnr, unpainted
from brushgs.still_life import still_life_camera
from tests.passes import layers
from tests.scenes import still_life_of

NUM_STROKES = 343
LAYERS = {"plane": layers.plane, "relief": layers.relief, "sphere": layers.sphere}


class Subject:
    """A scene, its cameras, and strokes by each rule; all but the pictures of strokes made once."""

    def __init__(self, scene, cameras):
        self.scene, self.cameras = scene, cameras
        self.plain = self.frames(scene, "gaussian")
        self.strokes = {
            "default": bg.cluster(bg.prune(scene), NUM_STROKES),
            "keep 1": bg.cluster(scene, NUM_STROKES),
            "paper": bg.cluster(
                bg.prune(scene, weight="paper"),
                NUM_STROKES,
                features="paper",
                merge="paper",
                method="minibatch",
            ),
        }

    def frames(self, gaussians, stroke, *, is_paper=False):
        texture = bg.StrokeTexture.open(stroke)
        sigmas = texture.num_sigmas if is_paper else texture.fitted_sigmas
        return [
            bg.render(gaussians, camera, texture, num_sigmas=sigmas, lock="off", depth=False)
            for camera in self.cameras
        ]

    def quality(self, rule, stroke):
        """PSNR to the plain picture on white, dB, and the share of it that stays unpainted."""
        frames = self.frames(self.strokes[rule], stroke, is_paper=rule == "paper")
        return compare(frames, self.plain)


def compare(frames, plain):
    pictures = [np.concatenate([np.clip(f.over((1, 1, 1)), 0, 1) for f in side]) for side in (frames, plain)]
    alphas = [np.concatenate([frame.alpha for frame in side]) for side in (frames, plain)]
    return psnr(*pictures), unpainted(*alphas)


@pytest.fixture(scope="module", params=[*LAYERS, "still life"])
def subject(request):
    if request.param == "still life":
        return Subject(still_life_of(5900), [still_life_camera(width=168, height=126)])
    return Subject(LAYERS[request.param](), layers.cameras())


@pytest.mark.parametrize("stroke", ["gaussian", "flat"])
def test_default_pruning_loses_little_against_none_and_beats_the_published_rule(subject, stroke):
    (default, missing), (all_kept, missing_anyway), (paper, torn) = (
        subject.quality(rule, stroke) for rule in ("default", "keep 1", "paper")
    )
    assert default > all_kept - 0.5
    assert missing < missing_anyway + 0.015
    if stroke == "flat":
        assert default > paper
        assert missing < torn + 0.01
    elif len(subject.cameras) == 2:  # a single layer: without growth 0.14 to 0.3 of it stay unpainted
        assert missing < 0.13
