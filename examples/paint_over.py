"""Writes paint_over.jpg: paint over one view of the still life, in other views and another look.

python examples/paint_over.py [FOLDER]

The frame, the painted layer and the marks are written beside it. In place of a painting program, NumPy draws
a highlight, a dark edge and a wash.
"""

import sys
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.still_life import still_life

SIZE, STROKES = (360, 270), "2500"
# From, to (shares of the picture), width in pixels, color and opacity.
LINES = (
    ((0.42, 0.2), (0.425, 0.31), 7.0, (1.0, 0.98, 0.90), 1.0),  # a highlight down the jug
    ((0.37, 0.50), (0.40, 0.61), 3.0, (0.20, 0.03, 0.10), 1.0),  # an edge of the apple
    ((0.05, 0.60), (0.30, 0.66), 26.0, (0.15, 0.35, 0.75), 0.6),  # a blue wash over the cloth
)


def painted_layer() -> bg.Frame:
    """The lines, on nothing."""
    width, height = SIZE
    y, x = np.mgrid[:height, :width] + 0.5
    rgb, alpha = np.zeros((height, width, 3)), np.zeros((height, width))
    for start, end, size, color, opacity in LINES:
        first, span = np.multiply(start, SIZE), np.multiply(np.subtract(end, start), SIZE)
        share = np.clip(((x - first[0]) * span[0] + (y - first[1]) * span[1]) / (span @ span), 0, 1)
        away = np.hypot(x - first[0] - share * span[0], y - first[1] - share * span[1])
        own = opacity * np.clip(size / 2 - away + 0.5, 0, 1)
        rgb = own[..., None] * color + (1 - own[..., None]) * rgb
        alpha = own + (1 - own) * alpha
    return bg.Frame(rgb.astype(np.float32), alpha.astype(np.float32))


def run(folder: Path) -> Path:
    """Paint, adopt, and show the marks in other views; the path of the picture."""
    bg.save(still_life(), folder / "still_life.ply")
    scene, size = str(folder / "still_life.ply"), f"{SIZE[0]}x{SIZE[1]}"

    def render(name: str, *words: str) -> None:
        given = ("--up=-y", "--size", size, "--strokes", STROKES, "--quiet", "-o", str(folder / name))
        if main(["render", scene, *given, *words]) != 0:
            raise SystemExit(f"{name} was not painted")

    render("frame.png", "--sidecar")
    write_frame(painted_layer(), folder / "layer.png")
    marks = str(folder / "still_life.marks")
    given = ("--on", str(folder / "frame.png"), "-o", marks, "--quiet")
    if main(["adopt", str(folder / "layer.png"), scene, *given]) != 0:
        raise SystemExit("the layer was not adopted")
    views = {
        "frame.png": None,
        "same.png": (),
        "left.png": ("--azimuth", "10"),
        "watercolour.png": ("--look", "watercolour"),
    }
    for name, words in views.items():
        if words is not None:
            render(name, "--marks", marks, *words)
    pictures = [read_image(folder / name)[..., :3] for name in views]
    sheet = np.concatenate([np.concatenate(pictures[:2], 1), np.concatenate(pictures[2:], 1)])
    opaque = np.ones(sheet.shape[:2], np.float32)
    write_frame(bg.Frame(sheet, opaque), folder / "paint_over.jpg", (1, 1, 1))
    return folder / "paint_over.jpg"


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    print(run(folder))
