"""The temporal report with one more column: a painterly filter on each plain picture alone.

    python -m examples.benchmarks.stability [--scenes koala chair truck skull] [--texture dry_brush]
                                    [--strokes 2000] [--orbit 240] [--size 640x360] [--json FOLDER]

The configurations and figures are those of `brushgs stability`, see `brushgs.measure.stability`. The column
`image` is the baseline `examples.benchmarks.painterly`: as many strokes of the same brush, equal seeds in all
frames. With --json the figures of each scene are written to FOLDER/SCENE.json.
"""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from brushgs.measure.stability import report_stability
from brushgs.measure.stability.table import stability_table
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from examples.benchmarks.machine import describe
from examples.benchmarks.painterly import painterly_painters
from examples.benchmarks.scenes import FOLDER, present

SCENES = {
    "koala": ("koala.ply", (0, -1, 0)),
    "chair": ("chair.splat", (0, 0, 1)),
    "truck": ("truck.splat", (0, -1, 0)),
    "skull": ("skull.sog", (0, -1, 0)),
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=[*SCENES], choices=[*SCENES])
    parser.add_argument("--texture", default="dry_brush")
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--orbit", type=int, default=240, help="frames of a turn")
    parser.add_argument("--size", default="640x360", help="WIDTHxHEIGHT")
    parser.add_argument("--json", type=Path, help="write the figures to this folder, too")
    options = parser.parse_args()
    print(describe(), flush=True)
    width, height = (int(side) for side in options.size.lower().split("x"))
    if options.json:
        options.json.mkdir(parents=True, exist_ok=True)
    for name in present(options.scenes, {name: file for name, (file, _) in SCENES.items()}):
        path, up = SCENES[name]
        paint = PaintConfig(
            cluster=ClusterConfig(options.strokes),
            draw=DrawConfig(stroke=options.texture),
            view=ViewConfig(size=(width, height), up=up),
        )
        with TemporaryDirectory() as folder:
            report = report_stability(
                FOLDER / path,
                (options.json or Path(folder)) / f"{name}.json",
                paint,
                PathConfig(orbit=options.orbit),
                make_extra_painters=painterly_painters,
            )
        print(name)
        Console(highlight=False, width=120).print(stability_table(report.result), markup=False)


if __name__ == "__main__":
    main()
