"""The count that `--strokes auto` chooses beside the knee of the full curve, and what either takes.

    python -m examples.benchmarks.stroke_count [SCENE ...] [--stroke swirl] [--cpu] [--repeat 9]
                                              [--aims] [--cost] [--still] [--plot FILE] [--json FILE]

SCENE is a name of the table below. The view is the one that `brushgs render` frames, 1280 x 720, on white.

The full curve has nine counts from 125 to 32,000, clustered each, and the end of the scene, a stroke for
every Gaussian kept (`curve` says why it must end there): error of a painted frame to the plain
picture, seconds of a frame (least of the repeats, counts in turns; with --cpu of the processor, which other
work on the machine disturbs less). "to 32k" is the knee of the same curve without that end. "auto" is
`choose_strokes`; its seconds contain the plain picture. Beside it stands what it must be quicker than: one
clustering to that count and ten frames of it, in turns, medians. "expected" and "found" are dB at that count.

--still: the same for a still, whose seconds are those of a whole painting and whose error is that of
clustering alone: clusters of 125 to 16,000 and one stroke per Gaussian, as `brushgs render` makes them in the
plain look, counts in turns, medians of the clock. "auto" has the constants of a painting in `view_model`
fitted without that scene. "search" is what choosing the count takes.
--aims: budgets and sizes asked for, what came of them, and in how many clusterings, in place of the rest.
--cost: measures frames of all scenes at two sizes, fits the constants of `view_model` to them by least
squares of the relative error, once with all and once without each scene, and tells what auto would choose
then: the constants know no scene that they are tried on.
"""

import argparse
import json
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import frame_scene, up_vector
from brushgs.errors import SceneWarning
from brushgs.measure.bench.subject import ASKS
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.stroke_target import ErrorBudget, StrokeSize
from brushgs.pipeline.count import open_view_model
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import cluster_scene
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.stroke_count import view_model as sight_module
from brushgs.stroke_count.choose import choose_for_view_model, knee_by_cells
from brushgs.stroke_count.curve import ErrorCurve, fitted_rmse, fitted_seconds, knee, psnr_of, worth
from brushgs.stroke_count.view_model import ViewModel
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present

SCENES = {
    "koala": ("koala.ply", "-y"),
    "chair": ("chair.splat", "+z"),
    "truck": ("truck.splat", "-y"),
    "skull_sh3": ("skull.sog", "-y"),
    "biker": ("biker.compressed.ply", "-y"),
    "campsite": ("campsite_sog", "-y"),
}
OTHERS = {
    "rubber_toy": ("rubber_toy_cloud.ply", "+y"),
    "playbot": ("playbot_sog", "-y"),
    "sunflower": ("sunflower_tile.ply", "+z"),
    "guitar": ("guitar.ksplat", "-y"),
    "plant": ("plant.splat", "-y"),
    "spinach": ("moving/cook_spinach.splatv", "-y"),  # its first moment
}
FILES = {name: file for name, (file, _) in (SCENES | OTHERS).items()}
COUNTS = tuple(125 * 2**step for step in range(9))
SIZES = ((1280, 720), (640, 360))  # of --cost
DRAW = DrawConfig()


def loaded(path: Path) -> bg.Gaussians:
    return bg.load_moving(path).at(0.0) if path.suffix == ".splatv" else bg.load(path)


