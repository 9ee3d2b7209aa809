"""How true the page is to the exact renderer, and what it costs a browser.

    python -m examples.benchmarks.page [SCENE ...] [--tables NAME ...] [--page FILE]

Debian's Chromium paints, on a software renderer (SwiftShader), driven by Playwright. Its frames a second say
nothing about a graphics processor, so none are told: vertices, fragments and texture reads are.
- likeness: 640 x 480, every look: the page with its strokes sorted by depth, as it opens and as the exact
  renderer does it, and by distance, as in a headset, against the picture of `render`: PSNR in dB, and the
  share of pixels of which no channel is off by more than 4 of 255.
- boxes: the largest differences to `project`, of `--look plain` with 7000 strokes, 1280 x 720, in the first
  view and an orbit of 12; those of boxes longer than the picture as if they were as long.
- order: milliseconds to sort strokes from ever new places, median and quartiles of 101 times 10.
- pages: what `brushgs export` writes. Fragments are of a picture of 1280 x 720. Reads are of textures:
  those of the vertices for each stroke, and those of the fragments.
- running: from opening the file to the first picture, median, least and most of 5; memory with that page
  beyond that of a blank one, of the JavaScript heap and of the processes that run the page and paint it;
  pictures that are drawn in 2 s after the last movement.
"""

import argparse
import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.cameras.orbit import orbit
from brushgs.measure.likeness import psnr
from brushgs.options.choices import LOOKS, PLAIN_LOOK
from brushgs.options.look import Look
from brushgs.options.painting import ClusterConfig, PaintConfig, ViewConfig
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import PageContents, page_contents
from brushgs.outlets.page.export import view_of
from brushgs.outlets.page.weight import Weight, fragments_of
from brushgs.outlets.page.write import write_page
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life
from examples.benchmarks.curves import placed
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present
from examples.benchmarks.strokes import markdown
from tests.chromium import CHROMIUM, FLAGS
from tests.outlets.page.studio import Studio, encoded

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SMALL, LARGE = (640, 480), (1280, 720)
SCENES = {"still life": None, "koala": "koala.ply", "truck": "truck.splat"}
NEAR_ENOUGH = 4 / 255
NUM_SORTS = 101
REST_SECONDS = 2.0
NUM_OPENINGS = 5
MEMORY_FLAGS = ["--enable-precise-memory-info", "--js-flags=--expose-gc"]
PAINTED = ("renderer", "gpu-process")  # kinds of processes of Chromium: what runs a page, and what paints


@cache
def source(scene: str) -> Any:
    """The example scene, or the path of a real one."""
    file = SCENES[scene]
    return still_life(60_000) if file is None else FOLDER / file


def config_of(look: str, size: tuple[int, int], strokes: int | None = None, stroke: str = "") -> PaintConfig:
    """What the command would be told."""
    config = replace(Look.open(look).config, view=ViewConfig(size=size))
    if strokes is not None:
        config = replace(config, cluster=replace(config.cluster or ClusterConfig(), strokes=strokes))
    if stroke:
        config = replace(config, draw=replace(config.draw, stroke=stroke))
    return config


def loaded(studio: Studio, prepared: Prepared, config: PaintConfig) -> PageContents:
    """Hand a painting to the painter of the page, as `export` would."""
    background = prepared.background
    contents = page_contents(
        prepared.painting,
        prepared.camera,
        view=view_of(prepared, config),
        title="",
        command=("", ()),
        background=None if background is None else np.asarray(background),
    )
    studio.page.evaluate("data => studio.load(data)", encoded(write_container(contents)))
    return contents


# -- likeness ----------------------------------------------------------------------------------------------


def likeness_table(studio: Studio, scenes: Sequence[str], _: Path) -> list[list[str]]:
    """PSNR and the share of pixels that are near enough, by depth and by distance."""
    table = [
        ["scene", "look", "strokes", "by depth: dB", "within 4", "by distance: dB", "within 4", "largest"]
    ]
    for scene in scenes:
        for look in LOOKS:
            config = config_of(look, SMALL)
            prepared = prepare(source(scene), config, Report(), asks=(*PICTURE, "first_view"))
            contents = loaded(studio, prepared, config)
            background = (1.0, 1.0, 1.0) if prepared.background is None else prepared.background
            truth = prepared.painting.with_depth(False).frame(prepared.camera).over(background)
            cells = [scene, look, f"{contents.num_strokes:,}"]
            for order in ("depth", "distance"):
                shown = studio.paint(prepared.camera, order=order, ground=True)
                picture = shown[..., :3] + (1 - shown[..., 3:])  # what is transparent is on white
                off = np.abs(np.clip(picture, 0, 1) - np.clip(truth, 0, 1)).max(axis=-1)
                cells += [f"{psnr(picture, truth):.1f}", f"{100 * (off <= NEAR_ENOUGH).mean():.2f} %"]
            table.append([*cells, f"{255 * off.max():.0f}"])
            print(table[-1], flush=True)
    return table


