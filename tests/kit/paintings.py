"""Three paintings of the project's own making, each with its colors and its way of the brush.

    python -m tests.kit.paintings [FOLDER]      # ochre.png, night.png, garden.png, 480x360

`ochre` is hatched from lower left to upper right in ochre, umber and cream; `night` swirls in blues around
yellow stars; `garden` is dabbed upright in greens with violet.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import brushgs as bg

SIZE = 480, 360  # width, height


def _ochre(x, y, rng):
    angles = -np.pi / 4 + 0.10 * rng.normal(size=len(x))
    light = 0.5 + 0.5 * np.sin(x / 60.0 + 1.5 * np.sin(y / 45.0)) + 0.25 * rng.normal(size=len(x))
    return angles, _ramp(light, ["#4a2a12", "#8a5420", "#c98a2b", "#e3b65a", "#f6e6c0"]), (20.0, 3.2)


def _night(x, y, rng):
    middles = np.array([[110, 100], [330, 80], [230, 250], [420, 280], [50, 300]])
    away = np.stack([x, y], 1)[:, None] - middles
    distances = np.linalg.norm(away, axis=2)
    nearest = distances.argmin(axis=1)
    dx, dy = away[np.arange(len(x)), nearest].T
    angles = np.arctan2(dy, dx) + np.pi / 2 + 0.12 * rng.normal(size=len(x))
    near = distances.min(axis=1)
    light = 0.45 + 0.4 * np.sin(near / 9.0) + 0.2 * rng.normal(size=len(x))
    colors = _ramp(light, ["#0a1238", "#14286a", "#2a52a8", "#5b8fd0", "#b9d3e6"])
    is_star = near < 20 + 3 * rng.normal(size=len(x))
    colors[is_star] = _ramp(rng.random(is_star.sum()), ["#d9a520", "#f8e48a"])
    return angles, colors, (15.0, 3.2)


def _garden(x, y, rng):
    angles = np.pi / 2 + 0.10 * rng.normal(size=len(x))
    light = 0.6 - 0.4 * y / SIZE[1] + 0.3 * rng.normal(size=len(x))
    colors = _ramp(light, ["#0f3a1e", "#2e6b2f", "#6fa33c", "#c2d67a"])
    is_bloom = np.sin(x / 33.0) + np.sin(y / 27.0 + x / 70.0) + 0.6 * rng.normal(size=len(x)) > 0.7
    colors[is_bloom] = _ramp(rng.random(is_bloom.sum()), ["#43206b", "#7a3fa8", "#c79be0"])
    return angles, colors, (13.0, 3.8)


PAINTINGS: dict[str, Callable] = {"ochre": _ochre, "night": _night, "garden": _garden}


def paint(name: str, num_strokes: int = 5000, seed: int = 0) -> bg.Frame:
    """One of the paintings, from strokes in a random order."""
    rng = np.random.default_rng(seed)
    width, height = SIZE
    x, y = rng.uniform(-10, width + 10, num_strokes), rng.uniform(-10, height + 10, num_strokes)
    angles, colors, half = PAINTINGS[name](x, y, rng)
    sizes = np.array(half) * rng.uniform(0.8, 1.25, (num_strokes, 1))
    boxes = bg.Boxes(
        centers=np.stack([x, y], 1),
        half_extents=sizes,
        angles=angles,
        depths=np.arange(1.0, num_strokes + 1),
        colors=np.clip(colors, 0, 1),
        opacities=np.full(num_strokes, 0.95),
        ids=np.arange(num_strokes, dtype=np.int32),
    )
    return bg.rasterize(boxes, bg.StrokeTexture.open("flat"), width=width, height=height, depth=False)


def write(folder: Path) -> dict[str, Path]:
    """All three as PNG; name -> path."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {name: folder / f"{name}.png" for name in PAINTINGS}
    for name, path in paths.items():
        # On the color of its middle tone: nowhere does a ground show that is no paint.
        frame = paint(name)
        ground = frame.rgb.mean(axis=(0, 1)) / frame.alpha.mean()
        bg.save(bg.Frame(*_opaque(frame, ground)), path)
    return paths


def _opaque(frame, ground):
    rgb = frame.over(ground).astype(np.float32)
    return rgb, np.ones(rgb.shape[:2], np.float32), None


def _ramp(shares, colors):
    """[n, 3] colors along a ramp of "#rrggbb" at shares of 0 to 1."""
    stops = np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in colors])
    places = np.linspace(0, 1, len(stops))
    return np.stack([np.interp(np.clip(shares, 0, 1), places, channel) for channel in stops.T], axis=1)


if __name__ == "__main__":
    for written in write(Path(sys.argv[1] if len(sys.argv) > 1 else ".")).values():
        print(written)
