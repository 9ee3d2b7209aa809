"""What stands around an object: how quiet it is, whether the outline reads, what it costs, how much it stirs.

    python -m tests.bench.stage [FILE:UP ...]

Oil, before loose strokes and on a stage, in turns. Quiet: fine contrast (|L - L blurred by 3 px of 512|,
CIELAB) around the subject over that within, 960 x 540. Seconds: of making what stands around, and of painting
a frame of all coats; medians of 5 rounds. Stir: rms of the second difference of frames, of 255, over an orbit
of 60 frames at 480 x 270.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from scipy.ndimage import gaussian_filter, zoom

import brushgs as bg
from brushgs import cli
from brushgs.formats.pictures.images import read_image
from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.passes.color.color_space import Space
from brushgs.pipeline.prepare import Prepared, prepare
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.still import paint_view
from tests.bench.machine import describe
from tests.bench.strokes import markdown
from tests.scenes import SCENES_FOLDER

OBJECTS = ("koala.ply:-y", "skull.sog:-y", "guitar.ksplat:-y", "plant.splat:-y", "chair.splat:+z")
KINDS = {"loose": False, "stage": True}  # value of --backdrop -> field of the ground
ROUNDS = 5


def config_of(up: str, *, is_stage: bool) -> PaintConfig:
    oil = Look.open("oil").config
    return replace(oil, view=ViewConfig(size=(960, 540), up=up), ground=replace(oil.ground, stage=is_stage))


def prepared_of(path: Path, config: PaintConfig) -> tuple[Prepared, Report]:
    report = Report()
    return prepare(SceneSource.of(path), config, report), report


def backdrop(report: Report) -> Stage:
    return next(stage for stage in report.stages if stage.name == "backdrop")


def quiet(prepared: Prepared) -> float:
    """Fine contrast around the subject over that within."""
    rgb = paint_view(prepared, Report(), depth=False).rgb
    light = 100 * Space("lab").to(np.clip(rgb, 0, 1).reshape(-1, 3))[:, 0].reshape(rgb.shape[:2])
    subject = bg.render(prepared.strokes, prepared.camera, "gaussian").alpha
    light, subject = (zoom(plane, 512 / min(plane.shape), order=1) for plane in (light, subject))
    fine = np.abs(light - gaussian_filter(light, 3))
    return float(fine[gaussian_filter(subject, 6) < 0.02].mean() / fine[subject > 0.95].mean())


def seconds_of_frame(prepared: Prepared) -> float:
    start = time.perf_counter()
    prepared.painting.frame(prepared.camera)
    return time.perf_counter() - start


def stir(path: Path, up: str, kind: str) -> float:
    with tempfile.TemporaryDirectory() as folder:
        output = str(Path(folder) / "%05d.png")
        words = [
            "--up",
            up,
            "--orbit",
            "60",
            "--size",
            "480x270",
            "--backdrop",
            kind,
            "-o",
            output,
            "--quiet",
        ]
        assert cli.main(["render", str(path), *words]) == 0
        frames = np.stack([255 * read_image(file) for file in sorted(Path(folder).glob("*.png"))])
    second = frames[2:] - 2 * frames[1:-1] + frames[:-2]
    return float(np.sqrt((second.astype(np.float64) ** 2).mean()))


def row_of(path: Path, up: str) -> list[str]:
    configs = {kind: config_of(up, is_stage=is_stage) for kind, is_stage in KINDS.items()}
    runs = [{kind: prepared_of(path, config) for kind, config in configs.items()} for _ in range(ROUNDS)]
    last = {kind: prepared for kind, (prepared, _) in runs[-1].items()}
    made = [median(backdrop(run[kind][1]).seconds for run in runs) for kind in KINDS]
    frames = [{kind: seconds_of_frame(last[kind]) for kind in KINDS} for _ in range(ROUNDS)]
    frame = [1000 * median(one[kind] for one in frames) for kind in KINDS]
    reads = backdrop(runs[-1]["stage"][1]).counts["reads"]
    stirred = [stir(path, up, kind) for kind in KINDS]
    pairs = ([quiet(last[kind]) for kind in KINDS], made, frame, stirred)
    forms = ("{:.2f}, {:.2f}", "{:.2f}, {:.2f}", "{:.0f}, {:.0f}", "{:.1f}, {:.1f}")
    return [path.name, f"{reads:.0%}", *(form.format(*pair) for form, pair in zip(forms, pairs, strict=True))]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=OBJECTS, metavar="FILE:UP")
    print(describe(), flush=True)
    table = [["scene", "reads", "quiet", "made, s", "a frame, ms", "stir"]]
    for scene in parser.parse_args().scenes:
        name, up = scene.rsplit(":", 1)
        table.append(row_of(SCENES_FOLDER / name, up))
        print(markdown(table[-2:]), flush=True)
    print("Each pair: before loose strokes, on a stage.\n", markdown(table), sep="\n")


if __name__ == "__main__":
    main()
