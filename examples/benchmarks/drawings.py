"""How far watercolour, ink and charcoal are drawings: their masses, blacks, marks, paper and lost outlines.

    python -m examples.benchmarks.drawings [SCENE ...] [--looks LOOK ...] [--pictures FOLDER] [--page FILE]

Pictures are those that `brushgs render SCENE --look LOOK --size 960x540` makes. L* is of CIELAB; the subject
is what the plain picture covers by half. Squinting is a blur by 3.5 % of the shorter side.
- charcoal: correlation of squinted L* of the drawing and of the plain picture over the subject, and over that
  part of it which is painted; and the squinted range of the drawing from its 5th to its 95th percentile.
- ink: median L* of the plain picture, share of what is drawn that is solid black, regions of black, median
  length of the hatching that is drawn, in px, share of the middle tones within 6 px of hatching (middle is
  the fifth of the subject around that median), and share of the ink in flecks of less than 40 px^2.
- watercolour: share of the picture that is within 2.5 (CIELAB) of its paper, the darkest 2 % in L*, and the
  lost share of the outline: within 6 across 4 px to both sides.
- watercolour, with --frames: median milliseconds of a frame, 1280 x 720, beside oil with 6000 strokes; 30
  rounds in turns, median and quartiles of the ratio.
- ink, hatching, stippling: PSNR in dB of the SVG, drawn by CairoSVG, to the picture, and its size.
The page also gets a table of the aims, by all its tables; `--looks` without any makes this one alone.
"""

import argparse
import io
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import ndimage

import brushgs as bg
from brushgs.cli.configs import paint_config, scene_source
from brushgs.cli.parser import parse
from brushgs.measure.likeness import psnr
from brushgs.passes.color.squint import Squint, lab_of, squinted
from brushgs.pipeline.drawing import write_picture
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_view
from brushgs.rendering.render import render
from brushgs.rendering.wanted import Wanted
from brushgs.values.arrays import F64, Array, Mask
from examples.benchmarks.curves import SCENES as FILES_AND_FLAGS
from examples.benchmarks.curves import placed
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present
from examples.benchmarks.strokes import SCENES, markdown

SIZE = "960x540"
TUNED = "skull", "truck", "spinach", "koala", "campsite", "plant", "guitar"
FILES: dict[str, tuple[str | None, list[str]]] = {**FILES_AND_FLAGS, "still life": (None, [])}
PICKED = *TUNED, *(scene for scene in FILES if scene not in TUNED)
SAME, LOST = 2.5, 6.0  # CIELAB: what looks like the paper, and across a lost outline
ACROSS = 4  # px from the outline to the places that are compared
ROUNDS, TIMED = 30, ("koala", "truck", "spinach")  # of frames in turns
FLECK, DRAWN = 40, 0.01  # px^2, and opacity of a piece that can be seen
BESIDE, MARKED = 6, 0.1  # px from hatching, and how much darker than the ground its pixels are


class Drawing:
    """A drawing, and the plain picture of its scene in the same view."""

    def __init__(self, scene: str, look: str, *more: str) -> None:
        file, flags = FILES[scene]
        path = str(FOLDER / file) if file else "still_life.ply"
        args = parse(["render", path, *flags, "--look", look, "--size", SIZE, "-o", "drawing.png", *more])
        self.source = scene_source(args) if file else SCENES[scene].source()
        self.config = paint_config(args)
        report = Report()
        self.found: Prepared = prepare(self.source, self.config, report, asks=(*PICTURE, "scene"))
        self.rgb: Array = np.clip(paint_view(self.found, report).over((1, 1, 1)), 0, 1)
        plain = render(self.found.whole_scene, self.found.camera, "gaussian", depth=False)
        self.subject: Mask = plain.alpha > 0.5
        straight = np.clip(plain.straight_colors(), 0, 1).reshape(-1, 3).astype(np.float64)
        self.plain: F64 = lab_of(straight)[:, 0].reshape(self.subject.shape)

    def painted(self, name: str) -> Mask:
        """[H, W] what the strokes of a coat cover by half, as soft paint."""
        painting = self.found.painting
        (coat,) = (replace(one, effect=None) for one in painting.coats if one.name == name)
        return replace(painting, coats=(coat,), surface=None).frame(self.found.camera).alpha > 0.5

    @property
    def lab(self) -> F64:
        """[H, W, 3] of the drawing."""
        return lab_of(self.rgb.reshape(-1, 3).astype(np.float64)).reshape(self.rgb.shape)


def charcoal(drawing: Drawing) -> list[str]:
    """Correlations and range."""
    light, subject = drawing.lab[..., 0], drawing.subject

    def correlation(part: Mask) -> str:
        weight = np.maximum(squinted(part.astype(float)), 1e-9)
        pairs = [(squinted(part * one) / weight)[part] for one in (drawing.plain, light)]
        return f"{np.corrcoef(*pairs)[0, 1]:.2f}"

    seen = Squint.of(drawing.rgb, subject.astype(float))
    return [correlation(subject), correlation(subject & drawing.painted("masses")), f"{seen.range:.0f}"]