class Scene:
    """A scene, pruned, and a view of it."""

    def __init__(self, name: str, stroke: str = "swirl", size: tuple[int, int] = SIZES[0]) -> None:
        file, up = (SCENES | OTHERS)[name]
        self.name, self.texture = name, bg.StrokeTexture.open(stroke)
        self.loaded = loaded(FOLDER / file)
        self.kept = bg.prune(self.loaded)
        self.camera = frame_scene(self.loaded, width=size[0], height=size[1], up=up_vector(up))

    def view_model(self) -> ViewModel:
        """With a plain picture painted now."""
        options = RenderOptions.of(self.texture, num_threads=DRAW.threads)
        return open_view_model(self.loaded, self.camera, self.texture, options, None, Report())

    def clustered(self, count: int) -> bg.Gaussians:
        return bg.cluster(self.kept, count) if count < len(self.kept) else self.kept

    def frame(self, strokes: bg.Gaussians) -> bg.Frame:
        return bg.render(strokes, self.camera, self.texture, depth=False)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", metavar="SCENE", choices=[[], *SCENES, *OTHERS])
    parser.add_argument("--stroke", default="swirl")
    parser.add_argument("--cpu", action="store_true", help="seconds of the processor, not of the clock")
    parser.add_argument("--repeat", type=int, default=9)
    parser.add_argument("--aims", action="store_true")
    parser.add_argument("--cost", action="store_true")
    parser.add_argument("--still", action="store_true")
    parser.add_argument("--plot", type=Path, help="draw the curves, their knees and the choices to this file")
    parser.add_argument("--json", type=Path, help="write the figures to this file, too")
    options = parser.parse_args()
    clock = time.process_time if options.cpu else time.perf_counter
    names = present(options.scenes or SCENES, FILES)
    print(describe(), flush=True)
    if options.still:
        figures = stills(present(options.scenes or [*SCENES, *OTHERS], FILES), options.repeat)
    elif options.cost:
        figures = costs(present(options.scenes or [*SCENES, *OTHERS], FILES), options.repeat)
    else:
        each = aims if options.aims else compare
        print(AIMS_HEADING if options.aims else HEADING, flush=True)
        figures = [each(Scene(name, options.stroke), clock, options.repeat) for name in names]
    if options.plot:
        plot(figures, options.plot)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


