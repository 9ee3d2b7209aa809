"""Marks of styles: what is learnt against the truth, and how far painted strokes run as the marks do.

    python -m tests.bench.style_marks [SCENE ...]      # koala, truck, chair, still_life

First table: the four paintings of `tests.bench.mark_paintings`, learnt against true. Second: each scene as
`brushgs render --style` paints it in the look oil, with as many strokes, 480x360, but on nothing and without
light, with none, half and all of each style, colours and marks. "Histogram" is the total variation distance,
0 to 1, of the edge energy over 8 directions from that of the painting, as `tests.bench.style` has it, mean of
3 scales; swirls have all directions, so it says little of them. "Agreement" is the mean of cos 2 d, d the
angle between the structure tensor of the picture and that of the painting that lies over it, where there is
paint: 0 by chance, 1 for the same direction everywhere.
"""

import sys
import tempfile
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.formats.styles import write_style
from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.styling import StyleConfig
from brushgs.passes.form.mark_directions import Marks, mark_pairs, marks_at, shrunk
from brushgs.passes.style.marks import learn_marks
from brushgs.passes.style.palette import learn_palette
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.styling import styled_values
from brushgs.still_life import still_life, still_life_camera
from brushgs.values.style import Style
from tests.bench.machine import describe
from tests.bench.mark_paintings import KINDS, paint
from tests.bench.style import _energies, _shares
from tests.scenes import SCENES_FOLDER

SIZE = 480, 360
SCENES = {"koala": "koala.ply", "truck": "truck.splat", "chair": "derived/chair.ply"}
DIALS = (0.0, 0.5, 1.0)
TENDED = ("cluster", "brushes", "draw", "color")  # tables of the look that strokes are made by


def learnt(folder: Path) -> dict[str, Path]:
    """Print the first table; the files of the styles by their names."""
    print("painting | length | aspect | direction, degrees off | ground | lightness | brushes | kB | seconds")
    print("-|-|-|-|-|-|-|-|-")
    files = {}
    for name, kind in KINDS.items():
        image = paint(name)
        start = time.perf_counter()
        marks = learn_marks(image)
        seconds = time.perf_counter() - start
        files[name] = folder / f"{name}.style"
        write_style(Style(name, learn_palette(image), marks), files[name])
        cells = [name, f"{marks.length:.3f} ({kind.length:g})", f"{marks.aspect:.1f} ({kind.aspect:g})"]
        cells += [f"{_off(marks.directions, kind):.1f}", _code(marks.ground)]
        cells[-1] += f" ({kind.ground if kind.shows_ground else 'none'})"
        cells += [f"{marks.broken_lightness:.3f}", str(len(marks.brushes))]
        cells += [f"{files[name].stat().st_size / 1000:.0f}", f"{seconds:.1f}"]
        print(" | ".join(cells), flush=True)
    return files


def _off(found, kind) -> float:
    rows, columns = found.shape[:2]
    y, x = (np.mgrid[:rows, :columns] + 0.5) / min(rows, columns)
    angles = 2 * kind.angles(x, y)
    clear = np.hypot(found[..., 0], found[..., 1])
    cosines = (found[..., 0] * np.cos(angles) + found[..., 1] * np.sin(angles)) / np.maximum(clear, 1e-9)
    away = np.degrees(0.5 * np.arccos(np.clip(cosines, -1, 1)))
    return float(np.average(away, weights=clear))


def _code(rgb) -> str:
    return "none" if rgb is None else "#" + "".join(f"{round(255 * float(c)):02x}" for c in rgb)


@cache
def _still_life() -> bg.Gaussians:
    return still_life()


def painted(scene: str, file: Path, share: float, memory: Memory) -> bg.Frame:
    """A scene in a style, its strokes alone; memory is of the scene."""
    look = {step: fields for step, fields in Look.open("oil").values.items() if step in TENDED}
    style = StyleConfig.parse(f"{file}:{share:g}")
    config = PaintConfig.of(styled_values(look, style) | {"view": {"size": SIZE}, "light": {}, "ground": {}})
    config = replace(config, style=style)
    if scene == "still_life":
        source, views = _still_life(), still_life_camera(width=SIZE[0], height=SIZE[1])
    else:
        source, views = SceneSource.of(SCENES_FOLDER / SCENES[scene]), None
    ready = prepare(source, config, Report(), views=views, memory=memory, on_background=False)
    return ready.painting.frame(ready.camera)


def histogram(frame: bg.Frame, painting) -> float:
    """Distance of the directions of a picture from those of a painting."""
    here = _shares(_energies(frame.over(painting.mean(axis=(0, 1))), frame.alpha))
    there = _shares(_energies(painting, np.ones(painting.shape[:2])))
    return float(0.5 * np.abs(here - there).sum(axis=1).mean())


def agreement(frame: bg.Frame, painting) -> float:
    """How far a picture runs as the painting that lies over it."""
    white = np.concatenate([frame.over((1, 1, 1)), np.ones((*frame.alpha.shape, 1))], axis=2)
    here = mark_pairs(*shrunk(white))
    camera = bg.Camera.look_at((0, 0, -1), (0, 0, 0), (0, -1, 0), width=SIZE[0], height=SIZE[1])
    rows, columns = here.shape[:2]
    y, x = (np.mgrid[:rows, :columns] + 0.5) * (SIZE[0] / columns)
    there = marks_at(Marks(camera, mark_pairs(*shrunk(painting))), x.ravel(), y.ravel())
    step = frame.alpha.shape[0] // rows
    alpha = frame.alpha[: rows * step : step, : columns * step : step]
    here = here.reshape(-1, 2) * (alpha.ravel() > 0.9)[:, None]
    weights = np.hypot(*here.T) * np.hypot(*there.T)
    return float((here * there).sum() / max(weights.sum(), 1e-12))


def main() -> None:
    """As the docstring of the module says."""
    print(describe() + "\n")
    scenes = sys.argv[1:] or [*(n for n, p in SCENES.items() if (SCENES_FOLDER / p).exists()), "still_life"]
    with tempfile.TemporaryDirectory() as name:
        files = learnt(Path(name))
        paintings = {name: paint(name, size=SIZE) for name in KINDS}
        print("\nscene | painting | histogram at 0, 0.5, 1 | comes closer by | agreement at 0, 0.5, 1")
        print("-|-|-|-|-")
        for scene in scenes:
            memory = Memory()
            plain = painted(scene, next(iter(files.values())), 0, memory)
            for kind, file in files.items():
                frames = [plain, *(painted(scene, file, share, memory) for share in DIALS[1:])]
                far = [histogram(frame, paintings[kind]) for frame in frames]
                agree = [agreement(frame, paintings[kind]) for frame in frames]
                cells = [scene, kind, ", ".join(f"{x:.2f}" for x in far), f"{1 - far[-1] / far[0]:.0%}"]
                print(" | ".join([*cells, ", ".join(f"{x:.2f}" for x in agree)]), flush=True)


if __name__ == "__main__":
    main()