# -- boxes -------------------------------------------------------------------------------------------------


def boxes_table(studio: Studio, scenes: Sequence[str], _: Path) -> list[list[str]]:
    """The largest differences of boxes to `project`."""
    table = [["scene", "boxes", "center, px", "half extent, px", "rim by direction, px", "opacity", "color"]]
    for scene in scenes:
        config = config_of(PLAIN_LOOK, LARGE, 7000)
        prepared = prepare(source(scene), config, Report(), asks=(*PICTURE, "first_view"))
        rows = loaded(studio, prepared, config).rows[0]
        coat = prepared.painting.coats[0]
        order = np.full(int(rows.max()) + 1, -1)
        order[rows] = np.arange(len(rows))
        count, worst = 0, np.zeros(5)
        ring = orbit(prepared.first_view, 12, width=LARGE[0], height=LARGE[1])
        for camera in (prepared.camera, *ring):
            exact = coat.boxes(camera)[0]
            found = studio.boxes(camera)[order[exact.ids]]
            turn = 2 * np.sin((found[:, 4] - exact.angles) / 2)
            reach = exact.half_extents.max(axis=1)
            smaller = np.minimum(1, LARGE[0] / 2 / reach)
            each = (
                np.abs(found[:, :2] - exact.centers) * smaller[:, None],
                np.abs(found[:, 2:4] - exact.half_extents) * smaller[:, None],
                np.abs(turn * reach) * smaller,
                np.abs(found[:, 6] - exact.opacities),
                np.abs(found[:, 8:11] - exact.colors),
            )
            worst = np.maximum(worst, [part.max() for part in each])
            count += len(exact)
        table.append([scene, f"{count:,}", *(f"{value:.1e}" for value in worst)])
        print(table[-1], flush=True)
    return table


# -- order -------------------------------------------------------------------------------------------------

SORTING = """([count, hasUnderpaint, times]) => {
  const means = Float32Array.from({ length: 3 * count }, () => 2 * Math.random() - 1);
  const setbacks = hasUnderpaint ? Float32Array.from({ length: count }, () => 0.1 * Math.random()) : null;
  return studio.sortTimes(means, setbacks, times);
}"""
SORTS = """
window.studio.sortTimes = (means, setbacks, times) => {
  const order = new StrokeOrder(means, setbacks);
  const found = [];
  for (let round = -2; round < times; round++) {
    const start = performance.now();
    for (let i = 0; i < 10; i++) {
      const angle = 10 * round + i;
      order.sort(means.length / 3, [3 * Math.sin(angle), 0.2, 3 * Math.cos(angle)], null);
    }
    if (round >= 0) found.push((performance.now() - start) / 10); // the clock has steps of 0.1 ms
  }
  return found;
};
"""


def order_table(studio: Studio, *_: Any) -> list[list[str]]:
    """Milliseconds of sorting."""
    table = [["strokes", "ms", "with underpaint, ms"]]
    for count in (7000, 50_000):
        cells = [f"{count:,}"]
        for has_underpaint in (False, True):
            times = studio.page.evaluate(SORTING, [count, has_underpaint, NUM_SORTS])
            low, middle, high = quantiles(times, n=4)
            cells.append(f"{middle:.2f} ({low:.2f} - {high:.2f})")
        table.append(cells)
        print(table[-1], flush=True)
    return table


# -- pages -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """A page, and the flags that make it."""

    scene: str
    look: str
    strokes: int | None = None
    stroke: str = ""
    is_matt: bool = False  # of degree 0: colors are the same from all sides

    @property
    def name(self) -> str:
        return f"{self.scene}, {self.facts}"

    @property
    def facts(self) -> str:
        """The flags."""
        values = {"--look": self.look, "--strokes": self.strokes, "--stroke": self.stroke}
        flags = " ".join(f"{flag} {value}" for flag, value in values.items() if value)
        return f"`{flags}`" + (", degree 0" if self.is_matt else "")