def ink(drawing: Drawing) -> list[str]:
    """Blacks, hatching and flecks."""
    painting, camera = drawing.found.painting, drawing.found.camera
    coats = {coat.name: coat for coat in painting.coats}
    laid, hatched = (
        replace(painting, coats=tuple(coats[name] for name in names if name in coats), surface=None)
        .with_depth(True)
        .frame(camera)
        for names in (("ground",), ("ground", "hatching", "crossed"))
    )
    covered = laid.alpha > 0.5
    black = covered & (laid.rgb.mean(axis=2) < 0.4)
    regions = ndimage.label(black)[1]
    labels, count = ndimage.label(drawing.lab[..., 0] < 50, np.ones((3, 3)))
    areas = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    flecks = areas[areas < FLECK].sum() / max(areas.sum(), 1)
    lengths = np.zeros(0)
    if (coat := coats.get("hatching")) is not None and coat.chains is not None:
        boxes = coat.boxes(camera)[0]  # those that the view leaves out as too dense are there, but not drawn
        drawn = boxes.half_extents[:, 0] * (boxes.opacities > DRAWN)
        own = np.bincount(coat.chains[boxes.ids], 2 * drawn)
        lengths = own[own > 0]
    hatch = f"{np.median(lengths):.0f}" if len(lengths) else "-"
    low, median, high = np.percentile(drawing.plain[drawing.subject], (40, 50, 60))
    middle = drawing.subject & (drawing.plain >= low) & (drawing.plain <= high)
    marked = laid.over((1, 1, 1)).mean(axis=2) - hatched.over((1, 1, 1)).mean(axis=2) > MARKED
    beside = ndimage.distance_transform_edt(~marked) <= BESIDE
    shares = f"{black.sum() / covered.sum():.1%}", str(regions), hatch, f"{beside[middle].mean():.0%}"
    return [f"{median:.0f}", *shares, f"{flecks:.1%}"]


def watercolour(drawing: Drawing) -> list[str]:
    """Paper, darks and lost outline."""
    lab, surface = drawing.lab, drawing.found.painting.surface
    assert surface is not None, "watercolour has a paper"
    paper = lab_of(surface.rgb.reshape(-1, 3).astype(np.float64)).reshape(lab.shape)
    white = float((np.linalg.norm(lab - paper, axis=2) < SAME).mean())
    outlines = drawing.subject, drawing.painted("wash")
    lost = ("-" if (share := lost_share(lab, one)) is None else f"{share:.0%}" for one in outlines)
    return [f"{white:.0%}", f"{np.percentile(lab[..., 0], 2):.0f}", *lost]


def lost_share(lab: F64, subject: Mask) -> float | None:
    """Share of the outline across which a picture, CIELAB, hardly changes; None for full pictures."""
    inside = ndimage.gaussian_filter(subject.astype(np.float64), 2.0)
    down, right = np.gradient(inside)
    slope = np.hypot(down, right)
    edge = subject & ~ndimage.binary_erosion(subject, border_value=1) & (slope > 1e-6)
    rows, columns = np.nonzero(edge)
    far = 3 * ACROSS
    kept = (rows > far) & (columns > far) & (rows < len(lab) - far) & (columns < lab.shape[1] - far)
    rows, columns = rows[kept], columns[kept]
    if len(rows) < 0.2 * sum(subject.shape):
        return None
    soft = ndimage.gaussian_filter(lab, (1.5, 1.5, 0))
    step = np.stack([down, right])[:, rows, columns] / slope[rows, columns]
    places = np.stack([rows, columns])
    inner, outer = (soft[tuple((places + side * ACROSS * step).round().astype(int))] for side in (1, -1))
    return float((np.linalg.norm(inner - outer, axis=1) < LOST).mean())


def svg(drawing: Drawing) -> list[str]:
    """Likeness of the SVG, and its size."""
    import cairosvg
    from PIL import Image

    report = Report()
    frame = paint_view(drawing.found, report, wanted=Wanted(paths=True))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drawing.svg"
        write_picture(frame, path, drawing.found.background, drawing.config, report)
        text = path.read_bytes()
    picture = Image.open(io.BytesIO(cairosvg.svg2png(bytestring=text))).convert("RGB")
    return [f"{psnr(np.asarray(picture) / 255, drawing.rgb):.1f}", f"{len(text) / 1e6:.1f}"]


def frames_of_oil(scene: str) -> list[str]:
    """Milliseconds of a frame of oil with 6000 strokes and of watercolour, in turns, and their ratio."""
    size = "--size", "1280x720"
    drawings = Drawing(scene, "oil", *size, "--strokes", "6000"), Drawing(scene, "watercolour", *size)
    seconds: tuple[list[float], ...] = [], []
    for _ in range(ROUNDS + 1):
        for own, drawing in zip(seconds, drawings, strict=True):
            painting, start = drawing.found.painting.with_depth(False), time.perf_counter()
            painting.frame(drawing.found.camera)
            own.append(time.perf_counter() - start)
    oil, wet = (own[1:] for own in seconds)  # the first fill caches
    low, middle, high = np.percentile(np.divide(wet, oil), (25, 50, 75))
    return [f"{1000 * np.median(own):.0f}" for own in (oil, wet)] + [
        f"{middle:.1f} ({low:.1f} to {high:.1f})"
    ]


