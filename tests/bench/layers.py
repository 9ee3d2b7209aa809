"""What the layers of an EXR file cost: time of each beside that of the frame, of writing, and bytes.

    python -m tests.bench.layers [SCENE ...]

1280 x 720, oil with its relief and lamp, and 7000 flat strokes without; the second view of an orbit of 240,
the motion to the third. The layers take turns, medians of 7 rounds after one that fills the caches; each is
measured alone, so what several share counts for each.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import brushgs as bg
from brushgs.formats.pictures.images import write_frame
from brushgs.options.choices import LAYERS
from brushgs.options.look import Look
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.track import track_directions
from brushgs.rendering.wanted import Following, Wanted
from tests.bench.machine import describe
from tests.bench.strokes import SCENES, markdown

SIZE = 1280, 720
ROUNDS = 7
LOOKS = {
    "oil": Look.open("oil").config,
    "flat, plain": PaintConfig(cluster=ClusterConfig(strokes=7000), draw=DrawConfig(stroke="flat")),
}


def painter_of(prepared: Prepared) -> Callable[[tuple[str, ...], bool], bg.Frame]:
    """Paints the second view with these layers, or deep."""
    closed, painting = [*prepared.cameras, prepared.cameras[0]], prepared.painting
    tracks = [track_directions(coat.strokes, closed) for coat in painting.coats]
    here, there = (tuple(track.directions(index) for track in tracks) for index in (1, 2))
    following = Following(painting.coats, prepared.cameras[2], there, 1)

    def paint(layers: tuple[str, ...], deep: bool) -> bg.Frame:
        motion = following if "motion" in layers else None
        wanted = Wanted(layers, deep, motion)
        return painting.with_depth("depth" in layers).frame(prepared.cameras[1], here, wanted=wanted)

    return paint


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - start)


def rows_of(scene: str, look: str) -> list[list[str]]:
    config = LOOKS[look]
    config = PaintConfig(**vars(config) | {"view": ViewConfig(size=SIZE)})
    prepared = prepare(SCENES[scene].source(), config, Report(), views=PathConfig(orbit=240))
    paint, cases = painter_of(prepared), {"frame": ((), False)}
    cases |= {name: ((name,), False) for name in LAYERS}
    cases |= {"all": (tuple(LAYERS), False), "deep": ((), True)}
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS + 1):
        for name, (layers, deep) in cases.items():
            seconds[name].append(timed(lambda layers=layers, deep=deep: paint(layers, deep)))
    took = {name: median(each[1:]) for name, each in seconds.items()}
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, (layers, deep) in cases.items():
            frame, path = paint(layers, deep), Path(folder) / "frame.exr"
            writing = median(timed(lambda frame=frame, path=path: write_frame(frame, path)) for _ in range(3))
            added = took[name] if name == "frame" else took[name] - took["frame"]
            size = path.stat().st_size / 1e6
            rows.append([scene, look, name, f"{added:.0f}", f"{writing:.0f}", f"{size:.1f}"])
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["koala"])
    scenes = parser.parse_args().scenes
    print(describe())
    rows = [row for scene in scenes for look in LOOKS for row in rows_of(scene, look)]
    print(markdown([["scene", "look", "layer", "ms more", "ms to write", "MB"], *rows]))


if __name__ == "__main__":
    main()
