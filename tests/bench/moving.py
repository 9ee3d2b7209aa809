"""How still paintings of scenes that move hold: the report of `brushgs stability`, and what it compares with.

    python -m tests.bench.moving [SCENE ...] [--stroke dry_brush flat] [--strokes 2000] [--size 640x360]
                                 [--start TIME] [--end TIME] [--orbit N] [--pairs 40] [--json FOLDER]

Scenes are the still life in motion ("still life", 4 s, its camera stands still), the same with rows that do
not correspond ("loose still life", followed anew in each moment, measured against the flow of the first), and
a trained one of a cook ("cook"; macaburguera/splaTV). 30 frames a second. With --orbit the camera moves too,
one turn in so many frames. The columns are those of the report, and:
- alone: strokes made of each moment alone, by the same options, each frame painted as a still;
- image: the baseline `tests.baseline.painterly`, as many strokes of the same brush on each plain picture,
  equal seeds in all frames.
The last line of each table is the excess at gap 1 over that of `alone`. The summary at the end is the
table of examples/measured/moving.md; with --show it is made of the files that --json wrote, and nothing is
measured.
"""

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from brushgs.formats.moving import load_moving
from brushgs.measure.stability import Stability, report_stability
from brushgs.measure.stability.table import row_groups
from brushgs.options.clip import ClipConfig
from brushgs.options.experiments import StabilityConfig
from brushgs.options.moment import Moment
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.clip import Clip
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from brushgs.values.moving import MovingScene
from tests.baseline.painterly import painterly_painters
from tests.bench.machine import describe
from tests.bench.strokes import markdown
from tests.scenes import SCENES_FOLDER

COOK = SCENES_FOLDER / "moving" / "cook_spinach.splatv"
SCENES = "still life", "loose still life", "cook"


def open_scene(name: str) -> tuple[MovingScene, MovingScene | None]:
    """A scene, and where its rows do not correspond one whose rows do."""
    if name == "cook":
        return load_moving(COOK), None
    if name == "loose still life":
        return still_life_moving(has_rows=False), still_life_moving()
    return still_life_moving(), None


def write_camera(name: str, path: Path) -> Path:
    """A camera file with the view of a scene: that which it is composed for, or that in its own file."""
    if name == "cook":
        with COOK.open("rb") as file:
            length = int.from_bytes(file.read(8)[4:], "little")
            view = json.loads(file.read(length))[0]["cameras"][0]
    else:
        camera = still_life_camera()
        view = {
            "id": 0,
            "img_name": "0",
            "width": camera.width,
            "height": camera.height,
            "position": camera.position.tolist(),
            "rotation": camera.viewmat[:3, :3].T.tolist(),
            "fx": camera.K[0, 0],
            "fy": camera.K[1, 1],
        }
    path.write_text(json.dumps([view]), encoding="utf-8")
    return path


def table_of(result: Stability) -> list[list[str]]:
    """The figures of the report that tell something of all scenes."""
    table = [["", *(figures.name for figures in result.configurations)]]
    for group in row_groups(result)[:4]:
        for label, cell in group:
            table.append([label.strip(), *(cell(figures) for figures in result.configurations)])
    alone = next((f for f in result.configurations if f.name == "alone"), None)
    if alone is not None:
        shares = [f.warps[0].excess / alone.warps[0].excess for f in result.configurations]
        table.append(["excess at gap 1, over that of alone", *(f"{share:.3f}" for share in shares)])
    return table


PAINTINGS = {"track": "ours", "off": "unlocked", "alone": "alone", "image": "2D"}  # of the summary


def summary(reports: dict[str, dict[str, Any]]) -> list[list[str]]:
    """A row for each painting of each report: what `as_dict` of its figures gives, by SCENE-STROKE."""
    head = "scene, stroke | painting | flips / spins | excess at gap 1 | 7 | 10 | marks not along | "
    head += "slip, px a step | births a second | pops a second | drift of sizes | of directions | SSIM | UIQM"
    table = [head.split(" | ")]
    for name, report in reports.items():
        for figures in report["configurations"]:
            if figures["name"] not in PAINTINGS:
                continue
            events, animation = figures["events"], figures["animation"]
            table.append(
                [
                    name.replace("_", " ").replace("-", ", ", 1),
                    PAINTINGS[figures["name"]],
                    "-" if events is None else f"{events['flips']:,} / {events['spins']:,}",
                    *(f"{255 * warp['excess']:.2f}" for warp in figures["warps"]),
                    f"{figures['warps'][0]['redrawn']:.0%}",
                    f"{animation['slip_pixels']:.2f}",
                    *(f"{animation[kind]:.1%}" for kind in ("births", "pops")),
                    f"{animation['size_drift']:.3f}",
                    f"{animation['direction_drift_deg']:.1f}°",
                    *(f"{figures[kind]:.2f}" for kind in ("ssim", "uiqm")),
                ]
            )
    return table


def show(folder: Path) -> None:
    """Print the summary of the reports in a folder."""
    files = sorted(folder.glob("*.json"))
    print(markdown(summary({file.stem: json.loads(file.read_text())["stability"] for file in files})))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--stroke", nargs="+", default=["dry_brush", "flat"])
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--size", default="640x360", help="WIDTHxHEIGHT")
    parser.add_argument("--orbit", type=int, help="frames of a turn of the camera")
    parser.add_argument("--start", type=Moment.parse, help="seconds, or a share such as 20%%")
    parser.add_argument("--end", type=Moment.parse)
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--json", type=Path, help="write the figures to this folder, too")
    parser.add_argument("--show", type=Path, metavar="FOLDER", help="print the summary of these files alone")
    options = parser.parse_args()
    if options.show:
        show(options.show)
        return
    print(describe(), flush=True)
    width, height = (int(side) for side in options.size.lower().split("x"))
    path = None if options.orbit is None else PathConfig(orbit=options.orbit, fps=30)
    if options.json:
        options.json.mkdir(parents=True, exist_ok=True)
    reports = {}
    for name in options.scenes:
        scene, truth = open_scene(name)
        for stroke in options.stroke:
            with TemporaryDirectory() as folder:
                view = ViewConfig(size=(width, height), up=(0, -1, 0))
                if path is None:
                    view = ViewConfig(
                        size=(width, height), camera_file=write_camera(name, Path(folder) / "view.json")
                    )
                report = report_stability(
                    Clip(scene, ClipConfig(options.start, options.end)),
                    (options.json or Path(folder)) / f"{name.replace(' ', '_')}-{stroke}.json",
                    PaintConfig(
                        cluster=ClusterConfig(options.strokes), draw=DrawConfig(stroke=stroke), view=view
                    ),
                    path,
                    StabilityConfig(pairs=options.pairs, skip_alone=truth is not None),
                    make_extra_painters=painterly_painters,
                    truth=truth,
                )
            reports[f"{name}-{stroke}"] = report.result.as_dict()
            print(f"\n## {name}, {stroke}\n")
            print(markdown(table_of(report.result)), flush=True)
            for stage in report.stages:
                if stage.name in ("follow", "measure"):
                    print(f"{stage.name}: {stage.did}, {stage.seconds:.1f} s", flush=True)
    print()
    print(markdown(summary(reports)))


if __name__ == "__main__":
    main()
