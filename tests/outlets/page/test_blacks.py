"""Spot blacks of the page at rest against those of the exact renderer, of the same picture."""

import numpy as np

import brushgs as bg
from brushgs.rendering.tonal import Blacks
from tests.chromium import blank_tab
from tests.outlets.page.studio import Studio, decoded, encoded

HOOK = """
window.studio.blacks = (blacks, width, height, colors, depths) => {
  const [read, known] = [colors, depths].map((text) => decoded(text, Float32Array));
  const picture = { width, height, colors: read, depths: known };
  makeBlacks(blacks, picture);
  return encoded(picture.colors);
};
"""
SIZE = {"width": 101, "height": 67}


def masses(seed):
    """Grey blobs of all tones and sizes before a darker wall, with gaps."""
    g = np.random.default_rng(seed)
    y, x = np.mgrid[: SIZE["height"], : SIZE["width"]].astype(np.float64)
    tone, alpha, depth = np.full(x.shape, 0.25), np.clip((x - 4) / 9, 0, 1), 5 + 0.02 * x
    for _ in range(60):
        (cx, cy), radius = g.uniform((0, 0), (SIZE["width"], SIZE["height"])), g.uniform(1.5, 14)
        inside = np.hypot(x - cx, (y - cy) * g.uniform(0.5, 2)) < radius
        tone[inside] = g.uniform(0.05, 0.6)
        depth[inside] -= g.choice([0.0, 1.0])
        alpha[inside] = g.choice([0.4, 0.48, 1.0, 1.0])
    tone += g.normal(0, 0.03, tone.shape)
    return bg.Frame((alpha * tone)[..., None] * np.ones(3), alpha, depth)


def test_blacks_of_a_picture_are_those_of_the_exact_renderer(browser):
    """But for tones that round to the other side of the threshold, 1 in 1000 pixels; measured: none."""
    with blank_tab(browser) as page:
        studio = Studio(page, HOOK)
        camera = bg.Camera.look_at((0, 0, -5), (0, 0, 0), **SIZE)
        for seed, least in ((0, 1e-3), (1, 6e-3), (2, 0.012)):
            frame = masses(seed)
            frame = bg.Frame(*(plane.astype(np.float32) for plane in (frame.rgb, frame.alpha, frame.depth)))
            effect = Blacks(0.24, least, (0.1, 0.12, 0.2), (0.95, 0.9, 0.85))
            exact = effect(frame, camera)
            colors = np.dstack([frame.rgb, frame.alpha])
            facts = {"threshold": 0.24, "leastArea": least, "ink": effect.ink, "paper": effect.paper}
            given = [facts, *SIZE.values(), encoded(colors), encoded(frame.depth)]
            text = studio.page.evaluate("a => studio.blacks(...a)", given)
            found = decoded(text, np.float32).reshape(colors.shape)
            off = np.abs(found - np.dstack([exact.rgb, exact.alpha])).max(axis=-1)
            assert 0.02 < (exact.rgb[..., 0] < 0.5 * exact.alpha).mean() < 0.9
            assert (off > 1e-3).mean() <= 1e-3