def can_draw_svg() -> bool:
    """Whether CairoSVG is here, with the library that it needs."""
    try:
        import cairosvg  # noqa: F401
    except (ImportError, OSError):
        return False
    return True


FIGURES: dict[str, tuple[Callable[[Drawing], list[str]], str]] = {
    "charcoal": (charcoal, "correlation, of strokes, range"),
    "ink": (
        lambda drawing: ink(drawing) + svg(drawing),
        "median L*, black, regions, hatch px, middle hatched, flecks, SVG dB, MB",
    ),
    "hatching": (svg, "SVG dB, MB"),
    "watercolour": (watercolour, "paper, darkest 2 % L*, outline lost, of strokes"),
    "stippling": (svg, "SVG dB, MB"),
}
WITH_SVG = {"ink", "hatching", "stippling"}
AIMS: tuple[tuple[str, str, float | None, float | None], ...] = (  # look, column, and its least and most
    ("charcoal", "of strokes", 0.9, None),
    ("charcoal", "range", 40, None),
    ("watercolour", "paper", 8, None),
    ("watercolour", "darkest 2 % L*", None, 25),
    ("watercolour", "of strokes", 25, 40),
    ("ink", "black", 12, 22),
    ("ink", "regions", None, 25),
    ("ink", "hatch px", 20, None),
    ("ink", "flecks", None, 1),
    *((look, "SVG dB", 30, None) for look in ("ink", "hatching", "stippling")),
    *((look, "MB", None, 5) for look in ("ink", "hatching", "stippling")),
)
MEDIAN, MIDDLE = "median L*", (30, 70)  # aims of ink alone are for scenes in between


def aims(page: str) -> list[list[str]]:
    """How many scenes of the tables of a page meet each aim, and which miss it by how much."""
    found = [["aim", "met by", "missed by"]]
    for look, column, least, most in AIMS:
        block = page.split(f"<!-- {look} -->")[1].split(f"<!-- end of {look} -->")[0]
        written = block.strip().split("\n")
        head, _, *lines = ([cell.strip() for cell in line.split("|")[1:-1]] for line in written)
        rows = [dict(zip(head, line, strict=True)) for line in lines]
        if MEDIAN in head and column not in ("SVG dB", "MB"):
            rows = [row for row in rows if MIDDLE[0] <= float(row[MEDIAN]) <= MIDDLE[1]]
        values = {row["scene"]: float(row[column].rstrip("%")) for row in rows if row[column] != "-"}
        missing = {
            scene: max((least or value) - value, value - (most or value)) for scene, value in values.items()
        }
        missed = [f"{scene} by {by:.2g}" for scene, by in missing.items() if by > 0]
        aim = " to ".join(f"{end:g}" for end in (least, most) if end is not None)
        bound = "" if least and most else "at least " if least else "at most "
        met = f"{len(values) - len(missed)} of {len(values)}"
        found.append([f"{look}: {column} {bound}{aim}", met, ", ".join(missed) or "-"])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", choices=[*PICKED, []], metavar="SCENE")
    parser.add_argument("--looks", nargs="*", choices=FIGURES, default=list(FIGURES), metavar="LOOK")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures")
    parser.add_argument("--frames", action="store_true", help="times frames instead")
    parser.add_argument("--page", type=Path, help="gets the tables between its marks")
    asked = parser.parse_args()
    if WITH_SVG & set(asked.looks) and not can_draw_svg():
        others = " ".join(look for look in FIGURES if look not in WITH_SVG)
        parser.error(f"CairoSVG draws the SVG files; pip install cairosvg, or give --looks {others}")
    print(describe(), flush=True)
    scenes = present(asked.scenes or PICKED, {name: file for name, (file, _) in FILES.items()})
    if asked.frames:
        table = [["scene", "oil, ms", "watercolour, ms", "watercolour / oil"]]
        table += [[scene, *frames_of_oil(scene)] for scene in scenes if scene in TIMED]
        print(*table, sep="\n")
        if asked.page:
            asked.page.write_text(placed(asked.page.read_text(), "frames", markdown(table)))
        return
    for look in asked.looks:
        measure, head = FIGURES[look]
        table = [["scene", *head.split(", ")]]
        for scene in scenes:
            drawing = Drawing(scene, look)
            table.append([scene, *measure(drawing)])
            print(look, *table[-1], flush=True)
            if asked.pictures:
                opaque = np.ones(drawing.subject.shape, np.float32)
                bg.save(bg.Frame(drawing.rgb, opaque, None), asked.pictures / f"{scene}-{look}.png")
        if asked.page:
            asked.page.write_text(placed(asked.page.read_text(), look, markdown(table)))
    if asked.page:
        page = asked.page.read_text()
        asked.page.write_text(placed(page, "aims", markdown(aims(page))))


if __name__ == "__main__":
    main()
