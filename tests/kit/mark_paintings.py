"""Four paintings of known marks, by which what is learned of marks is judged.

    python -m tests.kit.mark_paintings [FOLDER [WIDTH HEIGHT]]   # hatching.png and so on, 1000x750

Their marks are drawn on a ground by this project's own rasteriser, nearest first. Lengths are shares of the
shorter side, as in `brushgs.values.style`.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.passes.style.marks import learn_marks
from brushgs.values.style import StyleMarks
from tests.kit.paintings import _opaque, _ramp

SIZE = 1000, 750  # width, height


@dataclass(frozen=True)
class Kind:
    """A way of the brush, and so the truth about its marks.

    Attributes:
        length: of a mark as it is drawn.
        aspect: its length over its width.
        angles: of marks at places (x, y), shares of the shorter side.
        colors: [n, 3] of marks there, from a random generator.
        brush: that they are drawn with.
        opacity: of each.
        cover: how often marks cover the picture, on average.
        ground: "#rrggbb".
        shows_ground: whether it shows.
    """

    length: float
    aspect: float
    angles: Callable
    colors: Callable
    brush: str
    opacity: float
    cover: float
    ground: str
    shows_ground: bool


def _hatched(x, y, rng):
    light = 0.5 + 0.3 * np.sin(5 * x + 3 * np.sin(4 * y)) + 0.12 * rng.normal(size=len(x))
    return _ramp(light, ["#2a1a10", "#4a2a12", "#8a5420", "#c98a2b", "#e3b65a"])


def _swirl_angles(x, y):
    middles = np.array([[0.25, 0.27], [0.9, 0.3], [0.55, 0.75], [1.15, 0.8]])
    away = np.stack([x, y], -1)[..., None, :] - middles
    nearest = np.linalg.norm(away, axis=-1).argmin(axis=-1)
    dx, dy = np.moveaxis(np.take_along_axis(away, nearest[..., None, None], axis=-2)[..., 0, :], -1, 0)
    return np.arctan2(dy, dx) + np.pi / 2


def _swirled(x, y, rng):
    light = 0.45 + 0.25 * np.sin(7 * x - 4 * y) + 0.18 * rng.normal(size=len(x))
    colors = _ramp(light, ["#0a1238", "#14286a", "#2a52a8", "#5b8fd0", "#b9d3e6"])
    is_star = rng.random(len(x)) < 0.07
    colors[is_star] = _ramp(rng.random(is_star.sum()), ["#d9a520", "#f8e48a"])
    return colors


def _dabbed(x, y, rng):
    light = 0.6 - 0.3 * y + 0.2 * rng.normal(size=len(x))
    colors = _ramp(light, ["#0f3a1e", "#2e6b2f", "#6fa33c", "#c2d67a"])
    is_bloom = np.sin(14 * x) + np.sin(16 * y + 6 * x) + 0.8 * rng.normal(size=len(x)) > 0.9
    colors[is_bloom] = _ramp(rng.random(is_bloom.sum()), ["#43206b", "#7a3fa8", "#c79be0"])
    return colors


def _washed(x, y, rng):
    light = 0.5 + 0.3 * np.sin(4 * x + 2 * y) + 0.25 * rng.normal(size=len(x))
    return _ramp(light, ["#2c4a6e", "#5d7f9c", "#a9a78a", "#c98f6b"])


KINDS: dict[str, Kind] = {
    "hatching": Kind(
        0.10, 9.0, lambda x, y: np.full(np.shape(x), -np.pi / 4), _hatched, "flat", 1.0, 1.5, "#e8dcc0", True
    ),
    "swirls": Kind(0.085, 5.0, _swirl_angles, _swirled, "filbert", 1.0, 6.0, "#14286a", False),
    "dabs": Kind(
        0.032, 1.6, lambda x, y: np.full(np.shape(x), np.pi / 2), _dabbed, "dab", 1.0, 2.0, "#efe6cf", True
    ),
    "washes": Kind(0.30, 1.6, lambda x, y: 0.4 * np.sin(5 * x), _washed, "wash", 0.5, 4.0, "#fbfaf2", False),
}


def paint(name: str, *, size=SIZE, seed: int = 0) -> np.ndarray:
    """[H, W, 3] one of the paintings, float32."""
    kind, rng = KINDS[name], np.random.default_rng(seed)
    width, height = size
    short = min(size)
    texture = bg.StrokeTexture.open(kind.brush)
    area = kind.length**2 / kind.aspect * float(texture.coverage.mean()) / 255
    reach = 0.5 * kind.length
    num = int(kind.cover * (width / short + 2 * reach) * (height / short + 2 * reach) / area)
    x = rng.uniform(-reach, width / short + reach, num)
    y = rng.uniform(-reach, height / short + reach, num)
    angles = kind.angles(x, y) + 0.08 * rng.normal(size=num)
    sizes = (
        rng.uniform(0.85, 1.18, (num, 1)) * 0.5 * short * np.array([kind.length, kind.length / kind.aspect])
    )
    boxes = bg.Boxes(
        centers=short * np.stack([x, y], 1),
        half_extents=sizes,
        angles=angles,
        depths=np.arange(1.0, num + 1),
        colors=np.clip(kind.colors(x, y, rng), 0, 1),
        opacities=np.full(num, kind.opacity),
        ids=np.arange(num, dtype=np.int32),
    )
    frame = bg.rasterize(boxes, texture, width=width, height=height, depth=False)
    return _opaque(frame, _ramp(np.zeros(1), [kind.ground, kind.ground])[0])[0]


@cache
def learned(name: str) -> StyleMarks:
    """What is learned of the marks of one of the paintings, once a process: it takes three seconds."""
    return learn_marks(paint(name, size=(800, 600)))


def write(folder: Path, *, size=SIZE) -> dict[str, Path]:
    """All four as PNG; name -> path."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {name: folder / f"{name}.png" for name in KINDS}
    for name, path in paths.items():
        rgb = paint(name, size=size)
        bg.save(bg.Frame(rgb, np.ones(rgb.shape[:2], np.float32), None), path)
    return paths


if __name__ == "__main__":
    folder, size = Path(sys.argv[1] if len(sys.argv) > 1 else "."), tuple(map(int, sys.argv[2:])) or SIZE
    for written in write(folder, size=size).values():
        print(written)
