"""Balls of Gaussians of one shape and any aspect, alone or around ordinary ones, painted and measured.

Their plain pictures are nearly the same at any aspect above 100: what is thinner than the low-pass of the
renderer is drawn as thick as that. So a painting of few strokes should be as near to them at 1e8 as at 10.
"""

from typing import Any, Literal

import numpy as np

import brushgs as bg
from brushgs.measure.likeness import psnr
from brushgs.values.sh import C0

Shape = Literal["needle", "disc", "blob"]
COUNT = 4000
LENGTH = 0.1  # standard deviation along the longest axis, of a ball of radius 1
VIEW: dict[str, Any] = {
    "up": "-y",
    "azimuth": 30,
    "elevation": 15,
    "size": (320, 240),
    "background": "transparent",
}


def ball(shape: Shape, aspect: float, *, among_others: bool = False, seed: int = 5) -> bg.Gaussians:
    """4000 Gaussians that stand on a ball, needles like fur; among others, around half as many ordinary ones.

    Needles have one long axis, discs two, and the middle axis of blobs is the geometric mean of the others.
    """
    g = np.random.default_rng(seed)
    out = g.normal(size=(COUNT, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    means = out * (0.7 + 0.3 * g.uniform(size=(COUNT, 1)))
    quats = np.stack([1 + out[:, 2], -out[:, 1], out[:, 0], np.zeros(COUNT)], axis=1)  # z axis outwards
    thin, colors, opacities = 1 / aspect, 0.45 * out, np.full(COUNT, 0.95)
    axes = {"needle": (thin, thin, 1), "disc": (0.5, 0.5, 0.5 * thin), "blob": (1, thin**0.5, thin)}[shape]
    scales = np.tile(LENGTH * np.array(axes), (COUNT, 1))
    if among_others:
        others = g.normal(size=(COUNT // 2, 3))
        others /= np.linalg.norm(others, axis=1, keepdims=True)
        means = np.concatenate([means, 0.6 * others])
        quats = np.concatenate([quats, g.normal(size=(len(others), 4))])
        scales = np.concatenate([scales, np.exp(g.uniform(np.log(0.02), np.log(0.06), others.shape))])
        colors = np.concatenate([colors, 0.2 * np.sign(np.sin(4 * others))])
        opacities = np.concatenate([opacities, g.uniform(0.5, 1, len(others))])
    columns = means, quats, scales, opacities, colors[:, None] / C0
    return bg.Gaussians(*(np.ascontiguousarray(column, np.float32) for column in columns))


def plain(scene: bg.Gaussians) -> bg.Frame:
    return bg.paint(scene, "plain", stroke="gaussian", **VIEW)


def painted(scene: bg.Gaussians, share: float, **options: Any) -> bg.Frame:
    """So many strokes of flat paint, in the default way or as options say, such as preset="paper"."""
    if "preset" not in options:
        options["look"] = "plain"
    return bg.paint(scene, stroke="flat", strokes=round(share * len(scene)), **VIEW, **options)


def likeness(frame: bg.Frame, expected: bg.Frame) -> tuple[float, float]:
    """PSNR in dB, both on white; and the share of the picture that is painted over that of the other."""
    on_white = psnr(frame.over((1, 1, 1)), expected.over((1, 1, 1)))
    return on_white, float(frame.alpha.mean(dtype=np.float64) / expected.alpha.mean(dtype=np.float64))