HEADING = (
    "| scene | kept | knee | to 32k | auto | auto / knee | expected, found dB | auto s "
    "| one clustering, ten frames s | share |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)


def compare(scene: Scene, clock: Callable[[], float], repeat: int) -> dict[str, object]:
    counts = [count for count in COUNTS if count < len(scene.kept)]
    sets = [scene.clustered(count) for count in counts] + [scene.kept]
    judge = scene.view_model()
    errors = [judge.rmse(judge.boxes(strokes)) for strokes in sets]
    seconds = [np.inf] * len(sets)
    for _ in range(repeat + 1):
        for i, strokes in enumerate(sets):
            seconds[i] = min(seconds[i], timed(lambda s=strokes: scene.frame(s), clock)[0])
    lengths = [len(strokes) for strokes in sets]
    full, cut = (knee(ErrorCurve(lengths[:end], errors[:end], seconds[:end])) for end in (None, len(counts)))
    del sets
    looks, yards = [], []
    for _ in range(5):
        took, choice = timed(
            lambda: choose_for_view_model(scene.kept, scene.view_model(), cost="frame"), clock
        )
        looks.append(took)
        count = choice.strokes
        took, strokes = timed(lambda n=count: scene.clustered(n), clock)
        yards.append(took + sum(timed(lambda s=strokes: scene.frame(s), clock)[0] for _ in range(10)))
    found = psnr_of(judge.rmse(judge.boxes(strokes)))
    look_s, yard_s = statistics.median(looks), statistics.median(yards)
    print(
        f"| {scene.name} | {len(scene.kept):,} | {full.strokes:,} | {cut.strokes:,} | {choice.strokes:,} "
        f"| {choice.strokes / full.strokes:.2f} | {choice.psnr:.1f}, {found:.1f} "
        f"| {look_s:.2f} | {yard_s:.2f} | {look_s / yard_s:.2f} |",
        flush=True,
    )
    return {
        "scene": scene.name,
        "strokes": lengths,
        "rmse": errors,
        "seconds": seconds,
        "knee": full.strokes,
        "knee_to_32000": cut.strokes,
        "auto": choice.strokes,
        "psnr_expected": choice.psnr,
        "psnr_found": found,
        "auto_seconds": looks,
        "cluster_and_ten_frames_seconds": yards,
    }


def plot(figures: list[dict[str, object]], path: Path) -> None:
    """Error over the milliseconds of a frame: a dot a count, the knee a ring, the choice a cross."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    _, axes = pyplot.subplots(2, 3, figsize=(8.4, 4.6), constrained_layout=True)
    for axis, row in zip(axes.flat, figures, strict=False):
        curve = ErrorCurve(row["strokes"], row["rmse"], row["seconds"])
        line = np.geomspace(curve.strokes[0], curve.strokes[-1], 200)
        axis.plot(1e3 * fitted_seconds(curve, line), fitted_rmse(curve, line), lw=1, color="0.6")
        axis.plot(1e3 * curve.seconds, curve.rmse, ".", color="0.3", ms=4)
        for count, marker, size in ((row["knee"], "o", 9), (row["auto"], "x", 7)):
            at = np.array([count])
            place = 1e3 * fitted_seconds(curve, at), fitted_rmse(curve, at)
            axis.plot(*place, marker, color="C3", ms=size, mfc="none", label=f"{count:,}")
        axis.set_title(str(row["scene"]), fontsize=9)
        axis.tick_params(labelsize=7)
        axis.legend(fontsize=7, frameon=False)
    pyplot.setp(axes[-1], xlabel="ms a frame")
    pyplot.setp(axes[:, 0], ylabel="RMSE to the plain picture")
    pyplot.savefig(path, dpi=80)


AIMS_HEADING = "| scene | asked | strokes | reached | clusterings | seconds |\n|---|---|---|---|---|---|"


def aims(scene: Scene, clock: Callable[[], float], repeat: int) -> dict[str, object]:
    """Budgets between what 1,000 strokes and what all reach, and sizes between those that both have."""
    plain = scene.view_model()
    ends = [plain.boxes(strokes) for strokes in (scene.clustered(500), scene.kept)]
    (low, high), (large, small) = (
        [psnr_of(plain.rmse(boxes)) for boxes in ends],
        [plain.size(boxes) for boxes in ends],
    )
    rows = []
    asked = [ErrorBudget(round(low + share * (high - low), 1)) for share in (0.25, 0.6)]
    asked += [StrokeSize(round(float(large ** (1 - share) * small**share), 1)) for share in (0.2, 0.5, 0.8)]
    for target in asked:
        config, report = ClusterConfig(target), Report()
        with warnings.catch_warnings():
            warnings.simplefilter("error", SceneWarning)
            took, strokes = timed(
                lambda c=config, r=report: cluster_scene(
                    scene.kept, c, r, num_loaded=len(scene.loaded), view_model=plain
                ),
                clock,
            )
        boxes = plain.boxes(strokes)
        is_size = isinstance(target, StrokeSize)
        reached = f"{plain.size(boxes):.1f}px" if is_size else f"{psnr_of(plain.rmse(boxes)):.1f}dB"
        tries = report.stages[-1].counts["tries"]
        print(
            f"| {scene.name} | {target} | {len(strokes):,} | {reached} | {tries} | {took:.2f} |", flush=True
        )
        rows.append({"asked": str(target), "strokes": len(strokes), "reached": reached, "tries": tries})
    return {"scene": scene.name, "aims": rows}


def costs(names: list[str], repeat: int) -> dict[str, object]:
    """Constants of the model, and how far the choice depends on the scenes they were fitted to."""
    rows = [row for name in names for row in cost_rows(name, repeat)]
    figures: dict[str, object] = {"rows": rows}
    for skipped in [None, *SCENES]:
        used = [row for row in rows if row["scene"] != skipped]
        pixel, stroke, image, kernel = fit(used)
        shape = shape_error(used, (pixel, stroke, image, kernel))
        said = f"pixel {pixel:.2f}, stroke {stroke:.0f}, paint {image:.2f} and {kernel:.2f} ns"
        said += f", shape {shape:.3f}"
        if skipped in names:
            scene = Scene(skipped)
            before = choose_for_view_model(scene.kept, scene.view_model(), cost="frame").strokes
            kept = sight_module.PIXEL, sight_module.STROKE, dict(sight_module.PAINT)
            sight_module.PIXEL, sight_module.STROKE = pixel, stroke
            sight_module.PAINT |= {"image": image, "gaussian": kernel, "ellipse": kernel}
            after = choose_for_view_model(scene.kept, scene.view_model(), cost="frame").strokes
            sight_module.PIXEL, sight_module.STROKE = kept[:2]
            sight_module.PAINT |= kept[2]
            said += f"; auto {before:,} -> {after:,}"
        print(f"without {skipped}: {said}" if skipped else f"all: {said}", flush=True)
        figures[skipped or "all"] = said
    return figures


STILL_HEADING = (
    "| scene | kept | knee | worth | auto | auto / knee | all Gaussians s | auto s | search s |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Still:
    """Seconds and errors of counts of strokes of a scene, measured, and sampled by `choose_strokes`."""

    name: str
    kept: int
    strokes: list[int]
    clustering: list[float]  # RMSE
    cluster: list[float]  # seconds, as the next
    passes: list[float]
    frame: list[float]
    sampled: list[tuple[int, float, float]]  # count, RMSE, modelled seconds of a frame
    search: float

    @property
    def curve(self) -> ErrorCurve:
        seconds = np.sum([self.cluster, self.passes, self.frame], axis=0)
        rows = np.unique(self.strokes, return_index=True)[1]
        return ErrorCurve(
            *(np.array(column)[rows] for column in (self.strokes, self.clustering, seconds)), True
        )

    @classmethod
    def measured(cls, name: str, repeat: int) -> "Still":
        file, up = (SCENES | OTHERS)[name]
        paint = PaintConfig(view=ViewConfig(up=up), cluster=ClusterConfig(1))
        prepared = prepare(loaded(FOLDER / file), paint, Report(), asks=ASKS)
        maker, camera, kept = prepared.stroke_maker, prepared.camera, prepared.pruned
        options = replace(prepared.options, depth=False)
        judge = open_view_model(
            prepared.whole_scene, camera, prepared.texture, options, None, Report()
        ).of_kernel
        counts = [count for count in COUNTS[:8] if count < len(kept)] + [len(kept)]
        took: dict[int, list[list[float]]] = {count: [[], [], []] for count in counts}
        numbers, errors, searches = [], [], []
        for turn in range(repeat):
            begun = time.perf_counter()
            model = open_view_model(prepared.whole_scene, camera, prepared.texture, options, None, Report())
            choice = choose_for_view_model(kept, model, cost="frame")
            searches.append(time.perf_counter() - begun)
            for count in counts:
                seconds, (clusters, _) = timed(lambda n=count: maker.clusters(n), time.perf_counter)
                passed, strokes = timed(lambda s=clusters: maker.finished(s), time.perf_counter)
                drawn, _ = timed(
                    lambda s=strokes: render_with(s, camera, prepared.texture, options), time.perf_counter
                )
                for column, value in zip(took[count], (seconds, passed, drawn), strict=True):
                    column.append(value)
                if turn == 0:
                    numbers.append(len(strokes))
                    errors.append(judge.rmse(judge.boxes(clusters)))
        medians = np.median([took[count] for count in counts], axis=2).T.tolist()
        sampled = []
        for count, seconds in zip(choice.curve.strokes, choice.curve.seconds, strict=True):
            sampled.append((int(count), 0.0, float(seconds)))
        still = choose_for_view_model(kept, model, cost="painting")
        if len(still.curve.strokes) == len(sampled):
            sampled = [(n, float(e), s) for (n, _, s), e in zip(sampled, still.curve.rmse, strict=True)]
        else:  # too few to search
            sampled = []
        return cls(name, len(kept), numbers, errors, *medians, sampled, float(np.median(searches)))


def constants_of(stills: list[Still]) -> dict[str, float]:
    """The constants of a painting in `view_model`, nanoseconds: least squares of relative errors."""

    def fit(values: list[float], *columns: list[float]) -> list[float]:
        terms = np.stack([np.ones(len(values)), *map(np.array, columns)], axis=1) / np.array(values)[:, None]
        return list(1e9 * np.linalg.lstsq(terms, np.ones(len(values)), rcond=None)[0])

    rows = [(s.cluster[i], s.kept, s.strokes[i]) for s in stills for i in range(len(s.strokes) - 1)]
    passes = [(took, count) for s in stills for took, count in zip(s.passes, s.strokes, strict=True)]
    start, cluster, cut = fit(*map(list, zip(*rows, strict=True)))
    _, make = fit(*map(list, zip(*passes, strict=True)))
    look, search = fit([s.search for s in stills], [s.kept for s in stills])
    return {"START": start, "CLUSTER": cluster, "CUT": cut, "MAKE": make, "LOOK": look, "SEARCH": search}


def chosen_with(still: Still, constants: dict[str, float]) -> int:
    """The count that `choose_for_view_model` takes for a still with such constants."""
    kept = {name: getattr(sight_module, name) for name in constants}
    try:
        for name, value in constants.items():
            setattr(sight_module, name, value)
        if not still.sampled or not sight_module.saves_by_merging(still.kept):
            return still.kept
        counts, errors, frames = zip(*still.sampled, strict=True)
        making = [sight_module.seconds_to_make(count, still.kept) for count in counts]
        return knee_by_cells(ErrorCurve(counts, errors, np.add(frames, making), ends_unmerged=True)).strokes
    finally:
        for name, value in kept.items():
            setattr(sight_module, name, value)


def stills(names: list[str], repeat: int) -> list[dict[str, object]]:
    """Measure all scenes, then choose for each with constants that are fitted to the others."""
    measured = []
    for name in names:
        measured.append(Still.measured(name, repeat))
        print(f"measured {name}", file=sys.stderr, flush=True)
    print("all: " + ", ".join(f"{name} {value:.3g}" for name, value in constants_of(measured).items()))
    print(STILL_HEADING, flush=True)
    figures = []
    for still in measured:
        others = [other for other in measured if other is not still] or measured
        true, auto = knee(still.curve).strokes, chosen_with(still, constants_of(others))
        every = float(still.curve.seconds[-1])
        took = every if auto == still.kept else float(fitted_seconds(still.curve.merged, np.array([auto]))[0])
        print(
            f"| {still.name} | {still.kept:,} | {true:,} | {worth(still.curve):.2f} | {auto:,} "
            f"| {auto / true:.2f} | {every:.2f} | {took:.2f} | {still.search:.2f} |",
            flush=True,
        )
        figures.append(vars(still) | {"scene": still.name, "knee": true, "auto": auto})
    return figures


def cost_rows(name: str, repeat: int) -> list[dict[str, object]]:
    """What frames of a scene consist of, and their nanoseconds of one core."""
    scene = Scene(name)
    sets = [scene.clustered(count) for count in COUNTS[::2] if count < len(scene.kept)] + [scene.kept]
    rows: list[dict[str, object]] = []
    for size in SIZES:
        for stroke in ("swirl", "gaussian"):
            view = Scene(name, stroke, size)
            nanoseconds = [np.inf] * len(sets)
            for _ in range(repeat + 1):
                for i, strokes in enumerate(sets):
                    took, _ = timed(lambda v=view, s=strokes: v.frame(s), time.process_time)
                    nanoseconds[i] = min(nanoseconds[i], 1e9 * took)
            view_model = view.view_model()
            for strokes, took in zip(sets, nanoseconds, strict=True):
                painted = float(seen_areas(view_model.boxes(strokes), *size).sum())
                parts = [size[0] * size[1], len(strokes), painted]
                curve = f"{name} {size[0]} {stroke}"
                is_image = stroke == "swirl"
                rows.append({"scene": name, "curve": curve, "is_image": is_image, "parts": parts, "ns": took})
    return rows


def parts_of(row: dict[str, object]) -> list[float]:
    pixels, strokes, painted = row["parts"]
    return [pixels, strokes, painted * row["is_image"], painted * (not row["is_image"])]


def fit(rows: list[dict[str, object]]) -> list[float]:
    from scipy.optimize import nnls

    seconds = np.array([row["ns"] for row in rows])
    relative = np.array([parts_of(row) for row in rows]) / seconds[:, None]
    lengths = np.linalg.norm(relative, axis=0)
    return list(nnls(relative / lengths, np.ones(len(rows)))[0] / lengths)


def shape_error(rows: list[dict[str, object]], constants: tuple[float, ...]) -> float:
    """Standard deviation of the logarithm, each curve scaled to fit."""
    curves: dict[object, list[float]] = {}
    for row in rows:
        curves.setdefault(row["curve"], []).append(np.log(np.dot(parts_of(row), constants) / row["ns"]))
    return float(np.sqrt(np.mean(np.concatenate([np.square(v - np.mean(v)) for v in curves.values()]))))


def timed(work: Callable[[], object], clock: Callable[[], float]) -> tuple[float, object]:
    begun = clock()
    result = work()
    return clock() - begun, result


if __name__ == "__main__":
    main()
