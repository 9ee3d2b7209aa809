"""The page of the curves: each scene's picture, command, advice and table, measured anew.

    python -m examples.benchmarks.curves [SCENE ...] [--page examples/measured/curves.md] [--repeats 5]
        [--quick] [--families strokes,...] [--strokes 125,...]

SCENE is a name of the table below; all of them without one. What stands between the two marks of a scene in
the page is replaced, and its picture, curves-SCENE.png beside the page; the text around them stays. Figures
of all scenes, as JSON, go to the folder that --json names.
"""

import argparse
import re
from pathlib import Path

from brushgs.cli.commands import bench
from brushgs.cli.configs import scene_source
from brushgs.cli.parser import parse
from brushgs.measure.bench import BenchReport, report_bench
from brushgs.measure.bench.figures import Bench
from brushgs.measure.bench.table import rows
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present

SCENES = {  # file and flags
    "koala": ("koala.ply", []),
    "chair": ("chair.splat", ["--up", "+z"]),
    "truck": ("truck.splat", []),
    "skull": ("skull.sog", []),
    "biker": ("biker.compressed.ply", []),
    "campsite": ("campsite_sog", []),
    "guitar": ("guitar.ksplat", []),
    "plant": ("plant.splat", []),
    "playbot": ("playbot_sog", []),
    "rubber_toy": ("rubber_toy_cloud.ply", ["--up", "+y"]),
    "sunflower": ("sunflower_tile.ply", ["--up", "+z"]),
    "spinach": ("moving/cook_spinach.splatv", ["--time", "0"]),
}
HEADING = (
    "strokes | ms a frame (quartiles) | ms a painting | RMSE of 255 | clustering | held out | PSNR | SSIM"
    " | FLIP | unpainted"
)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE")
    parser.add_argument("--page", type=Path, default=Path("examples/measured/curves.md"))
    parser.add_argument("--json", type=Path, help="folder for the figures of each scene")
    parser.add_argument("--repeats", type=int, help="as `brushgs bench` has it")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--families", help="as `brushgs bench` has it")
    parser.add_argument("--strokes", help="as `brushgs bench` has it")
    asked = parser.parse_args()
    print(describe(), flush=True)
    for name in present(asked.scenes or SCENES, {name: file for name, (file, _) in SCENES.items()}):
        file, flags = SCENES[name]
        flags = [*flags, *(["--quick"] if asked.quick else [])]
        flags += ["--repeats", str(asked.repeats)] if asked.repeats else []
        for option in ("families", "strokes"):
            flags += [f"--{option}", getattr(asked, option)] if getattr(asked, option) else []
        words = ["bench", str(FOLDER / file), *flags]
        paint, config = bench.configs(parse(words))
        picture = asked.page.with_name(f"curves-{name}.png")
        scene = scene_source(parse(words))
        report = report_bench(scene, picture, paint, config, report=BenchReport())
        if asked.json:
            (asked.json / f"{name}.json").write_text(report.as_json() + "\n")
        shown = " ".join([Path(file).name, *flags])
        block = block_of(report.result, f"brushgs bench {shown}", picture.name)
        asked.page.write_text(placed(asked.page.read_text(), name, block))
        print(f"{name}: {report.result.advice}", flush=True)


def block_of(result: Bench, command: str, picture: str) -> str:
    """Command, picture, advice and the table of the strokes, as Markdown."""
    strokes = result["strokes"]
    cells = [" | ".join(cell.replace("*", "\\*").strip() for cell in row) for row in rows(strokes)]
    lines = [HEADING, "|".join("-" for _ in HEADING.split("|")), *cells]
    best = [
        f"- {family.title}: {'; '.join(point.label for point in family.front(family.kinds[0]))}."
        for family in result.families
        if family.name != "strokes"
    ]
    said = [f"{doubt[0].upper()}{doubt[1:]}." for doubt in result.doubts]
    parts = [f"`{command}`: {result.advice}.", f"![]({picture})", "\n".join(lines), *said]
    return "\n\n".join([*parts, "\n".join(["Best of the others:", *best])] if best else parts)


def placed(page: str, name: str, block: str) -> str:
    """The page with the block of a scene between its marks.

    Raises:
        ValueError: if the page has no such marks.
    """
    start, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    pattern = re.compile(re.escape(start) + ".*?" + re.escape(end), re.DOTALL)
    if not pattern.search(page):
        raise ValueError(f"curves: the page must hold {start} and {end}, got neither or one")
    return pattern.sub(lambda _: f"{start}\n{block}\n{end}", page)


if __name__ == "__main__":
    main()