PLAIN_KINDS = tuple(
    Kind("still life", PLAIN_LOOK, count, "flat", is_matt)
    for count in (7000, 50_000)
    for is_matt in (True, False)
)
KINDS = (
    *PLAIN_KINDS,
    *(Kind(scene, PLAIN_LOOK, count, "flat") for scene in ("koala", "truck") for count in (7000, 50_000)),
    *(Kind(scene, look) for scene in SCENES for look in LOOKS if look != PLAIN_LOOK),
)


def exported(kind: Kind, folder: Path) -> tuple[Path, Prepared, PaintConfig, Weight]:
    """The file of a page, and what it was made of."""
    path = folder / (re.sub(r"\W+", "-", kind.name) + ".html")
    config = config_of(kind.look, LARGE, kind.strokes, kind.stroke)
    given = source(kind.scene)
    if kind.is_matt:
        given = replace(given, sh=given.sh[:, :1])
    prepared = prepare(given, config, Report(), asks=(*PICTURE, "first_view"))
    weight = write_page(
        prepared.painting,
        prepared.camera,
        path,
        view=view_of(prepared, config),
        title=kind.scene,
        command=(f"{kind.scene}.ply", ["--look", kind.look]),
        background=prepared.background,
    )
    return path, prepared, config, weight


def pages_table(studio: Studio, scenes: Sequence[str], folder: Path) -> list[list[str]]:
    """Sizes of files and of a frame."""
    heading = (
        "scene | page | MB | strokes | SH | vertices | fragments, million | overdraw | reads by vertices, "
        "million | by fragments, million | passes | brushes, MB | targets, MB"
    )
    table = [heading.split(" | ")]
    for kind in (each for each in KINDS if each.scene in scenes):
        path, prepared, config, weight = exported(kind, folder)
        header = loaded(studio, prepared, config).header
        studio.paint(prepared.camera, order="distance", ground=True)
        counts = studio.page.evaluate("() => studio.painter.counts")
        reads = reads_of(prepared, header)
        table.append(
            [
                kind.scene,
                kind.facts,
                f"{path.stat().st_size / 1e6:.2f}",
                f"{counts['strokes']:,}",
                ", ".join(str(coat["shDegree"]) for coat in header["coats"]),
                f"{counts['vertices']:,}",
                f"{weight.fragments / 1e6:.1f}",
                f"{weight.overdraw:.1f}",
                *(f"{count / 1e6:.2f}" for count in reads),
                str(counts["passes"]),
                f"{counts['atlasBytes'] / 1e6:.1f}",
                f"{counts['targetBytes'] / 1e6:.1f}",
            ]
        )
        print(table[-1], flush=True)
    return table


def reads_of(prepared: Prepared, header: Mapping[str, Any]) -> tuple[float, float]:
    """Texels that vertices and fragments of strokes read for the first view, at most.

    Each of the four corners of a stroke reads its 3 texels, one more with relief or border, one more with
    normals, its color, and 3 of the table of brushes. A fragment of a stroke reads its brush, the bristles
    where there are streaks, and 2 of the canvas where it is tested against it; of underpaint no brush.
    """
    by_vertices = by_fragments = 0.0
    for number, (coat, facts) in enumerate(zip(prepared.painting.coats, header["coats"], strict=True)):
        columns, is_image = facts["arrays"], facts["kernel"] == "image"
        own = 3 + ("relief" in columns or "chance" in columns) + ("normals" in columns)
        own += (facts["shDegree"] + 1) ** 2
        by_vertices += 4 * facts["count"] * (own + (3 if is_image else 0))
        by_vertices += 4 * facts["count"] * own if facts["underpaint"] else 0
        painted, behind = fragments_of(coat, coat.boxes(prepared.camera)[0], prepared.camera)
        each = (facts["streaks"] > 0 and is_image) + 2 * (facts["tolerance"] is not None and number > 0)
        by_fragments += painted * (each + is_image) + behind * each
    return by_vertices, by_fragments


# -- running -----------------------------------------------------------------------------------------------


