"""What refinement gains: error against seconds, flicker before and after, and the sets of parameters.

    OMP_NUM_THREADS=1 python -m tests.bench.refine [--scenes koala chair truck biker]
        [--textures swirl dry_brush] [--params all] [--strokes 2000] [--steps 900] [--json FILE] [--plot FILE]

Strokes are those of the default pipeline (prune 0.7, cluster), fitted as `brushgs refine` does: 320 training
views of 384 x 288, 6 validation views, PSNR on white to the plain picture. Thin strokes have a longest scale
of more than 10 times the middle one.

Flicker is the excess of the temporal report (`measure.stability`), of `track` at gap 1: at `--places` places
of an orbit around the framed view two pictures are painted 1.5 degrees apart, in soft order, fading; the
earlier is moved to the later view, and the RMSE of the plain picture over the same pair subtracted. Of 255.

"CPU s in all" is processor time of all threads, views with their plain pictures included; "s to +3 dB" is
wall clock of the steps until the first evaluation that found it.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import up_vector
from brushgs.measure.plotting import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    label,
    new_figure,
    save_figure,
)
from brushgs.measure.warp import match_views
from brushgs.options.experiments import DEFAULT_STEPS, REFINE_SIZE
from brushgs.refine.distil import distil
from brushgs.refine.fit import Drawing, FitSchedule
from brushgs.refine.run import NUM_VALIDATION_VIEWS, SELF_VIEWS
from brushgs.refine.targets import draw_targets
from brushgs.refine.variables import Variables
from brushgs.refine.views import TimedView, views_around
from brushgs.rendering.track import track_directions
from tests.bench.flicker import WHITE, orbit, plain_view
from tests.bench.machine import describe
from tests.scenes import SCENES_FOLDER

SCENES = {
    "koala": ("koala.ply", "-y"),
    "chair": ("derived/chair.ply", "+z"),
    "truck": ("derived/truck.ply", "-y"),
    "biker": ("biker.compressed.ply", "-y"),
}
STEP, SIZE, THIN = np.radians(1.5), 400, 10.0
LEAST_EXCESS = 0.5  # of 255


def thin_share(strokes: bg.Gaussians) -> float:
    scales = np.sort(strokes.scales, axis=1)
    return float((scales[:, 2] > THIN * scales[:, 1]).mean())


def excess(
    scene: bg.Gaussians, strokes: bg.Gaussians, texture: bg.StrokeTexture, up: str, places: int
) -> float:
    """Mean excess over the pairs, of 255."""
    found = []
    for pair in orbit(scene, up_vector(up), SIZE, np.arange(places) * 2 * np.pi / places, STEP):
        path = track_directions(strokes, pair)
        pictures = []
        for index, camera in enumerate(pair):
            boxes = bg.project(
                strokes,
                camera,
                num_sigmas=texture.fitted_sigmas,
                lock=path.directions(index),
                fade=True,
                order="soft",
            )
            frame = bg.rasterize(boxes, texture, height=SIZE, width=SIZE, filter="mip", depth=False)
            pictures.append(frame.over(WHITE))
        views = [plain_view(scene, camera) for camera in pair]
        match = match_views(*views)
        if len(match.pixels):
            plain = match.error(views[0].rgb, views[1].rgb, keep_map=False).rmse
            found.append(match.error(*pictures, keep_map=False).rmse - plain)
    return 255 * float(np.mean(found))


def measure(name: str, args: argparse.Namespace) -> list[dict[str, Any]]:
    path, up = SCENES[name]
    scene = bg.load(SCENES_FOLDER / path)
    strokes = bg.cluster(bg.prune(scene), args.strokes)
    start = time.process_time()
    size = {"width": REFINE_SIZE[0], "height": REFINE_SIZE[1], "up": up}
    training_views, validation_views = (
        draw_targets(
            [TimedView(camera) for camera in views_around(scene, num, **size, shift=shift)], lambda _: scene
        )
        for num, shift in ((args.views, 0.0), (NUM_VALIDATION_VIEWS, 0.5))
    )
    preparing = time.process_time() - start
    rows = []
    for stroke in args.textures:
        texture = bg.StrokeTexture.open(stroke)
        drawing = Drawing.of(texture)
        flicker = excess(scene, strokes, texture, up, args.places)
        for params in args.params:
            start = time.process_time()
            refined, curve = distil(
                Variables(strokes, params), training_views, validation_views, drawing, FitSchedule(args.steps)
            )
            rows.append(
                {
                    "scene": name,
                    "stroke": stroke,
                    "params": params,
                    "before": curve.scores[0],
                    "after": max(curve.scores),
                    "to_3": next(
                        (
                            s
                            for s, x in zip(curve.seconds, curve.scores, strict=True)
                            if x >= curve.scores[0] + 3
                        ),
                        None,
                    ),
                    "cpu_seconds": preparing + time.process_time() - start,
                    "flicker_before": flicker,
                    "flicker_after": excess(scene, refined, texture, up, args.places),
                    "thin_before": thin_share(strokes),
                    "thin_after": thin_share(refined),
                    "steps": curve.steps[-1],
                    "curve_seconds": curve.seconds,
                    "curve_scores": curve.scores,
                    "curve_losses": [None if np.isnan(x) else x for x in curve.losses],
                    "stopped": curve.stopped,
                }
            )
            print(line(rows[-1]), flush=True)
    return rows


HEADS = (
    *("scene", "stroke", "params", "steps", "dB before", "dB after", "gain", "s to +3 dB", "CPU s in all"),
    *("flicker before", "after", "ratio", "thin before", "thin after"),
)
HEAD = f"| {' | '.join(HEADS)} |\n|{'---|' * len(HEADS)}"


def line(row: dict[str, Any]) -> str:
    cells = [
        row["scene"],
        row["stroke"],
        row["params"],
        str(row["steps"]),
        f"{row['before']:.2f}",
        f"{row['after']:.2f}",
        f"{row['after'] - row['before']:+.2f}",
        "-" if row["to_3"] is None else f"{row['to_3']:.0f}",
        f"{row['cpu_seconds']:.0f}",
        f"{row['flicker_before']:.2f}",
        f"{row['flicker_after']:.2f}",
        # Where strokes move no more than the plain picture itself there is no excess to compare with.
        f"{row['flicker_after'] / row['flicker_before']:.2f}"
        if row["flicker_before"] > LEAST_EXCESS
        else "-",
        f"{row['thin_before']:.1%}",
        f"{row['thin_after']:.1%}",
    ]
    return "| " + " | ".join(cells) + " |"


def plot(rows: list[dict[str, Any]], path: Path) -> None:
    figure = new_figure(9.0, 3.0, "Refinement: gain in validation views")
    by_scene, by_params = figure.subplots(1, 2)
    colors = dict(zip(SCENES, (BLUE, GREEN, VERMILION, PURPLE), strict=True))
    styles = dict(zip(("colour", "free", "all"), (ORANGE, SKY, BLUE), strict=True))
    variants = {(row["scene"], row["stroke"]) for row in rows if row["params"] == "colour"}
    for row in rows:
        gain = np.array(row["curve_scores"]) - row["curve_scores"][0]
        if row["params"] == "all":
            dashes = "-" if row["stroke"] == "swirl" else "--"
            name = f"{row['scene']}, {row['stroke']}"
            by_scene.plot(row["curve_seconds"], gain, dashes, color=colors[row["scene"]], lw=1.2, label=name)
        if (row["scene"], row["stroke"]) in variants:
            by_params.plot(
                row["curve_seconds"], gain, color=styles[row["params"]], lw=1.3, label=row["params"]
            )
    label(by_scene, "seconds of steps", "gain (dB)", "All parameters; the line is the target of +3 dB")
    by_scene.axhline(3, color="black", linewidth=0.6)
    shown = ", ".join(f"{scene}, {stroke}" for scene, stroke in sorted(variants))
    label(by_params, "seconds of steps", "gain (dB)", f"What may move: {shown}")
    for axes in (by_scene, by_params):
        if axes.lines:
            axes.legend(fontsize=6, frameon=False)
    save_figure(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--textures", nargs="+", default=["swirl", "dry_brush"])
    parser.add_argument("--params", nargs="+", choices=("colour", "free", "all"), default=["all"])
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=DEFAULT_STEPS)
    parser.add_argument("--views", type=int, default=SELF_VIEWS)
    parser.add_argument("--places", type=int, default=12)
    parser.add_argument("--json", type=Path, help="rows are added to those in it")
    parser.add_argument("--plot", type=Path, help="of all rows")
    args = parser.parse_args()
    print(describe() + "\n\n" + HEAD)
    rows = json.loads(args.json.read_text()) if args.json and args.json.exists() else []
    for name in args.scenes:
        rows += measure(name, args)
        if args.json:
            args.json.write_text(json.dumps(rows, indent=1) + "\n")
    if args.plot:
        plot(rows, args.plot)


if __name__ == "__main__":
    main()
