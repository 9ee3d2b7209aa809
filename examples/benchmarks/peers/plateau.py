"""Why more strokes of oil do not come nearer to the plain picture: parts of the look left out one at a time.

    python -m examples.benchmarks.peers.plateau [SCENE] [--strokes 2000 6000] [--size 640x360] [--json FILE]

PSNR in dB of the subject, as in the table of peers. "Bare oil" leaves out all that changes colors on
purpose. The rows below it leave one part out of oil, and the last ones one part more out of bare oil.
"""

import argparse
import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import brushgs as bg
from brushgs.options.direction import Direction
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.runner import Memory, holding
from brushgs.still_life import still_life
from examples.benchmarks.machine import describe
from examples.benchmarks.peers.columns import nearness
from examples.benchmarks.peers.of_brushgs import ScenePainter, config_of
from examples.benchmarks.peers.run import cameras_of
from examples.benchmarks.peers.task import Task, on_white

Changes = Mapping[str, Mapping[str, Any]]

PARTS: dict[str, Changes] = {
    "lamp on the scene (--key)": {"light": {"key": 0.0}},
    "values drawn together (--values)": {"color": {"values": 0.0}},
    "relief (--relief)": {"light": {"relief": 0.0}},
    "canvas (--canvas)": {"light": {"canvas": "none"}},
    "broken color": {"strokes": {"broken_color": 0.0}},
    "streaks": {"draw": {"streaks": 0.0}},
    "lost edges (--edges)": {"strokes": {"edges": 0.0}},
    "economy and focus": {"strokes": {"economy": 0.0, "focus": None}},
    "stage": {"ground": {"stage": False}},
}
SHAPES: dict[str, Changes] = {
    "underpaint": {"draw": {"underpaint": False}},
    "solid paint": {"strokes": {"solid": False}},
    "direction of form": {"strokes": {"direction": Direction("own")}},
    "several brushes (flat alone)": {"draw": {"stroke": "flat"}},
    "brush texture (ellipse)": {"draw": {"stroke": "ellipse"}},
    "hard brush (gaussian)": {"draw": {"stroke": "gaussian"}},
    "merging's worth (as published)": {"cluster": {"merge": "paper"}},
    "strokes outside the view": {"cluster": {"strokes_for": "view"}},
}


def changed(config: PaintConfig, *changes: Changes) -> PaintConfig:
    """A painting with some fields changed; a stroke of one's own replaces the brushes of the look."""
    for each in changes:
        for step, values in each.items():
            if "stroke" in values:
                config = replace(config, brushes=BrushesConfig())
            config = replace(config, **{step: replace(getattr(config, step), **values)})
    return config


def arms() -> dict[str, tuple[Changes, ...]]:
    """Row -> what is left out."""
    bare = tuple(PARTS.values())
    return (
        {"oil": (), "bare oil": bare}
        | {f"oil, without {name}": (change,) for name, change in PARTS.items()}
        | {f"bare, without {name}": (*bare, change) for name, change in SHAPES.items()}
    )


def table(task: Task, counts: list[int]) -> dict[str, dict[int, float]]:
    """PSNR by row and number of strokes."""
    frame = task.plain_frame(0)
    plain, found = on_white(frame), {}
    for name, changes in arms().items():
        found[name] = {}
        for count in counts:
            job = replace(task, strokes=count)
            picture = ScenePainter(job, changed(config_of("oil", job), *changes)).paint(0)
            found[name][count] = nearness(picture, plain, frame.alpha)[0]
        print(
            f"| {name} | " + " | ".join(f"{value:.2f}" for value in found[name].values()) + " |", flush=True
        )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", nargs="?", type=Path, help="default the still life")
    parser.add_argument("--strokes", type=int, nargs="+", default=[2000, 6000])
    parser.add_argument("--size", default="640x360", help="WIDTHxHEIGHT")
    parser.add_argument("--json", type=Path, help="write the figures to this file, too")
    options = parser.parse_args()
    print(describe(), file=sys.stderr)
    width, height = (int(side) for side in options.size.lower().split("x"))
    with TemporaryDirectory() as folder:
        file = options.scene or Path(folder) / "still_life.ply"
        if options.scene is None:
            bg.save(still_life(), file)
        source, view = SceneSource((file,)), ViewConfig(size=(width, height))
        task = Task(source, view, cameras_of(source, view)[:1], 1, "")
        with holding(Memory()):  # rows share what the steps before their change made
            found = table(task, options.strokes)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