def running_table(scenes: Sequence[str], folder: Path) -> list[list[str]]:
    """Seconds to the first picture, memory, and pictures drawn at rest."""
    heading = "scene | page | first picture, s | heap, MB | processes, MB | drawn at rest"
    table = [heading.split(" | ")]
    for kind in (each for each in (*PLAIN_KINDS, Kind("koala", "oil")) if each.scene in scenes):
        path = exported(kind, folder)[0]
        waited, heaps, processes, drawn = [], [], [], []
        for _ in range(NUM_OPENINGS):
            with chromium(*MEMORY_FLAGS) as browser:
                blank = browser.new_page(viewport={"width": LARGE[0], "height": LARGE[1]})
                blank.goto("about:blank")
                before = memory_of(blank)
                page = browser.new_page(viewport={"width": LARGE[0], "height": LARGE[1]})
                page.goto(path.as_uri())
                page.evaluate("() => brushgs.ready")
                waited.append(page.evaluate("() => brushgs.firstPictureMs") / 1000)
                page.keyboard.press("ArrowLeft")  # stops the turning
                start = settled(page)
                page.wait_for_timeout(1000 * REST_SECONDS)
                drawn.append(page.evaluate("() => brushgs.framesDrawn") - start)
                after = memory_of(page)
                heaps.append(after[0])
                processes.append(after[1] - before[1])
        table.append(
            [
                kind.scene,
                kind.facts,
                f"{median(waited):.2f} ({min(waited):.2f} - {max(waited):.2f})",
                f"{median(heaps):.0f}",
                f"{median(processes):.0f}",
                str(max(drawn)),
            ]
        )
        print(table[-1], flush=True)
    return table


def settled(page: "Page") -> int:
    """Pictures drawn until a page moves no more, which takes it some seconds on this renderer."""
    for _ in range(240):
        if page.evaluate("() => !brushgs._request && brushgs._drawnAt === null"):
            return int(page.evaluate("() => brushgs.framesDrawn"))
        page.wait_for_timeout(500)
    raise TimeoutError("running: the page did not come to rest in two minutes")


def memory_of(page: "Page") -> tuple[float, float]:
    """MB of the JavaScript heap, and of the processes that run pages and paint them."""
    page.evaluate("() => globalThis.gc?.()")
    heap = page.evaluate("() => performance.memory.usedJSHeapSize")
    return heap / 1e6, sum(_own_megabytes(process) for process in _painting_processes())


def _painting_processes() -> Iterator[Path]:
    """Those of Chromium that descend from this one."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        with suppress(OSError):  # it ended meanwhile
            parents[int(status.parent.name)] = int(re.search(r"PPid:\s+(\d+)", status.read_text())[1])
    for process in parents:
        ancestor = process
        while ancestor not in (0, os.getpid()):
            ancestor = parents.get(ancestor, 0)
        command = Path(f"/proc/{process}/cmdline")
        with suppress(OSError):
            if ancestor and any(f"--type={kind}" in command.read_text() for kind in PAINTED):
                yield command.parent


def _own_megabytes(process: Path) -> float:
    """Memory of a process, each shared page counted by its share."""
    with suppress(OSError):
        found = re.search(r"^Pss:\s+(\d+) kB", (process / "smaps_rollup").read_text(), re.MULTILINE)
        return int(found[1]) / 1000 if found else 0.0
    return 0.0


@contextmanager
def chromium(*flags: str) -> Iterator["Browser"]:
    """A browser of its own."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, *flags])
        try:
            yield browser
        finally:
            browser.close()


TABLES = {"likeness": likeness_table, "boxes": boxes_table, "order": order_table, "pages": pages_table}
NAMES = [*TABLES, "running"]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE")
    parser.add_argument("--tables", nargs="*", choices=NAMES, default=NAMES, metavar="NAME")
    parser.add_argument("--page", type=Path, help="gets the tables between its marks")
    asked = parser.parse_args()
    print(describe(), flush=True)
    scenes = present(asked.scenes or SCENES, SCENES)
    with tempfile.TemporaryDirectory() as folder:
        for name in asked.tables:
            if name in TABLES:
                with chromium() as browser:
                    table = TABLES[name](Studio(browser.new_page(), SORTS), scenes, Path(folder))
            else:
                table = running_table(scenes, Path(folder))
            print(f"\n{markdown(table)}")
            if asked.page:
                asked.page.write_text(placed(asked.page.read_text(), name, markdown(table)))


if __name__ == "__main__":
    main()
